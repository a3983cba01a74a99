# Jolt in single precision as WebAssembly turned into C, behind the same interface as ../jolt.
set(version 5.6.0)
assay_engine_folder(made jolt-wasm)
assay_built_engine(jolt-wasm VERSION ${version} FOLDER "${made}/jolt-${version}-wasm" LIBRARY libjolt_world.a)
