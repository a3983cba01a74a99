# Simbody: built from source; an engine, and the independent solution of smooth systems. LAPACK is the distribution's.
set(version 3.7)
assay_engine_folder(made simbody)
set(folder "${made}/simbody-${version}")
find_package(LAPACK QUIET)
find_package(Threads REQUIRED)
if(EXISTS "${folder}" AND NOT LAPACK_FOUND)
  assay_engine_absent(simbody "Install liblapack-dev.")
else()
  # NDEBUG: its headers check more without.
  assay_built_engine(simbody VERSION ${version} FOLDER "${folder}" LIBRARY libSimTKsimbody_static.a
    INCLUDE "${folder}/include/simbody" DEFINITIONS SimTK_USE_STATIC_LIBRARIES NDEBUG
    LINK "${folder}/lib/libSimTKmath_static.a" "${folder}/lib/libSimTKcommon_static.a" ${LAPACK_LIBRARIES}
      Threads::Threads ${CMAKE_DL_LIBS} rt m)
endif()
