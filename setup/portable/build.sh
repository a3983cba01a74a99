# Makes what the Python package is linked with instead of this machine's shared libraries: Debian 11's C library, which every
# newer system can stand in for, and static libraries. Compiler, headers and flags stay those of a clone. As a recipe of an
# engine; ${out} gets sysroot/ and lib/.
fetch_debian "${recipe}/pins.txt"
for package in "${fetched}"/*.deb; do dpkg-deb -x "${package}" "${out}/sysroot"; done
# seen from here, not from a root of its own
find "${out}/sysroot" -type l -lname '/*' -printf '%p %l\n' | while read -r link target; do
  ln -sfr "${out}/sysroot${target}" "${link}"
done
mkdir -p "${out}/lib"
for archive in "${fetched}"/*.tar.*; do
  mkdir "${work}/source"
  tar -xf "${archive}" -C "${work}/source"
  mv "${work}/source"/* "${work}/"
  rmdir "${work}/source"
done

# The newer symbols of libstdc++ go in, the others stay the system's: one library has the exceptions and streams of a process.
compiler_files="$(dirname "$(${CXX:-c++} -print-file-name=libstdc++.a)")"
echo "INPUT(${folder}/sysroot/usr/lib/x86_64-linux-gnu/libstdc++.so.6 ${compiler_files}/libstdc++.a)" >"${out}/lib/libstdc++.so"
${CC:-cc} -O2 -fPIC -c "${recipe}/newer_glibc.c" -o "${out}/lib/newer_glibc.o"
# all of it is in the header, whose package has the library only shared
echo '#include <toml++/toml.h>' >"${work}/toml.cc"
${CXX:-c++} -std=c++20 -O2 -fPIC -DTOML_IMPLEMENTATION -DTOML_HEADER_ONLY=0 -c "${work}/toml.cc" -o "${work}/toml.o"
ar rc "${out}/lib/libtomlplusplus.a" "${work}/toml.o"

cmake_library() {
  local name="$1" source="$2"
  shift 2
  cmake -S "${source}" -B "${work}/build-${name}" -G Ninja -DCMAKE_BUILD_TYPE=Release -DBUILD_SHARED_LIBS=OFF \
    -DCMAKE_POSITION_INDEPENDENT_CODE=ON -DCMAKE_C_FLAGS="-w" -DCMAKE_CXX_FLAGS="-w" -DCMAKE_INSTALL_LIBDIR=lib \
    -DCMAKE_INSTALL_PREFIX="${work}/installed" "$@"
  ninja -C "${work}/build-${name}" install
  cp "${work}/installed/lib/lib${name}.a" "${out}/lib/"
}
cmake_library fmt "${work}"/fmtlib-* -DFMT_TEST=OFF -DFMT_DOC=OFF
cmake_library tinyxml2 "${work}"/tinyxml2-* -Dtinyxml2_BUILD_TESTING=OFF
cmake_library meshoptimizer "${work}"/meshoptimizer-*
cmake_library zip "${work}"/libzip-* -DENABLE_BZIP2=OFF -DENABLE_LZMA=OFF -DENABLE_GNUTLS=OFF -DENABLE_OPENSSL=OFF \
  -DENABLE_MBEDTLS=OFF -DBUILD_TOOLS=OFF -DBUILD_REGRESS=OFF -DBUILD_EXAMPLES=OFF -DBUILD_DOC=OFF
# assimp with the readers that are used (src/load/mesh_file.cc), and Debian's patches for what its archive leaves out
for patch in use-system-utf8cpp use-system-stb_image; do
  patch -d "${work}"/assimp-* -p1 <"${work}/debian/patches/${patch}.patch"
done
cmake_library assimp "${work}"/assimp-* -DASSIMP_BUILD_ALL_IMPORTERS_BY_DEFAULT=OFF -DASSIMP_NO_EXPORT=ON \
  -DASSIMP_BUILD_STL_IMPORTER=ON -DASSIMP_BUILD_OBJ_IMPORTER=ON -DASSIMP_BUILD_COLLADA_IMPORTER=ON \
  -DASSIMP_BUILD_GLTF_IMPORTER=ON -DASSIMP_BUILD_TESTS=OFF -DASSIMP_BUILD_ASSIMP_TOOLS=OFF -DASSIMP_BUILD_ZLIB=OFF \
  -DASSIMP_WARNINGS_AS_ERRORS=OFF -DASSIMP_INSTALL_PDB=OFF \
  -DCMAKE_CXX_FLAGS="-w -DASSIMP_ENABLE_DRACO=1 -isystem ${out}/sysroot/usr/include/utf8cpp"
