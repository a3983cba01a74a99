# Rapier: built from its crates, both precisions in one static library with a C interface of ours.
set(version 0.36.1)
assay_engine_folder(made rapier)
find_package(Threads REQUIRED)
# It links what Rust's standard library needs: `cargo rustc -- --print native-static-libs`.
assay_built_engine(rapier VERSION ${version} FOLDER "${made}/rapier-${version}" LIBRARY libassay_rapier.a
  LINK Threads::Threads ${CMAKE_DL_LIBS} m)
