# PhysX 5.6.1: WebAssembly, turned into C and built from that. Its C++ interface is here, in api/.
set(version 5.6.1)
assay_engine_folder(made physx56)
set(folder "${made}/physx-${version}")
assay_built_engine(physx56 VERSION ${version} FOLDER "${folder}" LIBRARY libphysx56.a
  INCLUDE "${folder}/include/physx56")
if(TARGET engine::physx56)
  target_include_directories(engine::physx56 INTERFACE "${PROJECT_SOURCE_DIR}/src/engines/physx56/api")
endif()
