# Fetches PhysX's C++ sources with a Rust crate and builds them as a static library.
needs cargo 'which fetches the sources of PhysX'
fetch_crates "${recipe}"
folder="${out}/physx-5.1.3"
cmake -S "${recipe}" -B "${work}/build" -G Ninja -DCMAKE_BUILD_TYPE=None -DCMAKE_CXX_FLAGS="${flags}" \
  -DPHYSX_SOURCE="${fetched}/vendor/physx-sys-0.11.5/physx/physx" -DCMAKE_INSTALL_PREFIX="${folder}"
ninja -C "${work}/build" install
write_facts "${folder}" "crate physx-sys 0.11.5, its C++ sources" "${compiler}" "${flags} -fno-strict-aliasing"
