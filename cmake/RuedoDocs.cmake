# The public C++ headers as pages, BUILD/docs/api/index.html: target ruedo-docs. A warning of doxygen fails it.
find_program(RUEDO_DOXYGEN doxygen)
mark_as_advanced(RUEDO_DOXYGEN)
if(RUEDO_DOXYGEN)
  configure_file(docs/Doxyfile.in ${PROJECT_BINARY_DIR}/docs/Doxyfile @ONLY)
  add_custom_target(ruedo-docs COMMAND ${RUEDO_DOXYGEN} ${PROJECT_BINARY_DIR}/docs/Doxyfile VERBATIM)
endif()
