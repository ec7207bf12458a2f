# For other machines one archive of target `archived` and examples: run `cpack` in a build folder.
if(CMAKE_CROSSCOMPILING)
  set(CPACK_GENERATOR TGZ)
  set(archive_for linux-arm64)
  if(WIN32)
    set(CPACK_GENERATOR ZIP)
    set(archive_for windows-x64)
  endif()
  add_custom_target(archived DEPENDS lbea lbea_shared $<TARGET_NAME_IF_EXISTS:lbea_wire_shared>)
  get_property(programs GLOBAL PROPERTY lbea_programs)
  if(programs)
    add_dependencies(archived ${programs})
  endif()
  install(FILES docs/examples/match.c DESTINATION examples)
  # What is inside: libraries of which only headers are used, those that Debian has built, and those built here.
  file(READ cmake/debian/copyright copyright)
  string(REPLACE "/usr/share/common-licenses/LGPL-3" "license-libzmq.txt" copyright "${copyright}")
  string(REPLACE "in the same\nfolder" "in\nlicense-foxglove.txt" copyright "${copyright}")
  file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/copyright.txt CONTENT "${copyright}" @ONLY)
  install(FILES ${PROJECT_BINARY_DIR}/copyright.txt DESTINATION .)
  set(inside libxxhash-dev)
  if(WIN32)
    list(APPEND inside mingw-w64-x86-64-dev)
  endif()
  if(TARGET lbea_wire_shared)
    install(FILES docs/examples/publish.c docs/examples/subscribe.c DESTINATION examples)
    install(FILES ${PROJECT_BINARY_DIR}/third_party/zmq/libzmq-4.3.4/COPYING.LESSER DESTINATION . RENAME license-libzmq.txt)
    install(FILES ${PROJECT_BINARY_DIR}/third_party/sodium/libsodium-1.0.18/LICENSE DESTINATION . RENAME license-libsodium.txt)
    install(FILES adapters/wire/schema/foxglove/LICENSE DESTINATION . RENAME license-foxglove.txt)
    list(APPEND inside libflatbuffers-dev cppzmq-dev)
  endif()
  if(TARGET lbea-send)
    list(APPEND inside libcli11-dev libspdlog-dev libfmt-dev nlohmann-json3-dev libboost1.74-dev libeigen3-dev)
  endif()
  foreach(package ${inside})
    install(FILES /usr/share/doc/${package}/copyright DESTINATION . RENAME license-${package}.txt)
  endforeach()
  install(FILES cmake/archive/${archive_for}.txt DESTINATION . RENAME README.txt)
  set(CPACK_PACKAGE_FILE_NAME lbea-${PROJECT_VERSION}-${archive_for})
  set(CPACK_STRIP_FILES ON)
  include(CPack)
  return()
endif()

# Debian packages: run `cpack` in a build folder. dpkg-shlibdeps finds the dependencies.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_PACKAGE_CONTACT "The lbea project <lbea@localhost>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "")  # each package has its own
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_PACKAGE_PRIORITY optional)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(version_needed "(= ${PROJECT_VERSION}-${CPACK_DEBIAN_PACKAGE_RELEASE})")

# lbea_package(<component> <package> <section> <summary> <description>...): also installs the package's copyright file.
set(CPACK_COMPONENTS_ALL)
macro(lbea_package component package section summary)
  string(TOUPPER ${component} upper)
  list(APPEND CPACK_COMPONENTS_ALL ${component})
  set(CPACK_DEBIAN_${upper}_PACKAGE_NAME ${package})
  set(CPACK_DEBIAN_${upper}_PACKAGE_SECTION ${section})
  set(lines ${summary} ${ARGN})
  list(JOIN lines "\n" CPACK_DEBIAN_${upper}_DESCRIPTION)
  install(FILES ${PROJECT_SOURCE_DIR}/cmake/debian/copyright
          DESTINATION ${CMAKE_INSTALL_DATAROOTDIR}/doc/${package} COMPONENT ${component})
endmacro()

lbea_package(runtime liblbea0 libs "matches point clouds with crash simulations, runtime library"
  "Finds the finite-element simulation of an ensemble, and its time step, that"
  "best matches a point cloud captured by a 3D camera rig. For C and C++; needs"
  "only the C++ runtime.")
set(CPACK_DEBIAN_RUNTIME_PACKAGE_CONTROL_EXTRA ${PROJECT_SOURCE_DIR}/cmake/debian/triggers)
set(dev_depends "liblbea0 ${version_needed}")
if(LBEA_BUILD_TOOLS)
  lbea_package(wire liblbea-wire0 libs "matches point clouds with crash simulations, client library"
    "Sends point clouds to a running lbea-serve and receives its results, from C"
    "programs, over TCP or UNIX sockets. Contains a patched libzmq.")
  set(CPACK_DEBIAN_WIRE_PACKAGE_CONTROL_EXTRA ${PROJECT_SOURCE_DIR}/cmake/debian/triggers)
  string(APPEND dev_depends ", liblbea-wire0 ${version_needed}")
endif()
lbea_package(dev liblbea-dev libdevel "matches point clouds with crash simulations, development files"
  "Headers, CMake and pkg-config files and static libraries of lbea: the"
  "matcher, and its messages over ZeroMQ.")
set(CPACK_DEBIAN_DEV_PACKAGE_DEPENDS "${dev_depends}")
set(CPACK_DEBIAN_DEV_PACKAGE_RECOMMENDS "libzmq3-dev, pkg-config")
if(LBEA_BUILD_TOOLS)
  lbea_package(tools lbea-tools science "matches point clouds with crash simulations, programs"
    "Bakes an ensemble of simulations into one model; matches, sends and records"
    "frames over ZeroMQ; evaluates and shows the results.")
endif()
if(LBEA_BUILD_TOOLS AND LBEA_VTKHDF AND LBEA_HDF5 MATCHES "[.]a$" AND EXISTS /usr/share/doc/libhdf5-dev/copyright)
  install(FILES /usr/share/doc/libhdf5-dev/copyright RENAME copyright.hdf5
          DESTINATION ${CMAKE_INSTALL_DATAROOTDIR}/doc/lbea-tools COMPONENT tools)
endif()
if(TARGET lbea-bake-mpi)
  lbea_package(mpi lbea-bake-mpi science "bakes ensembles of crash simulations, MPI driver"
    "Bakes an ensemble of simulations into one model as one MPI job. Batch queues"
    "and single machines need only lbea-tools.")
endif()
if(LBEA_PYTHON AND LBEA_BUILD_TOOLS)
  include(cmake/python.cmake)
  lbea_package(python python3-lbea python "matches point clouds with crash simulations, Python"
    "The matcher on numpy arrays, and a client for its frames and results over"
    "ZeroMQ.")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_CONTROL_EXTRA ${PROJECT_SOURCE_DIR}/cmake/debian/python/prerm)
  math(EXPR next_minor "${Python_VERSION_MINOR} + 1")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS "python3 (>= ${Python_VERSION_MAJOR}.${Python_VERSION_MINOR}~), \
python3 (<< ${Python_VERSION_MAJOR}.${next_minor}), python3-numpy, python3-zmq, python3-flatbuffers")
endif()
include(CPack)
