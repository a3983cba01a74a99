# Jolt behind the C interface jolt_world.h: built from source with positions in single and double precision, and the first
# also as WebAssembly. Jolt's own headers come along for programs that use its API.
set(version 5.6.0)
assay_engine_folder(made jolt)
foreach(variant f32 f64 wasm)
  set(folder "${made}/jolt-${version}-${variant}")
  if(EXISTS "${folder}/lib/libjolt_world.a")
    add_library(engine::jolt-${variant}${suffix} STATIC IMPORTED GLOBAL)
    set_target_properties(engine::jolt-${variant}${suffix} PROPERTIES
      IMPORTED_LOCATION "${folder}/lib/libjolt_world.a"
      INTERFACE_INCLUDE_DIRECTORIES "${folder}/include")
    if(NOT variant STREQUAL wasm)
      set_target_properties(engine::jolt-${variant}${suffix} PROPERTIES
        INTERFACE_LINK_LIBRARIES "${folder}/lib/libJolt.a"
        INTERFACE_COMPILE_DEFINITIONS
          "JPH_OBJECT_LAYER_BITS=16;$<$<STREQUAL:${variant},f64>:JPH_DOUBLE_PRECISION>")
    endif()
    assay_engine_facts(jolt-${variant}${suffix} ${version} "${folder}")
    message(STATUS "assay: engine jolt-${variant}${suffix}: ${folder}")
  else()
    assay_engine_absent(jolt-${variant}${suffix} "${run_setup}")
  endif()
endforeach()
