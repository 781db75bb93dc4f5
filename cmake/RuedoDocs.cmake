# The public C++ headers as pages, BUILD/docs/api/index.html: target ruedo-docs. A warning of doxygen fails it.
find_program(RUEDO_DOXYGEN doxygen)
mark_as_advanced(RUEDO_DOXYGEN)
if(RUEDO_DOXYGEN)
  configure_file(docs/Doxyfile.in ${PROJECT_BINARY_DIR}/docs/Doxyfile @ONLY)
  add_custom_target(ruedo-docs COMMAND ${RUEDO_DOXYGEN} ${PROJECT_BINARY_DIR}/docs/Doxyfile VERBATIM)
endif()

# The site, BUILD/site/index.html: target ruedo-site. `ruedo docs` opens it, and scripts/make_wheel.py puts it into a wheel.
add_custom_target(ruedo-site
  COMMAND ${RUEDO_PYTHON} ${PROJECT_SOURCE_DIR}/scripts/site/build.py ${PROJECT_BINARY_DIR} ${PROJECT_BINARY_DIR}/site VERBATIM)
foreach(part ruedo python_types ruedo-docs maven_artifact)
  if(TARGET ${part})
    add_dependencies(ruedo-site ${part})
  endif()
endforeach()
