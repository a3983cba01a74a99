# Box3D: built from source, with world positions in single and in double precision.
set(version 0.1.0)
assay_engine_folder(made box3d)
foreach(variant f32 f64)
  set(name box3d-f32)
  if(variant STREQUAL f64)
    set(name box3d)
  endif()
  assay_built_engine(${name} RECIPE box3d VERSION ${version} FOLDER "${made}/box3d-${version}-${variant}" LIBRARY libbox3d.a
    DEFINITIONS "$<$<STREQUAL:${variant},f64>:BOX3D_DOUBLE_PRECISION>")
endforeach()
