# Physics engines from outside as imported targets engine::<name>. Each is optional: one that is not there has no target,
# its adapter is not built, and a line says how to get it, which `assay list engines` repeats to its users.
# ENGINE_<name>_{VERSION,SOURCE,COMPILER,FLAGS} say where it came from and how it was compiled, for the build facts of its
# adapter. Those of another build (setup/builds.txt) end in -<build>.

# assay_engine_absent(name how [set-up takes]): `./assay setup <set-up>` gets it and takes so long, or so much room.
function(assay_engine_absent name how)
  if(NOT build STREQUAL baseline)
    return()  # other builds are made on demand
  endif()
  set_property(GLOBAL APPEND PROPERTY ASSAY_ABSENT_ENGINES ${name})
  set_property(GLOBAL PROPERTY ASSAY_HOW_TO_GET_${name} "${how}")
  if(ARGC GREATER 2)  # else ARGV2 is the caller's
    set_property(GLOBAL PROPERTY ASSAY_SET_UP_${name} "${ARGV2}")
    set_property(GLOBAL PROPERTY ASSAY_SET_UP_TAKES_${name} "${ARGV3}")
  endif()
  message(STATUS "assay: engine ${name}: not found, its adapter is left out. ${how}")
endfunction()

# Sets `variable` to what src/engines/<folder>/about.toml says of `key`; empty where it says nothing.
function(assay_about variable folder key)
  set(${variable} "" PARENT_SCOPE)
  set(file "${PROJECT_SOURCE_DIR}/src/engines/${folder}/about.toml")
  if(EXISTS "${file}")
    file(STRINGS "${file}" line REGEX "^${key} = ")
    if(line MATCHES "^${key} = \"?([a-z0-9.]+)")
      set(${variable} "${CMAKE_MATCH_1}" PARENT_SCOPE)
    endif()
  endif()
endfunction()

# As assay_engine_absent() for an engine that the recipe of src/engines/<recipe> builds.
function(assay_engine_not_set_up name recipe)
  assay_about(when ${recipe} set_up)
  if(when MATCHES "^(request|rare)$")
    assay_about(minutes ${recipe} minutes)
    set(takes "${minutes} minutes of compiling")
    assay_engine_absent(${name} "Run ./assay setup ${recipe} (${takes})." ${recipe} "${takes}")
  else()
    assay_engine_absent(${name} "Run setup/setup.sh (or ./assay), which puts it under ${ASSAY_CACHE}/engines.")
  endif()
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

# Sets `variable` to what a function of setup/common.sh says of its arguments.
function(assay_run_common variable)
  set(compiler "${CMAKE_CXX_COMPILER} ${CMAKE_CXX_COMPILER_ARG1}")
  if(ASSAY_FUZZ)
    set(compiler "c++")  # another compiler than set-up's is for assay's own code
  endif()
  execute_process(
    COMMAND ${CMAKE_COMMAND} -E env "ASSAY_CACHE=${ASSAY_CACHE}" "CXX=${compiler}"
      bash -c "root=$1; source \"$1/setup/common.sh\" && \"\${@:2}\"" - "${PROJECT_SOURCE_DIR}" ${ARGN}
    OUTPUT_VARIABLE said OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
  set(${variable} "${said}" PARENT_SCOPE)
endfunction()

# Sets `variable` to the folder of what the recipe of engine `name` makes in the build ${build}; setup/common.sh decides on
# it.
function(assay_engine_folder variable name)
  file(GLOB files CONFIGURE_DEPENDS "${PROJECT_SOURCE_DIR}/src/engines/${name}/recipe/*")
  set_property(DIRECTORY "${PROJECT_SOURCE_DIR}" APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS "${files}")
  assay_run_common(folder engine_folder ${name} ${build})
  set(${variable} "${folder}" PARENT_SCOPE)
endfunction()

# assay_built_engine(name [RECIPE folder] VERSION version FOLDER folder LIBRARY file [INCLUDE folder] [DEFINITIONS name...] [LINK target...])
#
# Makes engine::<name>${suffix} of the static library folder/lib/file that set-up has built; where that is not there, the
# engine is absent. RECIPE is the folder in src/engines that builds it, `name` unless given; its about.toml says when that is done.
# INCLUDE is folder/include unless given.
function(assay_built_engine name)
  cmake_parse_arguments(arg "" "RECIPE;VERSION;FOLDER;LIBRARY;INCLUDE" "DEFINITIONS;LINK" ${ARGN})
  set(library "${arg_FOLDER}/lib/${arg_LIBRARY}")
  if(NOT EXISTS "${library}")
    if(NOT arg_RECIPE)
      set(arg_RECIPE ${name})
    endif()
    assay_engine_not_set_up(${name} ${arg_RECIPE})
    return()
  endif()
  if(NOT arg_INCLUDE)
    set(arg_INCLUDE "${arg_FOLDER}/include")
  endif()
  string(APPEND name "${suffix}")
  add_library(engine::${name} STATIC IMPORTED GLOBAL)
  set_target_properties(engine::${name} PROPERTIES
    IMPORTED_LOCATION "${library}"
    INTERFACE_INCLUDE_DIRECTORIES "${arg_INCLUDE}"
    INTERFACE_COMPILE_DEFINITIONS "${arg_DEFINITIONS}"
    INTERFACE_LINK_LIBRARIES "${arg_LINK}")
  assay_engine_facts(${name} ${arg_VERSION} "${arg_FOLDER}")
  foreach(fact VERSION SOURCE COMPILER FLAGS)
    set(ENGINE_${name}_${fact} "${ENGINE_${name}_${fact}}" PARENT_SCOPE)
  endforeach()
  message(STATUS "assay: engine ${name}: ${arg_FOLDER}")
endfunction()

include(PythonEngines)

# Builds beside the baseline, and their flags.
set(builds_file "${PROJECT_SOURCE_DIR}/setup/builds.txt")
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS "${builds_file}")
file(STRINGS "${builds_file}" lines REGEX "^[^#]")
set(ASSAY_BUILDS "")
if(ASSAY_PACKAGE)
  set(lines "")  # the wheels have the baseline
endif()
foreach(line IN LISTS lines)
  string(REGEX MATCH "^([a-z0-9]+) *[|] *(.*)$" matched "${line}")
  list(APPEND ASSAY_BUILDS ${CMAKE_MATCH_1})
  set(ASSAY_BUILD_FLAGS_${CMAKE_MATCH_1} "${CMAKE_MATCH_2}")
endforeach()

# Sets `variable` to whether the engine of `folder` can have the build.
function(assay_engine_has_build variable folder build)
  set(${variable} OFF PARENT_SCOPE)
  if(EXISTS "${folder}/builds.txt")
    file(STRINGS "${folder}/builds.txt" names)
    list(TRANSFORM names REPLACE " .*" "")
    if(build IN_LIST names)
      set(${variable} ON PARENT_SCOPE)
    endif()
  endif()
endfunction()

# The file find.cmake of each engine's folder, once a build: it makes targets engine::<name>${suffix}.
file(GLOB finders CONFIGURE_DEPENDS "${PROJECT_SOURCE_DIR}/src/engines/*/find.cmake")
foreach(build IN ITEMS baseline LISTS ASSAY_BUILDS)
  set(suffix "")
  if(NOT build STREQUAL baseline)
    set(suffix "-${build}")
  endif()
  foreach(finder IN LISTS finders)
    cmake_path(GET finder PARENT_PATH folder)
    assay_engine_has_build(wanted "${folder}" ${build})
    if(wanted OR build STREQUAL baseline)
      include("${finder}")
    endif()
  endforeach()
endforeach()
