# Warnings for our own targets, not for consumers. The ci preset adds -Werror.
add_library(lbea_warnings INTERFACE)
target_compile_options(lbea_warnings INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wsign-conversion -Wnon-virtual-dtor -Wold-style-cast
  # GCC 12 gives these falsely at -O3: for std::string concatenation (GCC bug 105651) and for vectors in moved aggregates.
  # The sanitizers find the same errors.
  $<$<CXX_COMPILER_ID:GNU>:-Wno-restrict -Wno-array-bounds -Wno-stringop-overflow -Wno-maybe-uninitialized>)

# Headers that most sources read and that take longer to compile than the sources: compiled once per group of targets with
# equal flags. CMAKE_DISABLE_PRECOMPILE_HEADERS=ON (the dev preset) shows includes that a source lacks.
#   libraries: the standard library and nlohmann-json; eigen: the standard library and Eigen; programs: as libraries
set(lbea_standard_headers <algorithm> <array> <chrono> <cstdint> <filesystem> <functional> <map> <memory> <optional> <span>
    <string> <string_view> <thread> <vector>)
find_package(nlohmann_json QUIET)
find_package(Eigen3 QUIET)
function(lbea_precompile group headers dependency)
  if(NOT TARGET ${dependency})
    return()
  endif()
  file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/precompiled/${group}.cpp CONTENT "")
  add_library(lbea_precompiled_${group} OBJECT EXCLUDE_FROM_ALL ${PROJECT_BINARY_DIR}/precompiled/${group}.cpp)
  target_link_libraries(lbea_precompiled_${group} PRIVATE ${dependency} lbea_warnings)
  target_precompile_headers(lbea_precompiled_${group} PRIVATE ${lbea_standard_headers} ${headers})
endfunction()
lbea_precompile(libraries <nlohmann/json.hpp> nlohmann_json::nlohmann_json)
lbea_precompile(eigen <Eigen/Sparse> Eigen3::Eigen)
lbea_precompile(programs <nlohmann/json.hpp> nlohmann_json::nlohmann_json)
if(TARGET lbea_precompiled_programs)  # as CMake compiles executables
  set_target_properties(lbea_precompiled_programs PROPERTIES POSITION_INDEPENDENT_CODE OFF)
  target_compile_options(lbea_precompiled_programs PRIVATE -fPIE)
endif()
# lbea_reuse_precompiled(<target> <group>)
function(lbea_reuse_precompiled target group)
  if(TARGET lbea_precompiled_${group})
    target_precompile_headers(${target} REUSE_FROM lbea_precompiled_${group})
  endif()
endfunction()

# lbea_library(<target> [FOLDERS ...] [SOURCES ...] [PUBLIC ...] [PRIVATE ...] [PRECOMPILED eigen]): one static library.
# FOLDERS: all .cpp files in them, relative to the calling CMakeLists.txt; SOURCES: generated files and exceptions.
function(lbea_library target)
  cmake_parse_arguments(arg "" "" "FOLDERS;SOURCES;PUBLIC;PRIVATE;PRECOMPILED" ${ARGN})
  list(TRANSFORM arg_FOLDERS PREPEND ${CMAKE_CURRENT_SOURCE_DIR}/)
  list(TRANSFORM arg_FOLDERS APPEND /*.cpp)
  set(sources)
  if(arg_FOLDERS)
    file(GLOB sources CONFIGURE_DEPENDS ${arg_FOLDERS})
  endif()
  add_library(${target} STATIC ${sources} ${arg_SOURCES})
  target_include_directories(${target} PUBLIC ${PROJECT_SOURCE_DIR})
  target_link_libraries(${target} PUBLIC ${arg_PUBLIC} PRIVATE ${arg_PRIVATE} $<BUILD_INTERFACE:lbea_warnings>)
  if(NOT arg_PRECOMPILED)
    set(arg_PRECOMPILED libraries)
  endif()
  lbea_reuse_precompiled(${target} ${arg_PRECOMPILED})
endfunction()
