# What `cmake --install` puts where. The whole may be moved afterwards: the programs find worlds and libraries relative
# to themselves, and find_package(ruedo) takes its paths from where it lies.
include(CMakePackageConfigHelpers)
set(package ${CMAKE_INSTALL_LIBDIR}/cmake/ruedo)

set_target_properties(ruedo ruedo-import-mesh PROPERTIES INSTALL_RPATH "\$ORIGIN/../${CMAKE_INSTALL_LIBDIR}/ruedo")
install(TARGETS ruedo ruedo-import-mesh RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
install(DIRECTORY ${PROJECT_SOURCE_DIR}/worlds DESTINATION ${CMAKE_INSTALL_DATADIR}/ruedo)
install(FILES ${PROJECT_SOURCE_DIR}/src/world/urdf/xacro/expand.py DESTINATION ${CMAKE_INSTALL_DATADIR}/ruedo/xacro)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/proto DESTINATION ${CMAKE_INSTALL_DATADIR}/ruedo FILES_MATCHING PATTERN "*.lcm" PATTERN generator EXCLUDE)

# LCM, which comes from a wheel and may be missing where the tree is moved to; libraries that call our elementary functions.
install(FILES ${lcm_library} DESTINATION ${CMAKE_INSTALL_LIBDIR}/ruedo)
get_property(copies GLOBAL PROPERTY RUEDO_OWN_MATH_COPIES)
install(FILES ${copies} DESTINATION ${CMAKE_INSTALL_LIBDIR}/ruedo)
get_property(late GLOBAL PROPERTY RUEDO_LATE_LIBRARIES)
install(TARGETS ${late} ruedo_core LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}/ruedo)

