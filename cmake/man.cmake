# Manual pages from --help and --version of the programs: target man_pages, part of `all` if help2man is installed.
find_program(LBEA_HELP2MAN help2man)
if(LBEA_HELP2MAN)
  option(LBEA_MAN_PAGES "Manual pages of the programs" ON)
endif()
if(NOT LBEA_MAN_PAGES OR NOT LBEA_BUILD_TOOLS)
  return()
endif()

get_property(programs GLOBAL PROPERTY lbea_programs)
set(pages)
foreach(program ${programs})
  set(page ${PROJECT_BINARY_DIR}/man/${program}.1.gz)
  add_custom_command(OUTPUT ${page}
    COMMAND bash ${PROJECT_SOURCE_DIR}/cmake/man_page.sh ${LBEA_HELP2MAN} $<TARGET_FILE:${program}> ${page}
    DEPENDS ${program} ${PROJECT_SOURCE_DIR}/cmake/man_page.sh VERBATIM)
  list(APPEND pages ${page})
endforeach()
add_custom_target(man_pages ALL DEPENDS ${pages})
install(FILES ${pages} DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT tools)
