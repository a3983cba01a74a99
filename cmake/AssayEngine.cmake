# assay_add_engine(NAME name SOURCES file... LIBRARIES target... [DEFINITIONS name=value...]
#                  [VERSION version] [ORIGIN text] [COMPILER text] [FLAGS text] [RUNS_ELSEWHERE])
#
# Builds the plugin <build>/engines/assay-engine-<name>.so. Nothing but its entry point is visible and every symbol is
# bound inside, so that two builds of one engine can live in one process (each is loaded with RTLD_LOCAL). The facts of
# the build are given to the source as ASSAY_ENGINE_NAME and ASSAY_BUILD_{VERSION,SOURCE,COMPILER,FLAGS}: the arguments of
# that name (ORIGIN is the source), else ENGINE_<x>_* of the first library engine::<x>, else this project's own.
#
# RUNS_ELSEWHERE: the engine's code is not that of the plugin and its libraries, as with Havok in Node; its binary is not read.
#
# Part of the installed package, too: an adapter outside the tree is built by the same function.
function(assay_add_engine)
  cmake_parse_arguments(arg "RUNS_ELSEWHERE" "NAME;VERSION;ORIGIN;COMPILER;FLAGS" "SOURCES;LIBRARIES;DEFINITIONS" ${ARGN})
  if(arg_UNPARSED_ARGUMENTS OR NOT arg_NAME OR NOT arg_SOURCES)
    message(FATAL_ERROR "assay_add_engine(NAME name SOURCES file... [LIBRARIES ...] [DEFINITIONS ...] [VERSION ...])")
  endif()
  # Another build of the engine (setup/builds.txt) is a plugin <name>@<build>, where that build was made.
  set(target assay-engine-${arg_NAME})
  set(name ${arg_NAME})
  set(model assay::model)
  set(build_flags "")
  if(ASSAY_BUILD)
    list(TRANSFORM arg_LIBRARIES APPEND "-${ASSAY_BUILD}" REGEX "^engine::")
    foreach(library IN LISTS arg_LIBRARIES)
      if(library MATCHES "^engine::" AND NOT TARGET ${library})
        return()
      endif()
    endforeach()
    string(APPEND target "-${ASSAY_BUILD}")
    string(APPEND name "@${ASSAY_BUILD}")
    separate_arguments(build_flags UNIX_COMMAND "${ASSAY_BUILD_FLAGS_${ASSAY_BUILD}}")
    assay_model_of_build(model "${build_flags}")
  endif()

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
    PREFIX "" OUTPUT_NAME "assay-engine-${name}" LIBRARY_OUTPUT_DIRECTORY "${PROJECT_BINARY_DIR}/engines"
    CXX_VISIBILITY_PRESET hidden VISIBILITY_INLINES_HIDDEN ON)
  target_link_libraries(${target} PRIVATE ${model} assay::base ${arg_LIBRARIES})
  # An unknown symbol must fail here and not at the user's; the sanitizers' own come from the program.
  target_link_options(${target} PRIVATE -Wl,-Bsymbolic -Wl,--exclude-libs,ALL
    $<$<NOT:$<BOOL:${ASSAY_SANITIZE}>>:-Wl,-z,defs>)
  target_compile_options(${target} PRIVATE ${build_flags})
  target_compile_definitions(${target} PRIVATE
    "ASSAY_ENGINE_NAME=\"${name}\""
    "ASSAY_BUILD_VERSION=\"${version}\""
    "ASSAY_BUILD_SOURCE=\"${source}\""
    "ASSAY_BUILD_COMPILER=\"${compiler}\""
    "ASSAY_BUILD_FLAGS=\"${flags}\""
    ${arg_DEFINITIONS})
  if(TARGET product)
    add_dependencies(product ${target})
    assay_optimise_at_link(${target})
    if(NOT arg_RUNS_ELSEWHERE)
      assay_read_binary(${target} "${name}" "${arg_LIBRARIES}")
    endif()
    if(EXISTS "${CMAKE_CURRENT_SOURCE_DIR}/releases.txt" AND NOT ASSAY_BUILD)
      assay_describe_adapter(${arg_NAME} "${arg_SOURCES}")
    endif()
  else()
    # Outside the tree, whose own flags these are.
    separate_arguments(options UNIX_COMMAND "${ASSAY_ENGINE_CXX_FLAGS}")
    target_compile_options(${target} PRIVATE ${options})
  endif()
  include(GNUInstallDirs)
  # shared libraries of engines and of the distribution, where they are installed with assay
  set_target_properties(${target} PROPERTIES INSTALL_RPATH "$ORIGIN/..")
  install(TARGETS ${target} LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}/assay/engines)
endfunction()

# Sets `variable` to assay::model compiled with the flags of ASSAY_BUILD. A plugin is of one build as a whole: Eigen's dynamic
# arrays are allocated in another way where AVX is on, and what one half allocates the other half would free.
function(assay_model_of_build variable flags)
  set(target assay_model-${ASSAY_BUILD})
  set(${variable} ${target} PARENT_SCOPE)
  if(TARGET ${target})
    return()
  endif()
  get_target_property(sources assay_model SOURCES)
  get_target_property(folder assay_model SOURCE_DIR)
  list(TRANSFORM sources PREPEND "${folder}/")
  add_library(${target} STATIC ${sources})
  target_include_directories(${target} PUBLIC ${PROJECT_SOURCE_DIR}/src)
  target_link_libraries(${target} PUBLIC assay::base Eigen3::Eigen)
  target_compile_options(${target} PRIVATE ${flags})
  set_target_properties(${target} PROPERTIES POSITION_INDEPENDENT_CODE ON)
  assay_optimise_at_link(${target})