# find_package(ruedo): target ruedo::client in the export set ruedo.
install(TARGETS ruedo_client EXPORT ruedo ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
set_target_properties(ruedo_engine_library PROPERTIES INSTALL_RPATH "\$ORIGIN/ruedo")
install(TARGETS ruedo_engine_library EXPORT ruedo LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(FILES ${PROJECT_SOURCE_DIR}/include/ruedo/engine.h ${PROJECT_SOURCE_DIR}/include/ruedo/errors.h DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/ruedo)
install(FILES ${PROJECT_SOURCE_DIR}/include/ruedo/client.h ${PROJECT_SOURCE_DIR}/include/ruedo/client_samples.h ${PROJECT_SOURCE_DIR}/include/ruedo/client_map.h ${PROJECT_SOURCE_DIR}/include/ruedo/setting.h ${PROJECT_SOURCE_DIR}/include/ruedo/client_markers.h
  ${PROJECT_SOURCE_DIR}/include/ruedo/client_types.h ${PROJECT_BINARY_DIR}/generated/include/ruedo/client_enums.h
  ${PROJECT_BINARY_DIR}/generated/include/ruedo/client_messages.h ${PROJECT_BINARY_DIR}/generated/include/ruedo/client_requests.h
  DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/ruedo)
# ruedo::plugin, in the component of that name.
install(TARGETS ruedo_plugin EXPORT ruedo_plugin ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(EXPORT ruedo_plugin FILE ruedoPluginTargets.cmake NAMESPACE ruedo:: DESTINATION ${package})
install(FILES ${RUEDO_PLUGIN_HEADERS} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/ruedo)
install(FILES ${RUEDO_PLUGIN_ABI} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/ruedo)
foreach(header ${RUEDO_PLUGIN_LAYER_HEADERS})
  get_filename_component(layer ${header} DIRECTORY)
  install(FILES src/${header} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/ruedo/plugin/${layer})
endforeach()
install(FILES cmake/plugin_entry.cpp DESTINATION ${CMAKE_INSTALL_DATADIR}/ruedo)
if(TARGET ruedo_jar)
  install(FILES ${PROJECT_BINARY_DIR}/java/ruedo.jar DESTINATION ${CMAKE_INSTALL_DATADIR}/java)
endif()
install(EXPORT ruedo FILE ruedoTargets.cmake NAMESPACE ruedo:: DESTINATION ${package})
configure_package_config_file(cmake/ruedoConfig.cmake.in ${PROJECT_BINARY_DIR}/cmake/ruedoConfig.cmake INSTALL_DESTINATION ${package})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/cmake/ruedoConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/cmake/ruedoConfig.cmake ${PROJECT_BINARY_DIR}/cmake/ruedoConfigVersion.cmake
  cmake/RuedoRegression.cmake DESTINATION ${package})

# For those who do not use CMake: pkg-config --cflags --libs ruedo
string(REGEX REPLACE "[^/]+" ".." up ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
configure_file(cmake/ruedo.pc.in ${PROJECT_BINARY_DIR}/cmake/ruedo.pc @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/cmake/ruedo.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)

# The Python client with its pytest fixture, to put on PYTHONPATH.
set(python lib/ruedo/python)
install(DIRECTORY ${PROJECT_BINARY_DIR}/python/ruedo ${PROJECT_BINARY_DIR}/python/ruedo-${PROJECT_VERSION}.dist-info DESTINATION ${python}
  PATTERN __pycache__ EXCLUDE PATTERN "_engine*" EXCLUDE)
if(TARGET ruedo_python_engine)
  set_target_properties(ruedo_python_engine PROPERTIES INSTALL_RPATH "\$ORIGIN/../../../../${CMAKE_INSTALL_LIBDIR}/ruedo")
  install(TARGETS ruedo_python_engine LIBRARY DESTINATION ${python}/ruedo)
endif()
if(TARGET ruedo_python_engine_stable)
  set_target_properties(ruedo_python_engine_stable PROPERTIES INSTALL_RPATH "\$ORIGIN/../../../../${CMAKE_INSTALL_LIBDIR}/ruedo")
  install(TARGETS ruedo_python_engine_stable LIBRARY DESTINATION ${python}/ruedo)
endif()

# The course, the labs and the other examples, which `ruedo course` copies; from a build folder, too.
install(DIRECTORY ${PROJECT_SOURCE_DIR}/clients/python/examples/ DESTINATION ${CMAKE_INSTALL_DOCDIR}/examples
  PATTERN __pycache__ EXCLUDE PATTERN .ipynb_checkpoints EXCLUDE)
file(CREATE_LINK ${PROJECT_SOURCE_DIR}/clients/python/examples ${PROJECT_BINARY_DIR}/examples SYMBOLIC)

# The licences of everything that is installed.
set(copyright ${PROJECT_BINARY_DIR}/licences/copyright)
file(MAKE_DIRECTORY ${PROJECT_BINARY_DIR}/licences)
add_custom_command(OUTPUT ${copyright}
  COMMAND ${RUEDO_PYTHON} ${PROJECT_SOURCE_DIR}/packaging/copyright.py ${PROJECT_BINARY_DIR} ${copyright}
  DEPENDS ${PROJECT_SOURCE_DIR}/packaging/copyright.py ${PROJECT_SOURCE_DIR}/packaging/parts.py ${PROJECT_SOURCE_DIR}/packaging/parts.toml ${PROJECT_SOURCE_DIR}/LICENSE ruedo VERBATIM)
add_custom_target(licences ALL DEPENDS ${copyright})
install(FILES ${copyright} DESTINATION ${CMAKE_INSTALL_DOCDIR})

# The types of all messages as C++, for programs that speak LCM themselves; with LCM's headers in a folder of their own, for systems without LCM.
install(DIRECTORY ${PROJECT_BINARY_DIR}/proto/ruedo DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} FILES_MATCHING PATTERN "*.hpp")
install(DIRECTORY ${lcm_wheel}/include/lcm DESTINATION lib/ruedo/include FILES_MATCHING PATTERN "*.h" PATTERN "*.hpp")
# LCM's Python module, which the Python client is built on: of the Python that builds this.
install(DIRECTORY ${lcm_wheel}/lcm DESTINATION ${python} PATTERN __pycache__ EXCLUDE)
