# Rapier: built from its crates, both precisions in one static library with a C interface of ours.
set(version 0.36.1)
assay_engine_folder(made rapier)
set(folder "${made}/rapier-${version}")
if(EXISTS "${folder}/lib/libassay_rapier.a")
  find_package(Threads REQUIRED)
  add_library(engine::rapier${suffix} STATIC IMPORTED GLOBAL)
  # What Rust's standard library needs: `cargo rustc -- --print native-static-libs`.
  set_target_properties(engine::rapier${suffix} PROPERTIES
    IMPORTED_LOCATION "${folder}/lib/libassay_rapier.a"
    INTERFACE_INCLUDE_DIRECTORIES "${folder}/include"
    INTERFACE_LINK_LIBRARIES "Threads::Threads;${CMAKE_DL_LIBS};m")
  assay_engine_facts(rapier${suffix} ${version} "${folder}")
  message(STATUS "assay: engine rapier${suffix}: ${folder}")
else()
  assay_engine_absent(rapier${suffix} "${run_setup}")
endif()
