# PhysX: built from source.
set(version 5.1.3)
assay_engine_folder(made physx)
set(folder "${made}/physx-${version}")
if(EXISTS "${folder}/lib/libphysx.a")
  find_package(Threads REQUIRED)
  add_library(engine::physx${suffix} STATIC IMPORTED GLOBAL)
  # PhysX's headers want NDEBUG or _DEBUG, the one that its library was compiled with, whatever this build's type is.
  set_target_properties(engine::physx${suffix} PROPERTIES
    IMPORTED_LOCATION "${folder}/lib/libphysx.a"
    INTERFACE_INCLUDE_DIRECTORIES "${folder}/include/physx"
    INTERFACE_COMPILE_DEFINITIONS "PX_PHYSX_STATIC_LIB;DISABLE_CUDA_PHYSX;NDEBUG=1;PX_SUPPORT_PVD=0"
    INTERFACE_LINK_LIBRARIES "Threads::Threads;${CMAKE_DL_LIBS}")
  assay_engine_facts(physx${suffix} ${version} "${folder}")
  message(STATUS "assay: engine physx${suffix}: ${folder}")
else()
  assay_engine_absent(physx${suffix} "${run_setup}")
endif()
