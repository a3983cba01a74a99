# Simbody: built from source; an engine, and the independent solution of smooth systems. LAPACK is the distribution's.
set(version 3.7)
assay_engine_folder(made simbody)
set(folder "${made}/simbody-${version}")
find_package(LAPACK QUIET)
if(NOT LAPACK_FOUND)
  assay_engine_absent(simbody "Install liblapack-dev.")
elseif(EXISTS "${folder}/lib/libSimTKsimbody_static.a")
  find_package(Threads REQUIRED)
  add_library(engine::simbody${suffix} STATIC IMPORTED GLOBAL)
  # NDEBUG: its headers check more without.
  set_target_properties(engine::simbody${suffix} PROPERTIES
    IMPORTED_LOCATION "${folder}/lib/libSimTKsimbody_static.a"
    INTERFACE_INCLUDE_DIRECTORIES "${folder}/include/simbody"
    INTERFACE_COMPILE_DEFINITIONS "SimTK_USE_STATIC_LIBRARIES;NDEBUG"
    INTERFACE_LINK_LIBRARIES "${folder}/lib/libSimTKmath_static.a;${folder}/lib/libSimTKcommon_static.a;${LAPACK_LIBRARIES};Threads::Threads;${CMAKE_DL_LIBS};rt;m")
  assay_engine_facts(simbody${suffix} ${version} "${folder}")
  message(STATUS "assay: engine simbody${suffix}: ${folder}")
else()
  assay_engine_absent(simbody "${run_setup}")
endif()
