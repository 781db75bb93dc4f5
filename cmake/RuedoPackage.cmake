# The Debian package, by `cpack -G DEB` in the build folder: what `cmake --install` puts into /usr, with man pages, completion and what
# else Debian requires.
set(completion ${PROJECT_SOURCE_DIR}/packaging/completion)
install(FILES ${completion}/ruedo.bash DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions RENAME ruedo)
install(FILES ${completion}/_ruedo DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/vendor-completions)
install(FILES ${completion}/ruedo.fish DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d)
# The pages are made by the target man-pages, which a release builds: it starts the program twice for each command.
set(pages ${PROJECT_BINARY_DIR}/man1)
add_custom_command(OUTPUT ${pages}/ruedo.1.gz
  COMMAND ${PROJECT_SOURCE_DIR}/packaging/man_pages.sh $<TARGET_FILE:ruedo> ${pages}
  DEPENDS ruedo ${PROJECT_SOURCE_DIR}/packaging/man_pages.sh VERBATIM)
add_custom_target(man-pages DEPENDS ${pages}/ruedo.1.gz)
file(MAKE_DIRECTORY ${pages})
install(DIRECTORY ${pages} DESTINATION ${CMAKE_INSTALL_MANDIR})

# Files of the package alone: changelog, lintian's overrides, and the .pth file for Python.
set(debian ${PROJECT_BINARY_DIR}/debian)
file(GLOB of_debian ${PROJECT_SOURCE_DIR}/packaging/debian/*)
add_custom_command(OUTPUT ${debian}/usr/share/doc/ruedo/changelog.gz
  COMMAND ${RUEDO_PYTHON} ${PROJECT_SOURCE_DIR}/packaging/debian_tree.py ${debian} "${RUEDO_MAINTAINER} <${RUEDO_EMAIL}>"
  DEPENDS ${PROJECT_SOURCE_DIR}/packaging/debian_tree.py ${PROJECT_SOURCE_DIR}/CHANGELOG.md ${of_debian} VERBATIM)
add_custom_target(debian_tree DEPENDS ${debian}/usr/share/doc/ruedo/changelog.gz)

set(CPACK_PACKAGE_NAME ruedo)
set(CPACK_PACKAGE_VENDOR "${RUEDO_MAINTAINER}")
set(CPACK_PACKAGE_CONTACT "${RUEDO_MAINTAINER} <${RUEDO_EMAIL}>")
if(RUEDO_HOMEPAGE)
  set(CPACK_PACKAGE_HOMEPAGE_URL ${RUEDO_HOMEPAGE})
endif()
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "simulation server for mobile robots")
set(CPACK_PACKAGE_DESCRIPTION "Loads worlds and robots in SDF and URDF, steps them, and serves their
sensors over LCM, with clients for C++, Python and Java. The same seed and
commands give the same bytes.")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_INSTALLED_DIRECTORIES ${debian} /)
# libruedo_engine.so is for others to link; the libraries in lib/ruedo are our own.
file(WRITE ${PROJECT_BINARY_DIR}/debian-control/shlibs
  "libruedo_engine ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR} ruedo (= ${PROJECT_VERSION})\n")
set(CPACK_DEBIAN_PACKAGE_CONTROL_EXTRA ${PROJECT_SOURCE_DIR}/packaging/debian/prerm
  ${PROJECT_SOURCE_DIR}/packaging/debian/triggers ${PROJECT_BINARY_DIR}/debian-control/shlibs)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
if(CMAKE_CROSSCOMPILING)    # scripts/release gives CPACK_DEBIAN_PACKAGE_DEPENDS
  set(CPACK_DEBIAN_PACKAGE_ARCHITECTURE arm64)
else()
  set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
  set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${PROJECT_BINARY_DIR}/math)
endif()
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS "python3 (>= 3.10), python3-numpy")
set(CPACK_DEBIAN_PACKAGE_SUGGESTS "default-jre-headless, ffmpeg")
include(CPack)
