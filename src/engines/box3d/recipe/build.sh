# Fetches Box3D's C sources with a Rust crate and builds them twice with Box3D's own CMake files: with world positions in
# single and in double precision.
needs cargo 'which fetches the sources of Box3D'
fetch_crates "${recipe}"
box3d="${fetched}/vendor/box3d-sys-0.1.16/vendor/box3d"
for precision in f32 f64; do
  double=OFF
  [[ ${precision} == f64 ]] && double=ON
  folder="${out}/box3d-0.1.0-${precision}"
  cmake -S "${box3d}" -B "${work}/${precision}" -G Ninja -DCMAKE_BUILD_TYPE=None -DCMAKE_C_FLAGS="${flags}" \
    -DCMAKE_CXX_FLAGS="${flags}" -DBUILD_SHARED_LIBS=OFF -DCMAKE_POSITION_INDEPENDENT_CODE=ON -DBOX3D_SAMPLES=OFF \
    -DBOX3D_UNIT_TESTS=OFF -DBOX3D_VALIDATE=OFF -DBOX3D_DOUBLE_PRECISION=${double} \
    -DFETCHCONTENT_BASE_DIR="${work}/none" -DCMAKE_INSTALL_LIBDIR=lib -DCMAKE_INSTALL_PREFIX="${folder}"
  ninja -C "${work}/${precision}" install
  rm -rf "${folder:?}/lib/cmake"
  cp "${box3d}/LICENSE" "${folder}"
  write_facts "${folder}" "crate box3d-sys 0.1.16, its C sources" "${compiler}" "${flags}"
done
