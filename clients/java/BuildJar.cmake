# Makes ruedo.jar: PROTO, SOURCES, OUTPUT, VERSION, LICENSE, LCM_GEN, PYTHON, JAVAC and JAR say from what and with what.
#
# The message types come out as the package ruedo.lcmtypes: renamed on the way, so that they do not meet the
# library's own classes; LCM's fingerprints do not depend on it. They implement LCM's interface, which is declared here, too, and LCM's own jar may lie beside them.
include(${CMAKE_CURRENT_LIST_DIR}/jar.cmake)

set(work ${OUTPUT}/work)
file(REMOVE_RECURSE ${work})
file(MAKE_DIRECTORY ${work}/proto ${work}/classes ${work}/examples)

file(GLOB protos ${PROTO}/*.lcm)
foreach(proto ${protos})
  get_filename_component(name ${proto} NAME)
  file(READ ${proto} text)
  string(REPLACE "package ruedo;" "package ruedo.lcmtypes;" text "${text}")
  file(WRITE ${work}/proto/${name} "${text}")
endforeach()
file(GLOB protos ${work}/proto/*.lcm)
run(${LCM_GEN} -j --jpath ${work}/java ${protos})

file(GLOB generated ${work}/java/ruedo/lcmtypes/*.java)
foreach(type ${generated})
  file(READ ${type} text)
  string(REPLACE "import lcm.lcm.*;\n" "" text "${text}")
  string(REPLACE "lcm.lcm.LCMEncodable" "Message" text "${text}")
  string(REPLACE "new LCMDataInputStream(data)" "new DataInputStream(new ByteArrayInputStream(data))" text "${text}")
  file(WRITE ${type} "${text}")
endforeach()
run(${PYTHON} -B ${PROTO}/generator java ${work}/java)
file(GLOB library ${SOURCES}/src/ruedo/*.java ${work}/java/ruedo/*.java)
file(GLOB message ${SOURCES}/src/ruedo/lcmtypes/*.java ${SOURCES}/src/lcm/lcm/*.java)
run(${JAVAC} --release 11 -nowarn -encoding UTF-8 -cp ${work}/classes -d ${work}/classes ${generated} ${message})
run(${JAVAC} --release 11 -Xlint:all -encoding UTF-8 -cp ${work}/classes -d ${work}/classes ${library})
file(COPY ${LICENSE} DESTINATION ${work}/classes/META-INF)
file(WRITE ${work}/manifest "Created-By: ruedo\nAutomatic-Module-Name: ruedo\nImplementation-Title: ruedo\nImplementation-Version: ${VERSION}\n")
make_jar(${OUTPUT}/ruedo.jar ${work}/classes --manifest ${work}/manifest)

file(GLOB examples ${SOURCES}/examples/*.java)
run(${JAVAC} --release 11 -Xlint:all -encoding UTF-8 -cp ${work}/classes -d ${work}/examples ${examples})
make_jar(${OUTPUT}/ruedo-examples.jar ${work}/examples)
