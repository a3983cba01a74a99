# Bullet: built from source, once a precision.
set(version 3.2.7)
assay_engine_folder(made bullet)
foreach(precision f32 f64)
  set(folder "${made}/bullet-${version}-${precision}")
  assay_built_engine(bullet-${precision} VERSION ${version} FOLDER "${folder}" LIBRARY libbullet.a
    INCLUDE "${folder}/include/bullet" DEFINITIONS "$<$<STREQUAL:${precision},f64>:BT_USE_DOUBLE_PRECISION>")
endforeach()
