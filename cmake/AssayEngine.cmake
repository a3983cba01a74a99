# assay_add_engine(NAME name SOURCES file... LIBRARIES target... [DEFINITIONS name=value...])
#
# Builds the plugin <build>/engines/assay-engine-<name>.so. Nothing but its entry point is visible and every symbol is
# bound inside, so that two builds of one engine can live in one process (each is loaded with RTLD_LOCAL). The facts of
# the build are given to the source as ASSAY_ENGINE_NAME and ASSAY_BUILD_{VERSION,SOURCE,COMPILER,FLAGS}.
function(assay_add_engine)
  cmake_parse_arguments(arg "" "NAME" "SOURCES;LIBRARIES;DEFINITIONS" ${ARGN})
  if(arg_UNPARSED_ARGUMENTS OR NOT arg_NAME OR NOT arg_SOURCES)
    message(FATAL_ERROR "assay_add_engine(NAME name SOURCES file... [LIBRARIES ...] [DEFINITIONS ...])")
  endif()
  set(target assay-engine-${arg_NAME})

  # The first engine::<x> among the libraries is the engine whose facts count.
  set(version "${PROJECT_VERSION}")
  set(source "part of assay")
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
  add_dependencies(product ${target})
  install(TARGETS ${target} LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}/assay/engines)
endfunction()
