# Warnings for our own targets, not for consumers. The ci preset adds -Werror.
add_library(lbea_warnings INTERFACE)
target_compile_options(lbea_warnings INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wsign-conversion -Wnon-virtual-dtor -Wold-style-cast
  # GCC 12 gives these falsely at -O3: for std::string concatenation (GCC bug 105651) and for vectors in moved aggregates.
  # The sanitizers find the same errors.
  $<$<CXX_COMPILER_ID:GNU>:-Wno-restrict -Wno-array-bounds -Wno-stringop-overflow -Wno-maybe-uninitialized>
  # clang reports shadowed constants of other sources in a unity file. GCC reports all other shadowing.
  $<$<CXX_COMPILER_ID:Clang>:-Wno-shadow>)

# Headers that most sources include and that take longer to compile than the sources, precompiled once per group of
# targets with the same flags. With CMAKE_DISABLE_PRECOMPILE_HEADERS=ON (the dev preset) a missing include is an error.
# lbea_precompile(<group> LINK <target>... HEADERS <header>...): the standard library and HEADERS; does nothing without the
# first LINK target.
function(lbea_precompile group)
  cmake_parse_arguments(arg "" "" "LINK;HEADERS" ${ARGN})
  list(GET arg_LINK 0 dependency)
  if(NOT TARGET ${dependency})
    return()
  endif()
  set(target lbea_precompiled_${group})
  file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/precompiled/${group}.cpp CONTENT "")
  add_library(${target} OBJECT EXCLUDE_FROM_ALL ${PROJECT_BINARY_DIR}/precompiled/${group}.cpp)
  target_link_libraries(${target} PRIVATE ${arg_LINK} lbea_warnings)
  target_precompile_headers(${target} PRIVATE <algorithm> <array> <chrono> <cstdint> <filesystem> <functional> <map>
    <memory> <optional> <span> <string> <string_view> <thread> <vector> ${arg_HEADERS})
endfunction()
find_package(nlohmann_json QUIET)
find_package(Eigen3 QUIET)
lbea_precompile(libraries LINK nlohmann_json::nlohmann_json HEADERS <nlohmann/json.hpp>)
lbea_precompile(eigen LINK Eigen3::Eigen HEADERS <Eigen/Sparse>)
# lbea_reuse_precompiled(<target> <group>)
function(lbea_reuse_precompiled target group)
  if(TARGET lbea_precompiled_${group})
    target_precompile_headers(${target} REUSE_FROM lbea_precompiled_${group})
  endif()
endfunction()

# lbea_for_this_system(<variable>): removes from a list of sources those of other systems. NAME_windows.cpp is NAME.cpp for
# Windows; it includes windows.h, whose macros other sources of a unity file must not see. NAME_cross.cpp is NAME.cpp for
# all other machines.
function(lbea_for_this_system variable)
  set(kept ${${variable}})
  foreach(source ${${variable}})
    if((source MATCHES "_windows\\.cpp$" AND WIN32) OR (source MATCHES "_cross\\.cpp$" AND CMAKE_CROSSCOMPILING))
      string(REGEX REPLACE "_[a-z]+\\.cpp$" ".cpp" elsewhere ${source})
      list(REMOVE_ITEM kept ${elsewhere})
      set_source_files_properties(${source} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
    elseif(source MATCHES "_(windows|cross)\\.cpp$")
      list(REMOVE_ITEM kept ${source})
    endif()
  endforeach()
  set(${variable} ${kept} PARENT_SCOPE)
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
  lbea_for_this_system(sources)
  add_library(${target} STATIC ${sources} ${arg_SOURCES})
  target_include_directories(${target} PUBLIC ${PROJECT_SOURCE_DIR})
  target_link_libraries(${target} PUBLIC ${arg_PUBLIC} PRIVATE ${arg_PRIVATE} $<BUILD_INTERFACE:lbea_warnings>)
  if(NOT arg_PRECOMPILED)
    set(arg_PRECOMPILED libraries)
  endif()
  lbea_reuse_precompiled(${target} ${arg_PRECOMPILED})
endfunction()

# lbea_import_library(<target> <name> <definitions>): NAME.lib, with which MSVC links NAME.dll, where LLVM is installed. With
# one by GNU's dlltool, programs fail that MSVC links with /OPT:REF.
function(lbea_import_library target name definitions)
  find_program(LBEA_LLVM_DLLTOOL NAMES llvm-dlltool llvm-dlltool-14)
  if(NOT LBEA_LLVM_DLLTOOL)
    message(STATUS "There is no llvm-dlltool: no ${name}.lib")
    return()
  endif()
  set(library ${CMAKE_CURRENT_BINARY_DIR}/${name}.lib)
  add_custom_command(TARGET ${target} POST_BUILD VERBATIM
    COMMAND ${LBEA_LLVM_DLLTOOL} -m i386:x86-64 -d ${definitions} -D ${name}.dll -l ${library})
  install(FILES ${library} DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT dev)
endfunction()
