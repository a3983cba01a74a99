# Builds the static library once a precision.
fetch_sdist "${recipe}/pins.txt"
tar -xzf "${fetched}"/pybullet-*.tar.gz -C "${work}" --wildcards '*/src/*' '*/LICENSE.txt'
for precision in f32 f64; do
  double=OFF
  [[ ${precision} == f64 ]] && double=ON
  folder="${out}/bullet-3.2.7-${precision}"
  cmake -S "${recipe}" -B "${work}/build-${precision}" -G Ninja -DCMAKE_BUILD_TYPE=None \
    -DCMAKE_CXX_FLAGS="${flags}" -DBULLET_SOURCE="$(echo "${work}"/pybullet-*)" -DBULLET_DOUBLE=${double} \
    -DCMAKE_INSTALL_PREFIX="${folder}"
  ninja -C "${work}/build-${precision}" install
  write_facts "${folder}" "PyPI pybullet 3.2.7, its C++ sources" "${compiler}" "${flags}"
done
