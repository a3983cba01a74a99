# Engines whose adapters are written in Python (src/engines/python-host). The interpreter that they run in: the distribution's CPython as a library. Of version 3.11, because
# the pinned packages of these engines are binaries for it.
pkg_check_modules(python QUIET IMPORTED_TARGET python-3.11-embed)
if(TARGET PkgConfig::python)
  pkg_get_variable(python_home python-3.11-embed prefix)
endif()

# Finds an engine whose adapter is in Python: its virtual environment, which `./assay setup NAME` makes of
# src/engines/NAME/requirements.txt. Sets `variable` to the environment's folder, or to "" and registers the engine as
# absent. SIZE is what it takes on the disk.
function(assay_find_python_engine variable name size)
  set_property(DIRECTORY "${PROJECT_SOURCE_DIR}" APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS
    "${PROJECT_SOURCE_DIR}/src/engines/${name}/requirements.txt")
  execute_process(
    COMMAND ${CMAKE_COMMAND} -E env "ASSAY_CACHE=${ASSAY_CACHE}"
      bash -c "root=$1; source \"$1/setup/common.sh\" && environment_folder \"$2\"" - "${PROJECT_SOURCE_DIR}" ${name}
    OUTPUT_VARIABLE folder OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
  if(TARGET PkgConfig::python AND EXISTS "${folder}/bin/python")
    set(${variable} "${folder}" PARENT_SCOPE)
    set(ASSAY_ENVIRONMENT_${name} "${folder}" PARENT_SCOPE)
    message(STATUS "assay: engine ${name}: ${folder}")
  else()
    set(${variable} "" PARENT_SCOPE)
    assay_engine_absent(${name} "Run ./assay setup ${name} (${size})." ${name} "${size}")
  endif()
endfunction()
