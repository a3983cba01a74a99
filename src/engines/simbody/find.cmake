# Simbody: the distribution's library; an engine, and the independent solution of smooth systems.
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
