# Engines whose adapters are written in Python (src/engines/python-host), and the interpreters that they run in. The usual one is
# the distribution's CPython as a library, of version 3.11: for it there are binaries of every engine's packages, but not of the newest releases. An
# engine that needs another one names it as `python` in its about.toml, and set-up builds that: python = "3.13" is the recipe of
# src/engines/cpython313.
pkg_check_modules(python QUIET IMPORTED_TARGET python-3.11-embed)
if(TARGET PkgConfig::python)
  pkg_get_variable(python_home python-3.11-embed prefix)
endif()

# ASSAY_BUILT_PYTHONS: the versions that there are recipes of. Those that are set up have targets assay::python-<version>,
# below ASSAY_PYTHON_<version>.
set(ASSAY_BUILT_PYTHONS "")
set(build baseline)
file(GLOB recipes CONFIGURE_DEPENDS "${PROJECT_SOURCE_DIR}/src/engines/cpython3*/recipe")
foreach(recipe IN LISTS recipes)
  string(REGEX REPLACE ".*/(cpython3([0-9]+))/recipe" "\\1" name "${recipe}")
  set(version "3.${CMAKE_MATCH_2}")
  list(APPEND ASSAY_BUILT_PYTHONS ${version})
  assay_engine_folder(folder ${name})
  if(EXISTS "${folder}/lib/libpython${version}.so.1.0")
    add_library(assay::python-${version} SHARED IMPORTED GLOBAL)
    set_target_properties(assay::python-${version} PROPERTIES
      IMPORTED_LOCATION "${folder}/lib/libpython${version}.so.1.0"
      INTERFACE_INCLUDE_DIRECTORIES "${folder}/include/python${version}")
    set(ASSAY_PYTHON_${version} "${folder}")
    message(STATUS "assay: Python ${version}: ${folder}")
  endif()
endforeach()

# Finds an engine whose adapter is in Python: its virtual environment, which `./assay setup NAME` makes of
# src/engines/NAME/requirements.txt. Sets `variable` to the environment's folder, or to "" and registers the engine as
# absent. SIZE is what it takes on the disk.
function(assay_find_python_engine variable name size)
  set_property(DIRECTORY "${PROJECT_SOURCE_DIR}" APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS
    "${PROJECT_SOURCE_DIR}/src/engines/${name}/requirements.txt")
  assay_about(version ${name} python)
  set(interpreter PkgConfig::python)
  set(host assay-python-host)
  set(needs "")
  if(version)
    set(interpreter assay::python-${version})
    set(host assay-python-host-${version})
    string(REPLACE "." "" recipe cpython${version})
    assay_about(minutes ${recipe} minutes)
    set(needs ", and ${minutes} minutes of compiling for Python ${version}")
  endif()
  assay_run_common(folder environment_folder ${name})
  if(TARGET ${interpreter} AND EXISTS "${folder}/bin/python")
    set(${variable} "${folder}" PARENT_SCOPE)
    set(ASSAY_ENVIRONMENT_${name} "${folder}" PARENT_SCOPE)
    set(ASSAY_HOST_${name} ${host} PARENT_SCOPE)
    message(STATUS "assay: engine ${name}: ${folder}")
  else()
    set(${variable} "" PARENT_SCOPE)
    if(TARGET ${interpreter})
      set(needs "")
    endif()
    assay_engine_absent(${name} "Run ./assay setup ${name} (${size}${needs})." ${name} "${size}${needs}")
  endif()
endfunction()
