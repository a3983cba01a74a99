# Builds Simbody's three libraries with its own CMake files, statically, without its window, examples and tests.
fetch_debian "${recipe}/pins.txt"
mkdir "${work}/source"
tar -xJf "${fetched}"/simbody_3.7+dfsg.orig.tar.xz -C "${work}/source" --strip-components 1
# Two thirds of it are not needed: optimisers, contact, cables, a window.
# shellcheck disable=SC2086  # a line is a pattern of files
(cd "${work}/source" && grep -v '^#' "${recipe}/unused.txt" | while read -r files; do rm -- ${files}; done)
cp "${recipe}/no_ipopt.cpp" "${work}/source/SimTKmath/Optimizers/src/InteriorPointOptimizer.cpp"
folder="${out}/simbody-3.7"
cmake -S "${work}/source" -B "${work}/build" -G Ninja -DCMAKE_BUILD_TYPE=None -DCMAKE_C_FLAGS="${flags} -w" \
  -DCMAKE_CXX_FLAGS="${flags} -w" -DCMAKE_POSITION_INDEPENDENT_CODE=ON -DCMAKE_C_VISIBILITY_PRESET=hidden \
  -DCMAKE_CXX_VISIBILITY_PRESET=hidden -DCMAKE_VISIBILITY_INLINES_HIDDEN=ON -DBUILD_STATIC_LIBRARIES=ON \
  -DBUILD_DYNAMIC_LIBRARIES=OFF -DBUILD_TESTING=OFF -DBUILD_EXAMPLES=OFF -DBUILD_VISUALIZER=OFF -DINSTALL_DOCS=OFF \
  -DCMAKE_INSTALL_LIBDIR=lib -DCMAKE_INSTALL_PREFIX="${folder}" -DCMAKE_POLICY_VERSION_MINIMUM=3.5
ninja -C "${work}/build" install
rm -rf "${folder}/share"
cp "${work}/source/LICENSE.txt" "${folder}"
write_facts "${folder}" "Simbody 3.7, the authors' sources" "${compiler}" "${flags}"
