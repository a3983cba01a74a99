# Havok: its WebAssembly, turned into C and built from that. ENGINE_havok_WASM is the WebAssembly itself, for Node, and
# ENGINE_havok_LICENSE what goes with its copies.
set(version 1.3.14)
assay_engine_folder(made havok)
set(folder "${made}/havok-${version}")
assay_built_engine(havok VERSION ${version} FOLDER "${folder}" LIBRARY libhavok.a INCLUDE "${folder}/include/havok")
if(TARGET engine::havok)
  set(ENGINE_havok_WASM "${folder}/wasm/HavokPhysics.wasm")
  set(ENGINE_havok_LICENSE "${folder}/licenses/havok.txt")
else()
  assay_engine_not_set_up(havok-node havok)
endif()
