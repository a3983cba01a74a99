# Builds the static library in double precision; the recipe of bullet-f32 asks for single.
precision="${precision:-f64}"
bullet="${root}/src/engines/bullet/recipe"
double=OFF
[[ ${precision} == f64 ]] && double=ON
folder="${out}/bullet-3.2.7-${precision}"
fetch_sdist "${bullet}/pins.txt"
tar -xzf "${fetched}"/pybullet-*.tar.gz -C "${work}" --wildcards '*/src/*' '*/LICENSE.txt'
cmake -S "${bullet}" -B "${work}/build" -G Ninja -DCMAKE_BUILD_TYPE=None -DCMAKE_CXX_FLAGS="${flags}" \
  -DBULLET_SOURCE="$(echo "${work}"/pybullet-*)" -DBULLET_DOUBLE=${double} -DCMAKE_INSTALL_PREFIX="${folder}"
ninja -C "${work}/build" install
write_facts "${folder}" "PyPI pybullet 3.2.7, its C++ sources" "${compiler}" "${flags}"
