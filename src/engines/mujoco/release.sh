# The shared library and the headers of a release, as recipe/build.sh takes them out of the newest one's package.
mkdir -p "${out}/lib" "${out}/licenses"
cp -r "${work}/package/mujoco/include" "${out}/"
cp "${work}/package/mujoco/libmujoco.so.${version}" "${out}/lib/"
find "${work}/package" -path '*.dist-info/*' -name 'LICENSE*' -exec cp {} "${out}/licenses/" \;
write_facts "${out}" "PyPI $(sed 's/==/ /; s/ --hash.*//' "${work}/pins.txt"), prebuilt" "unknown (prebuilt)" "as its makers built it"
