# Bullet: built from source, once a precision.
set(version 3.2.7)
foreach(precision f32 f64)
  set(recipe bullet)
  if(precision STREQUAL f32)
    set(recipe bullet-f32)
  endif()
  assay_engine_folder(made ${recipe})
  set(folder "${made}/bullet-${version}-${precision}")
  assay_built_engine(bullet-${precision} RECIPE ${recipe} VERSION ${version} FOLDER "${folder}" LIBRARY libbullet.a
    INCLUDE "${folder}/include/bullet" DEFINITIONS "$<$<STREQUAL:${precision},f64>:BT_USE_DOUBLE_PRECISION>")
endforeach()
