# DART: the distribution's libraries, with the collision detector that uses ODE. Found without DART's own CMake files,
# which ask for optional parts that nothing here uses.
pkg_check_modules(dart_ode QUIET IMPORTED_TARGET ode)
find_path(dart_include dart/config.hpp NO_CACHE)
find_library(dart_library dart NO_CACHE)
find_library(dart_assimp_library assimp NO_CACHE)  # whose meshes DART takes; libdart-dev depends on it
find_library(dart_collision_ode_library dart-collision-ode NO_CACHE)
if(dart_include AND dart_library AND dart_assimp_library AND dart_collision_ode_library AND TARGET PkgConfig::dart_ode
    AND EXISTS "${dart_include}/dart/collision/ode/OdeCollisionDetector.hpp")
  file(STRINGS "${dart_include}/dart/config.hpp" line REGEX "define DART_VERSION ")
  string(REGEX MATCH "[0-9]+\\.[0-9]+\\.[0-9]+" version "${line}")
  add_library(engine::dart INTERFACE IMPORTED GLOBAL)
  # The distribution compiles without NDEBUG, and some of DART's classes have one virtual function more then: whoever
  # includes them has to do the same.
  set_target_properties(engine::dart PROPERTIES
    INTERFACE_LINK_LIBRARIES "${dart_collision_ode_library};${dart_library};${dart_assimp_library};PkgConfig::dart_ode;Eigen3::Eigen"
    INTERFACE_INCLUDE_DIRECTORIES "${dart_include}"
    INTERFACE_COMPILE_OPTIONS "-UNDEBUG")
  set(ENGINE_dart_VERSION "${version}")
  set(ENGINE_dart_SOURCE "the distribution's libdart-dev ${version}, prebuilt")
  set(ENGINE_dart_COMPILER "unknown (prebuilt)")
  set(ENGINE_dart_FLAGS "as the distribution built it: without NDEBUG, so with DART's own assertions")
  message(STATUS "assay: engine dart: ${version} of the distribution")
else()
  assay_engine_absent(dart "Install libdart-dev and libdart-collision-ode-dev.")
endif()
