# Havok: its WebAssembly, turned into C and built from that. ENGINE_havok_WASM is the WebAssembly itself, for Node, and
# ENGINE_havok_LICENSE what goes with its copies.
set(version 1.3.14)
assay_engine_folder(made havok)
set(folder "${made}/havok-${version}")
if(EXISTS "${folder}/lib/libhavok.a")
  add_library(engine::havok STATIC IMPORTED GLOBAL)
  set_target_properties(engine::havok PROPERTIES
    IMPORTED_LOCATION "${folder}/lib/libhavok.a"
    INTERFACE_INCLUDE_DIRECTORIES "${folder}/include/havok")
  assay_engine_facts(havok ${version} "${folder}")
  set(ENGINE_havok_WASM "${folder}/wasm/HavokPhysics.wasm")
  set(ENGINE_havok_LICENSE "${folder}/licenses/havok.txt")
  message(STATUS "assay: engine havok: ${folder}")
else()
  assay_engine_absent(havok "${run_setup}")
  assay_engine_absent(havok-node "${run_setup}")
endif()
