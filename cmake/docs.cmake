# Public headers and guides as HTML: target `docs`, if doxygen is installed. A doxygen warning is an error.
find_package(Doxygen QUIET)
if(DOXYGEN_FOUND)
  configure_file(docs/Doxyfile.in ${PROJECT_BINARY_DIR}/Doxyfile @ONLY)
  add_custom_target(docs COMMAND Doxygen::doxygen ${PROJECT_BINARY_DIR}/Doxyfile
    COMMENT "${PROJECT_BINARY_DIR}/docs/html/index.html" VERBATIM)
endif()
