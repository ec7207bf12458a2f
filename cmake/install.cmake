# Each component is a Debian package: runtime (liblbea.so.N), dev (headers, static libraries, CMake and pkg-config files),
# tools (the programs).
include(CMakePackageConfigHelpers)

set(lbea_cmake_dir ${CMAKE_INSTALL_LIBDIR}/cmake/lbea)
install(TARGETS lbea lbea_shared EXPORT lbea-targets
        LIBRARY COMPONENT runtime NAMELINK_COMPONENT dev
        ARCHIVE COMPONENT dev
        FILE_SET HEADERS COMPONENT dev)
install(EXPORT lbea-targets NAMESPACE lbea:: DESTINATION ${lbea_cmake_dir} COMPONENT dev)
configure_package_config_file(cmake/lbea-config.cmake.in ${PROJECT_BINARY_DIR}/lbea-config.cmake
        INSTALL_DESTINATION ${lbea_cmake_dir} PATH_VARS CMAKE_INSTALL_LIBDIR)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/lbea-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/lbea-config.cmake ${PROJECT_BINARY_DIR}/lbea-config-version.cmake
        DESTINATION ${lbea_cmake_dir} COMPONENT dev)

# The .pc files define the prefix relative to their own location.
file(RELATIVE_PATH lbea_prefix_from_pc /${CMAKE_INSTALL_LIBDIR}/pkgconfig /)
set(lbea_pc_files lbea.pc)
if(TARGET lbea_wire)
  list(APPEND lbea_pc_files lbea-wire.pc)
endif()
foreach(file ${lbea_pc_files})
  configure_file(cmake/${file}.in ${PROJECT_BINARY_DIR}/${file} @ONLY)
  install(FILES ${PROJECT_BINARY_DIR}/${file} DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT dev)
endforeach()

# The wire library (frames and results over ZeroMQ) is separate, because the runtime does not depend on ZeroMQ.
# In the project its headers include each other by project paths; the installed headers use <lbea/wire/...>.
if(TARGET lbea_wire)
  install(FILES $<TARGET_FILE:lbea_wire> DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT dev)
  foreach(path codec/codec access/keys codec/messages sockets/streams)
    cmake_path(GET path FILENAME header)
    set(source ${PROJECT_SOURCE_DIR}/adapters/wire/${path}.hpp)
    set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${source})
    file(READ ${source} text)
    string(REGEX REPLACE "#include \"adapters/wire/[a-z]+/([a-z_]+\\.hpp)\"" "#include <lbea/wire/\\1>" text "${text}")
    file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/wire-headers/${header}.hpp CONTENT "${text}" @ONLY)
    install(FILES ${PROJECT_BINARY_DIR}/wire-headers/${header}.hpp
            DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/lbea/wire COMPONENT dev)
  endforeach()
  install(DIRECTORY adapters/wire/schema DESTINATION ${CMAKE_INSTALL_DATADIR}/lbea COMPONENT dev)
endif()
