# How assay's own code is compiled, and the libraries it uses.

# Our own code only: third-party headers are system includes, engines are compiled elsewhere.
add_compile_options(
  $<$<COMPILE_LANGUAGE:CXX>:-Wall> $<$<COMPILE_LANGUAGE:CXX>:-Wextra> $<$<COMPILE_LANGUAGE:CXX>:-Wpedantic>
  $<$<COMPILE_LANGUAGE:CXX>:-Wshadow> $<$<COMPILE_LANGUAGE:CXX>:-Werror>)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 14)
  # All fire on correct uses of std::string, std::variant and std::map at -O2 and above, the last one when plugins are linked.
  add_compile_options($<$<COMPILE_LANGUAGE:CXX>:-Wno-restrict> $<$<COMPILE_LANGUAGE:CXX>:-Wno-maybe-uninitialized>)
  add_link_options(-Wno-stringop-overread)
endif()

# assay's release code has the engines' flags, so that an adapter is compiled as its engine is, wherever its code lives
# (assay::model is part of every plugin). The asserts of our own code stay out of release builds with NDEBUG.
string(REGEX REPLACE " +" ";" engine_flag_list "${ASSAY_ENGINE_CXX_FLAGS}")
set(CMAKE_CXX_FLAGS_RELEASE "${ASSAY_ENGINE_CXX_FLAGS}")

if(ASSAY_SANITIZE)
  # Engines stay as they are. Plugins are loaded RTLD_LOCAL and never unloaded, so leaks keep their stacks.
  add_compile_options(-fsanitize=address,undefined -fno-sanitize-recover=undefined -fno-omit-frame-pointer)
  # What the address sanitizer ends on anyway, and what would be checked at every access: a third of the compile time.
  add_compile_options(-fno-sanitize=null,object-size,alignment,vptr)
  add_link_options(-fsanitize=address,undefined)
  if(ASSAY_FUZZ)
    # clang finds other faults than the pinned compiler, whose findings are errors in every other build
    add_compile_options(-fsanitize=fuzzer-no-link -Wno-error)
  endif()
  add_library(assay_leaks OBJECT "${CMAKE_CURRENT_LIST_DIR}/leaks.cc")
  link_libraries("$<$<STREQUAL:$<TARGET_PROPERTY:TYPE>,EXECUTABLE>:$<TARGET_OBJECTS:assay_leaks>>")
  # Eigen allocates in another way under a sanitizer; vectors are passed to and from engines that were built without.
  add_compile_definitions(EIGEN_MALLOC_ALREADY_ALIGNED=1)
endif()

set(assay_lto_works OFF)
if(ASSAY_LTO AND NOT ASSAY_SANITIZE)
  include(CheckIPOSupported)
  check_ipo_supported(RESULT assay_lto_works OUTPUT lto_output LANGUAGES CXX)
  if(NOT assay_lto_works)
    message(STATUS "assay: no link-time optimisation: ${lto_output}")
  endif()
endif()

# For what no clock runs through and no long sum is taken in: in the release build -O3 takes half as long again as -O1, and
# under sanitizers and while developing -O1 half as long again as -O0.
function(assay_compile_quickly target)
  if(ASSAY_FUZZ)
    return()
  endif()
  target_compile_options(${target} PRIVATE $<IF:$<OR:$<BOOL:${ASSAY_SANITIZE}>,$<CONFIG:Debug>>,-O0,$<$<CONFIG:Release>:-O1>>)
endfunction()

# Link-time optimisation is for what the clock runs through, the plugins; anything else would only link slowly.
function(assay_optimise_at_link target)
  if(assay_lto_works)
    set_target_properties(${target} PROPERTIES INTERPROCEDURAL_OPTIMIZATION ON)
  endif()
endfunction()

# A static library that is a part of plugins, and installed for those of others: its objects have to link without the
# compiler that made them, too.
function(assay_installed_library target)
  assay_optimise_at_link(${target})
  if(assay_lto_works AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    target_compile_options(${target} PRIVATE -ffat-lto-objects)
  endif()
endfunction()

# Whatever has such a library as a part and is no plugin: linked in a fraction of the time from the other half of its objects.
# g++ 12 also fails to optimise the whole program (internal compiler error in add_symbol_to_partition_1).
function(assay_link_plainly target)
  if(assay_lto_works AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    target_link_options(${target} PRIVATE -fno-lto)
  endif()
endfunction()

# Same objects again (another preset, another commit) are not compiled again where ccache is installed.
find_program(CCACHE ccache)
if(CCACHE AND NOT DEFINED CMAKE_CXX_COMPILER_LAUNCHER)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CCACHE})
endif()

find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(nlohmann_json 3.11 REQUIRED)
find_package(tomlplusplus 3.3 REQUIRED)
find_package(CLI11 2.1 REQUIRED)
find_package(SQLite3 3.37 REQUIRED)
find_package(fmt 9 REQUIRED)
find_package(Boost 1.74 REQUIRED)
find_package(Threads REQUIRED)
find_package(PkgConfig REQUIRED)
pkg_check_modules(xxhash REQUIRED IMPORTED_TARGET libxxhash)
pkg_check_modules(libzip REQUIRED IMPORTED_TARGET libzip)
# The Python package does without: it is linked with the libraries of setup/portable.
if(NOT ASSAY_PACKAGE)
  pkg_check_modules(lzma REQUIRED IMPORTED_TARGET liblzma)
endif()
pkg_check_modules(pcre2 REQUIRED IMPORTED_TARGET libpcre2-8)
pkg_check_modules(yaml REQUIRED IMPORTED_TARGET yaml-0.1)
pkg_check_modules(cairo REQUIRED IMPORTED_TARGET cairo cairo-pdf cairo-svg fontconfig)
find_package(ZLIB REQUIRED)
find_package(PNG REQUIRED)

# What the build knows of itself: version and commit, as "base/build_info.h" for whoever links assay::build_info (few files:
# each of them is compiled again after a commit). Looked up at every build, rewritten only when it changed.
set(build_info "${PROJECT_BINARY_DIR}/generated/base/build_info.h")
add_custom_target(assay_build_info_header
  COMMAND ${CMAKE_COMMAND} -DSOURCE=${PROJECT_SOURCE_DIR} -DVERSION=${PROJECT_VERSION}
    -DTEMPLATE=${PROJECT_SOURCE_DIR}/cmake/build_info.h.in -DOUTPUT=${build_info}
    -P ${PROJECT_SOURCE_DIR}/cmake/BuildInfo.cmake
  BYPRODUCTS ${build_info}
  COMMENT "Looking up the commit" VERBATIM)
add_library(assay_build_info INTERFACE)
add_library(assay::build_info ALIAS assay_build_info)
target_include_directories(assay_build_info INTERFACE "${PROJECT_BINARY_DIR}/generated")
target_compile_definitions(assay_build_info INTERFACE
  "ASSAY_BUILD_COMPILER=\"${CMAKE_CXX_COMPILER_ID} ${CMAKE_CXX_COMPILER_VERSION}\""
  "ASSAY_BUILD_FLAGS=\"${ASSAY_ENGINE_CXX_FLAGS}\"" "ASSAY_BUILD_TYPE=\"${CMAKE_BUILD_TYPE}\"")
add_dependencies(assay_build_info assay_build_info_header)
