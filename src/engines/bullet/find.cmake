# Bullet: built from source, once a precision.
set(version 3.2.7)
assay_engine_folder(made bullet)
foreach(precision f32 f64)
  set(folder "${made}/bullet-${version}-${precision}")
  if(EXISTS "${folder}/lib/libbullet.a")
    add_library(engine::bullet-${precision}${suffix} STATIC IMPORTED GLOBAL)
    set_target_properties(engine::bullet-${precision}${suffix} PROPERTIES
      IMPORTED_LOCATION "${folder}/lib/libbullet.a"
      INTERFACE_INCLUDE_DIRECTORIES "${folder}/include/bullet"
      INTERFACE_COMPILE_DEFINITIONS "$<$<STREQUAL:${precision},f64>:BT_USE_DOUBLE_PRECISION>")
    assay_engine_facts(bullet-${precision}${suffix} ${version} "${folder}")
    message(STATUS "assay: engine bullet-${precision}${suffix}: ${folder}")
  else()
    assay_engine_absent(bullet-${precision}${suffix} "${run_setup}")
  endif()
endforeach()
