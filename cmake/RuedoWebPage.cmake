# The console's page: packages by npm from the lock file, types checked by tsc, bundled by esbuild, and put into the
# program as a C++ file. npm runs when the lock file has changed and at no other time.
set(web ${PROJECT_SOURCE_DIR}/web)
set(page ${PROJECT_BINARY_DIR}/web)
file(MAKE_DIRECTORY ${page}/generated)
file(CREATE_LINK ${web}/src ${page}/src SYMBOLIC)
file(CREATE_LINK ${web}/tests ${page}/tests SYMBOLIC)
file(CREATE_LINK ${web}/vitest.config.mjs ${page}/vitest.config.mjs SYMBOLIC)

add_custom_command(OUTPUT ${page}/packages.stamp
  COMMAND ${CMAKE_COMMAND} -E copy ${web}/package.json ${web}/package-lock.json ${web}/.npmrc ${web}/tsconfig.json ${page}
  COMMAND ${RUEDO_NPM} ci --no-progress --loglevel=error
  COMMAND ${CMAKE_COMMAND} -E touch packages.stamp
  DEPENDS ${web}/package.json ${web}/package-lock.json ${web}/.npmrc ${web}/tsconfig.json
  WORKING_DIRECTORY ${page} COMMENT "Packages of the web console" VERBATIM)

add_custom_command(OUTPUT ${page}/generated/messages.ts
  COMMAND ${RUEDO_NODE} ${web}/generate.mjs ${PROJECT_SOURCE_DIR}/proto ${page}/generated/messages.ts
  DEPENDS ${RUEDO_LCM_FILES} ${web}/generate.mjs VERBATIM)

file(GLOB_RECURSE RUEDO_WEB_SOURCES CONFIGURE_DEPENDS ${web}/src/*)
add_custom_command(OUTPUT ${page}/assets.cpp
  COMMAND ${CMAKE_COMMAND} -E copy ${web}/build.mjs ${page}/build.mjs
  COMMAND ${RUEDO_NODE} node_modules/typescript/bin/tsc
  COMMAND ${RUEDO_NODE} build.mjs assets.cpp
  DEPENDS ${page}/packages.stamp ${page}/generated/messages.ts ${RUEDO_WEB_SOURCES} ${web}/build.mjs
  WORKING_DIRECTORY ${page} COMMENT "The web console's page" VERBATIM)
target_sources(ruedo_console PRIVATE ${page}/assets.cpp)
