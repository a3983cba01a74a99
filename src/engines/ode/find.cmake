# ODE: built from source, double precision.
set(version 0.16.6)
assay_engine_folder(made ode)
set(folder "${made}/ode-${version}")
if(EXISTS "${folder}/lib/libode.a")
  find_package(Threads REQUIRED)
  add_library(engine::ode${suffix} STATIC IMPORTED GLOBAL)
  set_target_properties(engine::ode${suffix} PROPERTIES
    IMPORTED_LOCATION "${folder}/lib/libode.a"
    INTERFACE_INCLUDE_DIRECTORIES "${folder}/include"
    INTERFACE_COMPILE_DEFINITIONS dIDEDOUBLE
    INTERFACE_LINK_LIBRARIES Threads::Threads)
  assay_engine_facts(ode${suffix} ${version} "${folder}")
  message(STATUS "assay: engine ode${suffix}: ${folder}")
else()
  assay_engine_absent(ode "${run_setup}")
endif()
