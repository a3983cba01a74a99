# Builds CPython 3.13 as a shared library, with the program that makes environments. It can be moved: the library is told its
# home, and the program finds both from where it lies.
fetch_debian "${recipe}/pins.txt"
mkdir "${work}/source" "${work}/build"
tar -xJf "${fetched}"/python3.13_3.13.5.orig.tar.xz -C "${work}/source" --strip-components 1

# Modules that no adapter needs are left out by name, so that what the machine has installed makes no difference.
options=()
for module in _bz2 _curses _curses_panel _dbm _gdbm _lzma _sqlite3 _tkinter _uuid readline; do
  options+=("py_cv_module_${module}=n/a")
done
# shellcheck disable=SC2016  # make and the linker fill these in
options+=(LINKFORSHARED='-Xlinker -export-dynamic -Wl,-rpath,'\''$$ORIGIN/../lib'\')
(
  cd "${work}/build" || exit
  OPT="${flags} -w" ../source/configure --prefix="${out}" --enable-shared --without-static-libpython --disable-test-modules \
    --with-ensurepip=no "${options[@]}"
)
make -C "${work}/build" -j "$(nproc)"
make -C "${work}/build" install

library="${out}/lib/python3.13"
# without these there is no pip
for module in zlib _ctypes _ssl; do "${out}/bin/python3.13" -I -c "import ${module}"; done
rm -rf "${out}/share" "${library}"/{idlelib,tkinter,turtledemo,pydoc_data,test} "${library}"/config-3.13-*
find "${library}" -name '*.opt-[12].pyc' -delete
find "${out}/bin" "${out}/lib" -type f \( -name python3.13 -o -name '*.so' -o -name '*.so.*' \) -exec strip --strip-unneeded {} +
cp "${work}/source/LICENSE" "${out}"
write_facts "${out}" "CPython 3.13.5, the authors' sources" "${compiler}" "${flags}"