endfunction()

# Writes releases/<name>.sh and releases/<name>.key into the build folder, from which setup/releases.sh compiles the adapter
# for other releases of its engine: the commands, and a hash of everything of assay's that goes into the plugin.
function(assay_describe_adapter name files)
  if(ASSAY_SANITIZE OR ASSAY_PACKAGE)
    return()  # a sanitizer's runtime takes no plugin whose symbols are its own
  endif()
  list(TRANSFORM files PREPEND "${CMAKE_CURRENT_SOURCE_DIR}/")
  list(JOIN files "\" \"" sources)
  set(flags "-std=c++${CMAKE_CXX_STANDARD} ${ASSAY_ENGINE_CXX_FLAGS} -fPIC -fvisibility=hidden -fvisibility-inlines-hidden")
  if(assay_lto_works)
    string(APPEND flags " -flto=auto")  # the libraries have no other code
  endif()
  set(fmt "$<TARGET_PROPERTY:fmt::fmt,INTERFACE_COMPILE_DEFINITIONS>")
  set(eigen "$<TARGET_PROPERTY:Eigen3::Eigen,INTERFACE_INCLUDE_DIRECTORIES>")
  file(GENERATE OUTPUT "${PROJECT_BINARY_DIR}/releases/${name}.sh" CONTENT "\
compiler=(\"${CMAKE_CXX_COMPILER}\")
flags=(${flags} -w -I\"${PROJECT_SOURCE_DIR}/src\" -isystem \"$<JOIN:${eigen},\" -isystem \">\" -D$<JOIN:${fmt}, -D>)
links=(-Wl,-Bsymbolic -Wl,--exclude-libs,ALL -Wl,-z,defs)
libraries=(\"$<TARGET_FILE:assay_model>\" \"$<TARGET_FILE:assay_base>\" \"$<TARGET_FILE:fmt::fmt>\" $<JOIN:$<TARGET_PROPERTY:PkgConfig::xxhash,INTERFACE_LINK_LIBRARIES>, >)
sources=(\"${sources}\")
objdump=\"${CMAKE_OBJDUMP}\"
")
  set(folder "${PROJECT_SOURCE_DIR}/src")
  file(GLOB inputs CONFIGURE_DEPENDS "${CMAKE_CURRENT_SOURCE_DIR}/*.cc" "${CMAKE_CURRENT_SOURCE_DIR}/*.h" "${folder}/engines/*.h"
    "${folder}/model/*.h" "${folder}/model/*.cc" "${folder}/base/*.h" "${folder}/base/*.cc")
  set(key "${PROJECT_BINARY_DIR}/releases/${name}.key")
  add_custom_command(OUTPUT "${key}"
    COMMAND bash -c "{ cat \"\${@:3}\"; echo \"$2\"; } | sha256sum | cut -c1-12 >\"$1\"" - "${key}"
      "${flags} ${CMAKE_BUILD_TYPE} ${CMAKE_CXX_COMPILER_ID} ${CMAKE_CXX_COMPILER_VERSION}" ${inputs}
    DEPENDS ${inputs} COMMENT "Hashing the adapter ${name}" VERBATIM)
  add_custom_target(assay-releases-${name} DEPENDS "${key}")
  add_dependencies(assay-engine-${name} assay-releases-${name})
endfunction()

# What the plugin's binary, and the engine's own where that is a shared library, says of its build, as a file beside the
# plugin that `assay list engines` and every result repeat (src/engines/binary_facts.h).
function(assay_read_binary target name libraries)
  if(ASSAY_SANITIZE OR NOT CMAKE_OBJDUMP)
    return()
  endif()
  set(binaries $<TARGET_FILE:${target}>)
  foreach(library IN LISTS libraries)
    if(library MATCHES "^engine::")
      get_target_property(type ${library} TYPE)
      if(type STREQUAL SHARED_LIBRARY)
        list(APPEND binaries $<TARGET_FILE:${library}>)
      endif()
    endif()
  endforeach()
  set(facts "${PROJECT_BINARY_DIR}/engines/assay-engine-${name}.json")
  add_custom_command(OUTPUT "${facts}"
    COMMAND python3 "${PROJECT_SOURCE_DIR}/cmake/binary_facts.py" ${binaries} --objdump ${CMAKE_OBJDUMP} --out "${facts}"
    DEPENDS ${target} "${PROJECT_SOURCE_DIR}/cmake/binary_facts.py"
    COMMENT "Reading the binary of ${name}" VERBATIM)
  add_custom_target(facts-of-${target} DEPENDS "${facts}")
  add_dependencies(product facts-of-${target})
  install(FILES "${facts}" DESTINATION ${CMAKE_INSTALL_LIBDIR}/assay/engines OPTIONAL)
endfunction()
