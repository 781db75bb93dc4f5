# ruedo::plugin: what a shared library with sensors and drives of a user's own links; include/ruedo/plugin.h says the rest.
#
# A plugin has copies of what it calls (typed reads, random numbers, noise, elementary functions), so that it needs no symbol of the
# program, or Python module, that loads it. What both must agree on is the layout of the types in these headers.
set(RUEDO_PLUGIN_HEADERS include/ruedo/bound.h include/ruedo/decode.h include/ruedo/drive.h include/ruedo/element.h include/ruedo/errors.h include/ruedo/index.h
  include/ruedo/math.h include/ruedo/plugin.h include/ruedo/pose.h include/ruedo/quantity.h include/ruedo/random.h include/ruedo/schema.h include/ruedo/sensor.h
  include/ruedo/sim_time.h include/ruedo/snapshot.h include/ruedo/state_archive.h)
# Headers of the lower layers, under the names by which sources in this tree include them.
set(RUEDO_PLUGIN_LAYER_HEADERS world/model/body_layout.h world/model/fault.h world/model/mesh.h world/model/world_model.h scene/rays/ray_scene.h scene/pictures/render_scene.h sensors/noise.h)

set(headers ${RUEDO_PLUGIN_HEADERS})
foreach(header ${RUEDO_PLUGIN_LAYER_HEADERS})
  list(APPEND headers src/${header})
endforeach()
list(TRANSFORM headers PREPEND ${CMAKE_CURRENT_SOURCE_DIR}/)
set(RUEDO_PLUGIN_ABI ${CMAKE_CURRENT_BINARY_DIR}/plugin/ruedo/plugin_abi.h)
add_custom_command(OUTPUT ${RUEDO_PLUGIN_ABI}
  COMMAND ${CMAKE_COMMAND} -DVERSION=${PROJECT_VERSION} "-DFILES=${headers}" -DIN=${CMAKE_CURRENT_SOURCE_DIR}/cmake/plugin_abi.h.in -DOUT=${RUEDO_PLUGIN_ABI}
          -P ${CMAKE_CURRENT_SOURCE_DIR}/cmake/HashOfFiles.cmake
  DEPENDS ${headers} cmake/plugin_abi.h.in cmake/HashOfFiles.cmake VERBATIM)
target_sources(ruedo_system PRIVATE ${RUEDO_PLUGIN_ABI})
set_source_files_properties(src/system/plugins.cpp PROPERTIES INCLUDE_DIRECTORIES ${CMAKE_CURRENT_BINARY_DIR}/plugin)
target_link_libraries(ruedo_system PUBLIC ${CMAKE_DL_LIBS})

add_library(ruedo_plugin STATIC src/base/element.cpp src/base/errors.cpp src/base/kinds.cpp src/base/math/atan2.cpp src/base/math/c_names.cpp
  src/base/nearest_word.cpp src/base/quantity.cpp src/base/random.cpp src/base/sim_time.cpp src/base/text.cpp src/base/utf8.cpp src/world/model/link_in_body.cpp src/sensors/noise.cpp
  ${RUEDO_MATH_OBJECT} ${RUEDO_PLUGIN_ABI})
add_library(ruedo::plugin ALIAS ruedo_plugin)
set_target_properties(ruedo_plugin PROPERTIES EXPORT_NAME plugin CXX_VISIBILITY_PRESET hidden)
target_link_libraries(ruedo_plugin PRIVATE $<BUILD_INTERFACE:ruedo_flags> PUBLIC Eigen3::Eigen $<BUILD_INTERFACE:ruedo_lcmtypes>)
target_compile_features(ruedo_plugin PUBLIC cxx_std_20)
target_include_directories(ruedo_plugin
  PUBLIC $<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}/include> $<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}/src>
         $<BUILD_INTERFACE:${CMAKE_CURRENT_BINARY_DIR}/plugin>
         $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/ruedo/plugin>
         $<INSTALL_INTERFACE:lib/ruedo/include>)
# The same results in a plugin as in Ruedo; its symbols are hidden; missing symbols are reported when it is linked.
target_compile_options(ruedo_plugin INTERFACE ${RUEDO_SAME_BYTES} -fvisibility=hidden)
target_link_options(ruedo_plugin INTERFACE LINKER:--exclude-libs,ALL LINKER:--no-undefined)
target_sources(ruedo_plugin INTERFACE $<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}/cmake/plugin_entry.cpp>
  $<INSTALL_INTERFACE:${CMAKE_INSTALL_DATADIR}/ruedo/plugin_entry.cpp>)
