# Each component is a Debian package: runtime (liblbea.so.N), wire (liblbea-wire.so.N), dev (headers, static libraries,
# CMake and pkg-config files), tools (the programs).
include(CMakePackageConfigHelpers)

set(lbea_cmake_dir ${CMAKE_INSTALL_LIBDIR}/cmake/lbea)
install(TARGETS lbea lbea_shared EXPORT lbea-targets
        RUNTIME COMPONENT runtime
        LIBRARY COMPONENT runtime NAMELINK_COMPONENT dev
        ARCHIVE COMPONENT dev
        FILE_SET HEADERS COMPONENT dev)
if(TARGET lbea_wire_shared)
  install(TARGETS lbea_wire_shared EXPORT lbea-targets
          RUNTIME COMPONENT wire
          LIBRARY COMPONENT wire NAMELINK_COMPONENT dev
          ARCHIVE COMPONENT dev
          FILE_SET HEADERS COMPONENT dev)
endif()
install(EXPORT lbea-targets NAMESPACE lbea:: DESTINATION ${lbea_cmake_dir} COMPONENT dev)
if(WIN32)
  install(FILES ${PROJECT_SOURCE_DIR}/runtime/lbea.def DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT dev)
endif()
if(WIN32 AND TARGET lbea_wire_shared)
  install(FILES ${PROJECT_SOURCE_DIR}/adapters/wire/c_api/lbea-wire.def DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT dev)
endif()
configure_package_config_file(cmake/lbea-config.cmake.in ${PROJECT_BINARY_DIR}/lbea-config.cmake
        INSTALL_DESTINATION ${lbea_cmake_dir} PATH_VARS CMAKE_INSTALL_LIBDIR)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/lbea-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/lbea-config.cmake ${PROJECT_BINARY_DIR}/lbea-config-version.cmake
        DESTINATION ${lbea_cmake_dir} COMPONENT dev)

# The .pc files define the prefix relative to their own location.
file(RELATIVE_PATH lbea_prefix_from_pc /${CMAKE_INSTALL_LIBDIR}/pkgconfig /)
set(lbea_pc_files lbea.pc)
if(TARGET lbea_wire_shared)
  list(APPEND lbea_pc_files lbea-wire-c.pc)
endif()
if(LBEA_BUILD_TOOLS)
  list(APPEND lbea_pc_files lbea-wire.pc lbea-rig.pc)
endif()
foreach(file ${lbea_pc_files})
  configure_file(cmake/${file}.in ${PROJECT_BINARY_DIR}/${file} @ONLY)
  install(FILES ${PROJECT_BINARY_DIR}/${file} DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT dev)
endforeach()

# Two libraries beside the runtime, which depends neither on ZeroMQ nor on JSON: `wire`, frames and results over ZeroMQ, and
# `rig`, the reader of sensor.json. In the project their headers include each other by project paths; the installed headers
# use <lbea/wire/...> and <lbea/rig/...>.
function(lbea_install_headers folder)
  foreach(path ${ARGN})
    cmake_path(GET path FILENAME header)
    set(source ${PROJECT_SOURCE_DIR}/${path})
    set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${source})
    file(READ ${source} text)
    string(REGEX REPLACE "#include \"[a-z_/]+/([a-z_]+\\.hpp)\"" "#include <lbea/${folder}/\\1>" text "${text}")
    file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/installed-headers/${folder}/${header} CONTENT "${text}" @ONLY)
    install(FILES ${PROJECT_BINARY_DIR}/installed-headers/${folder}/${header}
            DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/lbea/${folder} COMPONENT dev)
  endforeach()
endfunction()
if(LBEA_BUILD_TOOLS)
  install(FILES $<TARGET_FILE:lbea_wire> $<TARGET_FILE:lbea_rig_files> $<TARGET_FILE:lbea_files>
          DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT dev)
  lbea_install_headers(wire adapters/wire/access/keys.hpp adapters/wire/codec/codec.hpp adapters/wire/codec/messages.hpp
    adapters/wire/sockets/client.hpp adapters/wire/sockets/streams.hpp)
  lbea_install_headers(rig adapters/rig/sensor_json.hpp precompute/rig/stereo_sensor.hpp)
  install(DIRECTORY adapters/wire/schema DESTINATION ${CMAKE_INSTALL_DATADIR}/lbea COMPONENT dev)
endif()
