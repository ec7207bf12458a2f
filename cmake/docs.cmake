# The reference of the public headers as web pages: target `docs`, where doxygen is installed; a warning is an error.
find_package(Doxygen QUIET)
if(DOXYGEN_FOUND)
  configure_file(docs/Doxyfile.in ${PROJECT_BINARY_DIR}/Doxyfile @ONLY)
  add_custom_target(docs COMMAND Doxygen::doxygen ${PROJECT_BINARY_DIR}/Doxyfile
    COMMENT "${PROJECT_BINARY_DIR}/docs/html/index.html" VERBATIM)
endif()
