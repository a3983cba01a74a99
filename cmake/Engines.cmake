# Physics engines from outside as imported targets engine::<name>. Each is optional: one that is not there has no target,
# its adapter is not built, and a line says how to get it. ENGINE_<name>_{VERSION,SOURCE,COMPILER,FLAGS} say where it came
# from and how it was compiled, for the build facts of its adapter.

function(assay_engine_absent name how)
  message(STATUS "assay: engine ${name}: not found, its adapter is left out. ${how}")
endfunction()

# Sets ENGINE_<name>_* from the file that the engine's set-up left in its folder.
function(assay_engine_facts name version folder)
  set(ENGINE_${name}_VERSION "${version}" PARENT_SCOPE)
  file(STRINGS "${folder}/build.txt" lines)
  foreach(line IN LISTS lines)
    string(REGEX MATCH "^([a-z]+)=(.*)$" matched "${line}")
    string(TOUPPER "${CMAKE_MATCH_1}" key)
    set(ENGINE_${name}_${key} "${CMAKE_MATCH_2}" PARENT_SCOPE)
  endforeach()
  set_property(DIRECTORY "${PROJECT_SOURCE_DIR}" APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS "${folder}/build.txt")
endfunction()

set(run_setup "Run setup/setup.sh (or ./assay), which puts it under ${ASSAY_CACHE}/engines.")

# ---- MuJoCo: the shared library of the Python package, linked by its full path (it has no lib*.so name) -------------
set(version 4.0.1)
set(folder "${ASSAY_CACHE}/engines/mujoco-${version}")
if(EXISTS "${folder}/lib/libmujoco.so.${version}")
  add_library(engine::mujoco SHARED IMPORTED GLOBAL)
  set_target_properties(engine::mujoco PROPERTIES
    IMPORTED_LOCATION "${folder}/lib/libmujoco.so.${version}"
    IMPORTED_SONAME "libmujoco.so.${version}"
    INTERFACE_INCLUDE_DIRECTORIES "${folder}/include")
  assay_engine_facts(mujoco ${version} "${folder}")
  message(STATUS "assay: engine mujoco: ${folder}")
else()
  assay_engine_absent(mujoco "${run_setup}")
endif()

# ---- Bullet: built from source, once a precision --------------------------------------------------------------------
set(version 3.2.7)
foreach(precision f32 f64)
  set(folder "${ASSAY_CACHE}/engines/bullet-${version}-${precision}")
  if(EXISTS "${folder}/lib/libbullet.a")
    add_library(engine::bullet-${precision} STATIC IMPORTED GLOBAL)
    set_target_properties(engine::bullet-${precision} PROPERTIES
      IMPORTED_LOCATION "${folder}/lib/libbullet.a"
      INTERFACE_INCLUDE_DIRECTORIES "${folder}/include/bullet"
      INTERFACE_COMPILE_DEFINITIONS "$<$<STREQUAL:${precision},f64>:BT_USE_DOUBLE_PRECISION>")
    assay_engine_facts(bullet-${precision} ${version} "${folder}")
    message(STATUS "assay: engine bullet-${precision}: ${folder}")
  else()
    assay_engine_absent(bullet-${precision} "${run_setup}")
  endif()
endforeach()

# ---- ODE: the distribution's library, double precision --------------------------------------------------------------
pkg_check_modules(ode QUIET IMPORTED_TARGET ode)
if(TARGET PkgConfig::ode)
  add_library(engine::ode INTERFACE IMPORTED GLOBAL)
  set_target_properties(engine::ode PROPERTIES INTERFACE_LINK_LIBRARIES PkgConfig::ode)
  set(ENGINE_ode_VERSION "${ode_VERSION}")
  set(ENGINE_ode_SOURCE "the distribution's libode-dev ${ode_VERSION}, prebuilt")
  set(ENGINE_ode_COMPILER "unknown (prebuilt)")
  set(ENGINE_ode_FLAGS "as the distribution built it")
  message(STATUS "assay: engine ode: ${ode_VERSION} of the distribution")
else()
  assay_engine_absent(ode "Install libode-dev.")
endif()

# ---- Simbody: the distribution's library; the independent solution of smooth systems --------------------------------
find_package(Simbody 3.7 QUIET)
if(Simbody_FOUND)
  add_library(engine::simbody INTERFACE IMPORTED GLOBAL)
  set_target_properties(engine::simbody PROPERTIES
    INTERFACE_LINK_LIBRARIES "${Simbody_LIBRARIES}"
    INTERFACE_INCLUDE_DIRECTORIES "${Simbody_INCLUDE_DIR}")
  set(ENGINE_simbody_VERSION "${Simbody_VERSION}")
  set(ENGINE_simbody_SOURCE "the distribution's libsimbody-dev ${Simbody_VERSION}, prebuilt")
  set(ENGINE_simbody_COMPILER "unknown (prebuilt)")
  set(ENGINE_simbody_FLAGS "as the distribution built it")
  message(STATUS "assay: engine simbody: ${Simbody_VERSION} of the distribution")
else()
  assay_engine_absent(simbody "Install libsimbody-dev.")
endif()
