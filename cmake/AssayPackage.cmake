# What an adapter outside this tree is built from: headers, assay::model with all it needs, and assay_add_engine(), found by
# find_package(assay).
include(CMakePackageConfigHelpers)
set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/assay)

install(TARGETS assay_base assay_model EXPORT assayTargets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(EXPORT assayTargets NAMESPACE assay:: DESTINATION ${package_dir})
install(FILES ${PROJECT_SOURCE_DIR}/cmake/AssayEngine.cmake DESTINATION ${package_dir})
configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/assayConfig.cmake.in ${PROJECT_BINARY_DIR}/assayConfig.cmake
  INSTALL_DESTINATION ${package_dir})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/assayConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/assayConfig.cmake ${PROJECT_BINARY_DIR}/assayConfigVersion.cmake
  DESTINATION ${package_dir})
foreach(header base/errors.h base/hash.h base/text.h engines/adapter.h engines/engine.h engines/springs.h
    model/actuator_force.h model/ellipsoid.h model/features.h model/geometry.h model/joint_rows.h model/kinematics.h
    model/massless.h model/model.h model/state.h)
  get_filename_component(folder ${header} DIRECTORY)
  install(FILES ${PROJECT_SOURCE_DIR}/src/${header} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/assay/${folder})
endforeach()

# The start of such an adapter, as a project that builds.
set(skeleton ${PROJECT_SOURCE_DIR}/src/engines/skeleton)
install(FILES ${skeleton}/engine.cc ${skeleton}/README.md DESTINATION ${CMAKE_INSTALL_DATADIR}/assay/skeleton)
install(FILES ${skeleton}/standalone.cmake DESTINATION ${CMAKE_INSTALL_DATADIR}/assay/skeleton RENAME CMakeLists.txt)
