# Fetches Jolt's C++ sources with a Rust crate and builds them twice behind jolt_world.h: with positions in single and in
# double precision.
needs cargo 'which fetches the sources of Jolt'
fetch_crates "${recipe}"
jolt="${fetched}/vendor/oxijolt-sys-1.5.0+jolt-5.6.0/vendor/JoltPhysics"

# Unity builds: half of the time, and the compiler sees beyond a file, as it does with Jolt's default of optimising at link time.
wider=OFF
[[ ${build} == baseline ]] || wider=ON
for precision in f32 f64; do
  double=OFF
  [[ ${precision} == f64 ]] && double=ON
  folder="${out}/jolt-5.6.0-${precision}"
  cmake -S "${recipe}" -B "${work}/${precision}" -G Ninja -DCMAKE_BUILD_TYPE=None -DCMAKE_CXX_FLAGS="${flags}" \
    -DJOLT_SOURCE="${jolt}" -DDOUBLE_PRECISION=${double} -DJOLT_V3=${wider} -DCMAKE_UNITY_BUILD=ON \
    -DCMAKE_INSTALL_PREFIX="${folder}"
  ninja -C "${work}/${precision}" install
  write_facts "${folder}" "crate oxijolt-sys 1.5.0, its C++ sources as a unity build" "${compiler}" "${flags}"
done
