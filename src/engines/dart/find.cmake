# DART: built from source, with the collision detector that uses ODE; both are linked statically. Assimp, whose meshes DART
# takes, is the distribution's.
set(version 6.13.2)
assay_engine_folder(made dart)
assay_engine_folder(ode_made ode)
set(folder "${made}/dart-${version}")
file(GLOB ode_library "${ode_made}/ode-*/lib/libode.a")
pkg_check_modules(assimp QUIET IMPORTED_TARGET GLOBAL assimp)
if(NOT TARGET PkgConfig::assimp)
  assay_engine_absent(dart "Install libassimp-dev.")
elseif(EXISTS "${folder}/lib/libdart.a" AND ode_library)
  add_library(engine::dart${suffix} STATIC IMPORTED GLOBAL)
  # Some of DART's classes have one virtual function less with NDEBUG: whoever includes them has to say it too. The target of
  # ODE may be defined later.
  set_target_properties(engine::dart${suffix} PROPERTIES
    IMPORTED_LOCATION "${folder}/lib/libdart.a"
    INTERFACE_INCLUDE_DIRECTORIES "${folder}/include"
    INTERFACE_COMPILE_DEFINITIONS "NDEBUG;DART_HAVE_spdlog=0;DART_ACTIVE_LOG_LEVEL=2"
    INTERFACE_LINK_LIBRARIES "engine::ode${suffix};PkgConfig::assimp;Eigen3::Eigen;fmt::fmt")
  assay_engine_facts(dart${suffix} ${version} "${folder}")
  message(STATUS "assay: engine dart${suffix}: ${folder}")
else()
  assay_engine_absent(dart "${run_setup}")
endif()
