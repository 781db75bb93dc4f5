# Makes ruedo.jar: PROTO, SOURCES, OUTPUT, VERSION, LCM_GEN, LCM_JAR, JAVAC and JAR say from what and with what.
#
# The message types come out as the package ruedo.lcmtypes: renamed on the way, so that they do not meet the
# library's own classes; LCM's fingerprints do not depend on it.
function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE result)
  if(result)
    message(FATAL_ERROR "failed: ${ARGN}")
  endif()
endfunction()

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

# LCM's own classes, without its graphical tools.
execute_process(COMMAND ${JAR} xf ${LCM_JAR} lcm/lcm lcm/util WORKING_DIRECTORY ${work}/classes)

file(GLOB generated ${work}/java/ruedo/lcmtypes/*.java)
file(GLOB library ${SOURCES}/src/ruedo/*.java)
run(${JAVAC} --release 11 -nowarn -encoding UTF-8 -cp ${work}/classes -d ${work}/classes ${generated})
run(${JAVAC} --release 11 -Xlint:all -encoding UTF-8 -cp ${work}/classes -d ${work}/classes ${library})
file(WRITE ${work}/manifest "Automatic-Module-Name: ruedo\nImplementation-Title: ruedo\nImplementation-Version: ${VERSION}\n")
# The same bytes from the same classes, where jar can (from 17 on).
execute_process(COMMAND ${JAR} --help OUTPUT_VARIABLE help)
set(date "")
if(help MATCHES "--date=")
  set(date --date=2020-01-01T00:00:00Z)
endif()
run(${JAR} --create --file ${OUTPUT}/ruedo.jar ${date} --manifest ${work}/manifest -C ${work}/classes .)

file(GLOB examples ${SOURCES}/examples/*.java)
run(${JAVAC} --release 11 -Xlint:all -encoding UTF-8 -cp ${work}/classes -d ${work}/examples ${examples})
run(${JAR} cf ${OUTPUT}/ruedo-examples.jar -C ${work}/examples .)
