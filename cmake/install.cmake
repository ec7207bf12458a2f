include(CMakePackageConfigHelpers)

install(TARGETS lbea EXPORT lbea-targets FILE_SET HEADERS)
install(EXPORT lbea-targets NAMESPACE lbea:: DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/lbea)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/lbea-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES cmake/lbea-config.cmake ${PROJECT_BINARY_DIR}/lbea-config-version.cmake
        DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/lbea)
