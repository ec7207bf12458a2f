# Private to our own targets: consumers never see these flags. The ci preset adds -Werror.
add_library(lbea_warnings INTERFACE)
target_compile_options(lbea_warnings INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wsign-conversion -Wnon-virtual-dtor -Wold-style-cast
  # GCC 12 raises these falsely at -O3: for plain std::string concatenation (GCC bug 105651), and for vectors inside
  # aggregates that are moved. The sanitizers watch what they would.
  $<$<CXX_COMPILER_ID:GNU>:-Wno-restrict -Wno-stringop-overflow -Wno-maybe-uninitialized>)

# lbea_library(<target> [FOLDERS ...] [SOURCES ...] [PUBLIC ...] [PRIVATE ...]): one static library, silent by design.
# FOLDERS: every .cpp in them, relative to the CMakeLists.txt that calls; SOURCES: generated files and exceptions.
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
