# Warnings for our own targets, not for consumers. The ci preset adds -Werror.
add_library(lbea_warnings INTERFACE)
target_compile_options(lbea_warnings INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wsign-conversion -Wnon-virtual-dtor -Wold-style-cast
  # GCC 12 gives these falsely at -O3: for std::string concatenation (GCC bug 105651) and for vectors in moved aggregates.
  # The sanitizers find the same errors.
  $<$<CXX_COMPILER_ID:GNU>:-Wno-restrict -Wno-stringop-overflow -Wno-maybe-uninitialized>)

# lbea_library(<target> [FOLDERS ...] [SOURCES ...] [PUBLIC ...] [PRIVATE ...]): one static library.
# FOLDERS: all .cpp files in them, relative to the calling CMakeLists.txt; SOURCES: generated files and exceptions.
function(lbea_library target)
  cmake_parse_arguments(arg "" "" "FOLDERS;SOURCES;PUBLIC;PRIVATE" ${ARGN})
  list(TRANSFORM arg_FOLDERS PREPEND ${CMAKE_CURRENT_SOURCE_DIR}/)
  list(TRANSFORM arg_FOLDERS APPEND /*.cpp)
  set(sources)
  if(arg_FOLDERS)
    file(GLOB sources CONFIGURE_DEPENDS ${arg_FOLDERS})
  endif()
  add_library(${target} STATIC ${sources} ${arg_SOURCES})
  target_include_directories(${target} PUBLIC ${PROJECT_SOURCE_DIR})
  target_link_libraries(${target} PUBLIC ${arg_PUBLIC} PRIVATE ${arg_PRIVATE} $<BUILD_INTERFACE:lbea_warnings>)
endfunction()
