# Takes the shared library and the headers out of the Python package.
fetch_wheel "${recipe}/pins.txt" 3.11 manylinux_2_28_x86_64
folder="${out}/mujoco-4.0.1"
mkdir -p "${folder}/lib" "${folder}/licenses"
unzip_python "${fetched}"/mujoco_core-*.whl "${work}/wheel"
cp -r "${work}/wheel/mujoco/include" "${folder}/"
cp "${work}/wheel/mujoco/libmujoco.so.4.0.1" "${folder}/lib/"
cp "${work}"/wheel/mujoco_core-*.dist-info/licenses/* "${folder}/licenses/"
write_facts "${folder}" "PyPI mujoco-core 4.0.1, prebuilt" "unknown (prebuilt)" "as its makers built it"
