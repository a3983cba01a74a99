# assay_add_engine(NAME name SOURCES file... LIBRARIES target... [DEFINITIONS name=value...]
#                  [VERSION version] [ORIGIN text] [COMPILER text] [FLAGS text])
#
# Builds the plugin <build>/engines/assay-engine-<name>.so. Nothing but its entry point is visible and every symbol is
# bound inside, so that two builds of one engine can live in one process (each is loaded with RTLD_LOCAL). The facts of
# the build are given to the source as ASSAY_ENGINE_NAME and ASSAY_BUILD_{VERSION,SOURCE,COMPILER,FLAGS}: the arguments of
# that name (ORIGIN is the source), else ENGINE_<x>_* of the first library engine::<x>, else this project's own.
#
# Part of the installed package, too: an adapter outside the tree is built by the same function.
function(assay_add_engine)
  cmake_parse_arguments(arg "" "NAME;VERSION;ORIGIN;COMPILER;FLAGS" "SOURCES;LIBRARIES;DEFINITIONS" ${ARGN})
  if(arg_UNPARSED_ARGUMENTS OR NOT arg_NAME OR NOT arg_SOURCES)
    message(FATAL_ERROR "assay_add_engine(NAME name SOURCES file... [LIBRARIES ...] [DEFINITIONS ...] [VERSION ...])")
  endif()
  set(target assay-engine-${arg_NAME})

  # The first engine::<x> among the libraries is the engine whose facts count.
  set(version "${PROJECT_VERSION}")
  set(source "part of ${PROJECT_NAME}")
  set(compiler "${CMAKE_CXX_COMPILER_ID} ${CMAKE_CXX_COMPILER_VERSION}")
  set(flags "${ASSAY_ENGINE_CXX_FLAGS}")
  foreach(library IN LISTS arg_LIBRARIES)
    if(library MATCHES "^engine::(.+)$")
      set(version "${ENGINE_${CMAKE_MATCH_1}_VERSION}")
      set(source "${ENGINE_${CMAKE_MATCH_1}_SOURCE}")
      set(compiler "${ENGINE_${CMAKE_MATCH_1}_COMPILER}")
      set(flags "${ENGINE_${CMAKE_MATCH_1}_FLAGS}")
      break()
    endif()
  endforeach()
  foreach(fact version compiler flags)
    string(TOUPPER ${fact} argument)
    if(arg_${argument})
      set(${fact} "${arg_${argument}}")
    endif()
  endforeach()
  if(arg_ORIGIN)
    set(source "${arg_ORIGIN}")
  endif()

  add_library(${target} MODULE ${arg_SOURCES})
  set_target_properties(${target} PROPERTIES
    PREFIX "" LIBRARY_OUTPUT_DIRECTORY "${PROJECT_BINARY_DIR}/engines"
    CXX_VISIBILITY_PRESET hidden VISIBILITY_INLINES_HIDDEN ON)
  target_link_libraries(${target} PRIVATE assay::model assay::base ${arg_LIBRARIES})
  # An unknown symbol must fail here and not at the user's; the sanitizers' own come from the program.
  target_link_options(${target} PRIVATE -Wl,-Bsymbolic -Wl,--exclude-libs,ALL
    $<$<NOT:$<BOOL:${ASSAY_SANITIZE}>>:-Wl,-z,defs>)
  target_compile_definitions(${target} PRIVATE
    "ASSAY_ENGINE_NAME=\"${arg_NAME}\""
    "ASSAY_BUILD_VERSION=\"${version}\""
    "ASSAY_BUILD_SOURCE=\"${source}\""
    "ASSAY_BUILD_COMPILER=\"${compiler}\""
    "ASSAY_BUILD_FLAGS=\"${flags}\""
    ${arg_DEFINITIONS})
  if(TARGET product)
    add_dependencies(product ${target})
    assay_optimise_at_link(${target})
  else()
    # Outside the tree, whose own flags these are.
    separate_arguments(options UNIX_COMMAND "${ASSAY_ENGINE_CXX_FLAGS}")
    target_compile_options(${target} PRIVATE ${options})
  endif()
  include(GNUInstallDirs)
  install(TARGETS ${target} LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}/assay/engines)
endfunction()
