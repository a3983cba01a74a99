# The Python package runs on systems older than the one that makes it. It is compiled as a clone is, from the same headers and
# with the same flags, and linked with what setup/portable made: Debian 11's C library, and static libraries instead of this
# system's shared ones.
execute_process(
  COMMAND ${CMAKE_COMMAND} -E env "ASSAY_CACHE=${ASSAY_CACHE}" "CXX=${CMAKE_CXX_COMPILER}"
    bash -c "root=$1; source \"$1/setup/common.sh\" && engine_folder portable" - "${PROJECT_SOURCE_DIR}"
  OUTPUT_VARIABLE portable OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
if(NOT EXISTS "${portable}/lib")
  message(FATAL_ERROR "What the Python package is linked with is missing: run setup/setup.sh --wheel")
endif()
set(portable_system "${portable}/sysroot/usr/lib/x86_64-linux-gnu")
# libstdc++ comes first, too: what it defines is not to be looked for in static libraries.
add_link_options("--sysroot=${portable}/sysroot" "-B${portable_system}"
  "-L${portable}/lib" "-L${portable_system}" "-L${portable}/sysroot/lib/x86_64-linux-gnu" "${portable}/lib/newer_glibc.o"
  "-Wl,--push-state,--no-as-needed,${portable_system}/libstdc++.so.6,--pop-state")

# What find_library() finds.
set(CMAKE_FIND_LIBRARY_SUFFIXES .a)
list(PREPEND CMAKE_LIBRARY_PATH "${portable}/lib")
set(CMAKE_DISABLE_FIND_PACKAGE_LAPACK ON)  # in Fortran, whose library is shared

foreach(language IN ITEMS C CXX)
  set(CMAKE_${language}_STANDARD_LIBRARIES "-lpthread -ldl -lm")  # apart from libc until glibc 2.34
endforeach()

# Targets that name shared libraries, or too few static ones. What finds them again leaves them as they are.
function(assay_link_statically target)
  set(files "")
  foreach(name IN LISTS ARGN)
    find_library(assay_static_${name} ${name} REQUIRED)
    list(APPEND files "${assay_static_${name}}")
  endforeach()
  get_target_property(type ${target} TYPE)
  if(NOT type STREQUAL INTERFACE_LIBRARY)
    list(POP_FRONT files file)
    set_target_properties(${target} PROPERTIES IMPORTED_LOCATION "${file}" IMPORTED_LOCATION_NONE "${file}")
  endif()
  set_property(TARGET ${target} APPEND PROPERTY INTERFACE_LINK_LIBRARIES "${files}")
endfunction()
find_package(fmt REQUIRED)
find_package(tomlplusplus REQUIRED)
find_package(meshoptimizer REQUIRED GLOBAL)
find_package(PkgConfig REQUIRED)
pkg_check_modules(cairo REQUIRED IMPORTED_TARGET cairo cairo-pdf cairo-svg fontconfig)
pkg_check_modules(assimp REQUIRED IMPORTED_TARGET GLOBAL assimp)
assay_link_statically(fmt::fmt fmt)
assay_link_statically(tomlplusplus::tomlplusplus tomlplusplus)
assay_link_statically(meshoptimizer::meshoptimizer meshoptimizer)
assay_link_statically(PkgConfig::cairo pixman-1 freetype png16 expat brotlidec brotlicommon z)
assay_link_statically(PkgConfig::assimp draco minizip z)
