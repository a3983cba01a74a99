# DART: built from source, with the collision detector that uses ODE; both are linked statically. Assimp, whose meshes DART
# takes, is the distribution's.
set(version 6.13.2)
assay_engine_folder(made dart)
assay_engine_folder(ode_made ode)
file(GLOB ode_library "${ode_made}/ode-*/lib/libode.a")
pkg_check_modules(assimp QUIET IMPORTED_TARGET GLOBAL assimp)
if(NOT TARGET PkgConfig::assimp)
  assay_engine_absent(dart "Install libassimp-dev.")
elseif(NOT ode_library)
  assay_engine_not_set_up(dart dart)
else()
  # Some of DART's classes have one virtual function less with NDEBUG: whoever includes them has to say it too. The target of
  # ODE may be defined later.
  assay_built_engine(dart VERSION ${version} FOLDER "${made}/dart-${version}" LIBRARY libdart.a
    DEFINITIONS NDEBUG DART_HAVE_spdlog=0 DART_ACTIVE_LOG_LEVEL=2
    LINK engine::ode${suffix} PkgConfig::assimp Eigen3::Eigen fmt::fmt)
endif()
