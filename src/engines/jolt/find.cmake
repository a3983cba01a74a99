# Jolt behind the C interface jolt_world.h: built from source with positions in single and double precision. Jolt's own
# headers come along for programs that use its API; without NDEBUG they want a library with assertions.
set(version 5.6.0)
assay_engine_folder(made jolt)
foreach(variant f32 f64)
  set(folder "${made}/jolt-${version}-${variant}")
  assay_built_engine(jolt-${variant} RECIPE jolt VERSION ${version} FOLDER "${folder}" LIBRARY libjolt_world.a
    LINK "${folder}/lib/libJolt.a"
    DEFINITIONS JPH_OBJECT_LAYER_BITS=16 JPH_NO_DEBUG "$<$<STREQUAL:${variant},f64>:JPH_DOUBLE_PRECISION>")
endforeach()
