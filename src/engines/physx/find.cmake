# PhysX: built from source.
set(version 5.1.3)
assay_engine_folder(made physx)
set(folder "${made}/physx-${version}")
find_package(Threads REQUIRED)
# PhysX's headers want NDEBUG or _DEBUG, the one that its library was compiled with, whatever this build's type is.
assay_built_engine(physx VERSION ${version} FOLDER "${folder}" LIBRARY libphysx.a INCLUDE "${folder}/include/physx"
  DEFINITIONS PX_PHYSX_STATIC_LIB DISABLE_CUDA_PHYSX NDEBUG=1 PX_SUPPORT_PVD=0
  LINK Threads::Threads ${CMAKE_DL_LIBS})
