# MuJoCo: the shared library of the Python package, linked by its full path (it has no lib*.so name).
set(version 4.0.1)
assay_engine_folder(made mujoco)
set(folder "${made}/mujoco-${version}")
if(EXISTS "${folder}/lib/libmujoco.so.${version}")
  add_library(engine::mujoco SHARED IMPORTED GLOBAL)
  set_target_properties(engine::mujoco PROPERTIES
    IMPORTED_LOCATION "${folder}/lib/libmujoco.so.${version}"
    IMPORTED_SONAME "libmujoco.so.${version}"
    INTERFACE_INCLUDE_DIRECTORIES "${folder}/include")
  assay_engine_facts(mujoco ${version} "${folder}")
  message(STATUS "assay: engine mujoco: ${folder}")
else()
  assay_engine_not_set_up(mujoco mujoco)
endif()
