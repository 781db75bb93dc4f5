# The client as Maven has it, in OUTPUT/maven, beside the ruedo.jar that BuildJar.cmake made there: the jar, its sources, its
# documentation and the pom. SOURCES, OUTPUT, VERSION, LICENSE, JAVADOC and JAR say from what and with what; GROUP, HOMEPAGE,
# REPOSITORY and MAINTAINER are the publisher's. No Maven is needed.
#
# What a method gives and takes is said in prose: the tags @param and @return, which javadoc would like to see besides, are not asked for.
include(${CMAKE_CURRENT_LIST_DIR}/jar.cmake)

set(work ${OUTPUT}/work)
set(maven ${OUTPUT}/maven)
set(name ${maven}/ruedo-${VERSION})
file(REMOVE_RECURSE ${maven} ${work}/sources ${work}/javadoc)
file(MAKE_DIRECTORY ${maven})

file(COPY_FILE ${OUTPUT}/ruedo.jar ${name}.jar)
set(ADDRESSES "")
if(HOMEPAGE)
  string(APPEND ADDRESSES "  <url>${HOMEPAGE}</url>\n")
endif()
string(APPEND ADDRESSES "  <developers>\n    <developer>\n      <name>${MAINTAINER}</name>\n    </developer>\n  </developers>\n")
if(REPOSITORY)
  string(APPEND ADDRESSES "  <scm>\n    <connection>scm:git:${REPOSITORY}</connection>\n    <url>${REPOSITORY}</url>\n  </scm>\n")
endif()
configure_file(${SOURCES}/pom.xml.in ${name}.pom @ONLY)

file(COPY ${SOURCES}/src/ruedo ${work}/java/ruedo DESTINATION ${work}/sources FILES_MATCHING PATTERN "*.java")
file(COPY ${LICENSE} DESTINATION ${work}/sources/META-INF)
make_jar(${name}-sources.jar ${work}/sources --no-manifest)

file(GLOB library ${work}/sources/ruedo/*.java)
run(${JAVADOC} -quiet -notimestamp -Xdoclint:all,-missing -Werror --release 11 -encoding UTF-8 -locale en
  -windowtitle "Ruedo ${VERSION}" -cp ${work}/classes -d ${work}/javadoc ${library})
file(COPY ${LICENSE} DESTINATION ${work}/javadoc/META-INF)
make_jar(${name}-javadoc.jar ${work}/javadoc --no-manifest)
