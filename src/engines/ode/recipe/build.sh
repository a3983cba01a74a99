# Builds ODE with its own CMake files as a static library.
fetch_debian "${recipe}/pins.txt"
tar -xzf "${fetched}"/ode_0.16.6.orig.tar.gz -C "${work}"
folder="${out}/ode-0.16.6"
# Cylinders against boxes stay with ODE's own collision function, which finds several points; libccd finds one.
cmake -S "${work}/ode-0.16.6" -B "${work}/build" -G Ninja -DCMAKE_BUILD_TYPE=None -DCMAKE_C_FLAGS="${flags} -w" \
  -DCMAKE_CXX_FLAGS="${flags} -w" -DBUILD_SHARED_LIBS=OFF -DCMAKE_POSITION_INDEPENDENT_CODE=ON \
  -DCMAKE_CXX_VISIBILITY_PRESET=hidden -DCMAKE_C_VISIBILITY_PRESET=hidden -DCMAKE_INSTALL_LIBDIR=lib \
  -DODE_DOUBLE_PRECISION=ON -DODE_WITH_DEMOS=OFF -DODE_WITH_TESTS=OFF -DODE_WITH_LIBCCD=ON \
  -DODE_WITH_LIBCCD_BOX_CYL=OFF -DCMAKE_INSTALL_PREFIX="${folder}" -DCMAKE_POLICY_VERSION_MINIMUM=3.5
ninja -C "${work}/build" install
rm -rf "${folder:?}/share" "${folder:?}/bin"
cp "${work}"/ode-0.16.6/LICENSE*.TXT "${folder}"
cp "${work}/ode-0.16.6/libccd/BSD-LICENSE" "${folder}/LICENSE-libccd.txt"
write_facts "${folder}" "ODE 0.16.6, the authors' sources" "${compiler}" "${flags}"
