# ruedo_add_regression(NAME name WORLD file DURATION seconds [CLIENT command...] ...): a test of ctest that runs a world with
# a client at full speed, in a network of its own, and fails with the first unmet expectation. docs/regressions.md has the details.
#
#   NAME WORLD DURATION            what and how long (s of sim time); the client's end ends it sooner
#   CLIENT command...              a program or target and its arguments; it finds the run by LCM_DEFAULT_URL
#   SEED n                         default 1
#   LOCKSTEP n | WAIT_FOR ch@hz... how the client is kept in step (repeatable); neither: it runs freely
#   GOLDEN file                    log to compare with; KEEP patterns... what the golden log keeps (default */pose),
#   TOLERANCES rules... IGNORE patterns...    as of `ruedo diff`
#   ROBOT name                     the robot of the following options; default: the first of the world
#   GOAL x y RADIUS r BY s         gets there in time
#   NO_CONTACT CLEARANCE m ODOMETRY_ERROR m
#   SCRIPT command...              judges by its exit code; RUEDO_LOG is the log of the run
#   OPTIONS options...             more of `ruedo regress`: --spawn, --set, --disable, --remap, ...
#   TIMEOUT s                      of real time; default 300
#
# The target renew-goldens rewrites all golden logs: cmake --build BUILD --target renew-goldens.

function(ruedo_add_regression)
  cmake_parse_arguments(PARSE_ARGV 0 ARG "NO_CONTACT"
    "NAME;WORLD;DURATION;SEED;LOCKSTEP;GOLDEN;ROBOT;RADIUS;BY;CLEARANCE;ODOMETRY_ERROR;TIMEOUT"
    "CLIENT;WAIT_FOR;KEEP;TOLERANCES;IGNORE;GOAL;SCRIPT;OPTIONS")
  foreach(needed NAME WORLD DURATION)
    if(NOT DEFINED ARG_${needed})
      message(FATAL_ERROR "ruedo_add_regression: ${needed} is missing")
    endif()
  endforeach()
  if(ARG_UNPARSED_ARGUMENTS)
    message(FATAL_ERROR "ruedo_add_regression(${ARG_NAME}): unknown: ${ARG_UNPARSED_ARGUMENTS}")
  endif()
  set(folder ${CMAKE_CURRENT_BINARY_DIR}/ruedo/${ARG_NAME})
  file(MAKE_DIRECTORY ${folder})
  get_filename_component(world ${ARG_WORLD} ABSOLUTE)
  set(command regress ${world} --duration ${ARG_DURATION} --record ${folder}/run.lcm)
  foreach(option SEED LOCKSTEP ROBOT CLEARANCE ODOMETRY_ERROR)
    if(DEFINED ARG_${option})
      string(TOLOWER --${option} name)
      string(REPLACE _ - name ${name})
      list(APPEND command ${name} ${ARG_${option}})
    endif()
  endforeach()
  foreach(pair CLIENT:--client SCRIPT:--script)
    string(REPLACE : ";" pair ${pair})
    list(GET pair 0 option)
    list(GET pair 1 name)
    if(DEFINED ARG_${option})
      list(GET ARG_${option} 0 program)
      if(TARGET ${program})
        list(REMOVE_AT ARG_${option} 0)
        list(PREPEND ARG_${option} $<TARGET_FILE:${program}>)
      endif()
      ruedo_shell_line(line ${ARG_${option}})
      list(APPEND command ${name} ${line})
    endif()
  endforeach()
  foreach(pair WAIT_FOR:--wait-for KEEP:--keep TOLERANCES:--tolerance IGNORE:--ignore)
    string(REPLACE : ";" pair ${pair})
    list(GET pair 0 option)
    list(GET pair 1 name)
    foreach(value ${ARG_${option}})
      list(APPEND command ${name} ${value})
    endforeach()
  endforeach()
  if(DEFINED ARG_GOAL)
    list(LENGTH ARG_GOAL count)
    if(NOT count EQUAL 2 OR NOT DEFINED ARG_RADIUS OR NOT DEFINED ARG_BY)
      message(FATAL_ERROR "ruedo_add_regression(${ARG_NAME}): it is GOAL x y RADIUS r BY s")
    endif()
    list(JOIN ARG_GOAL , goal)
    list(APPEND command --goal=${goal},${ARG_RADIUS},${ARG_BY})
  endif()
  if(ARG_NO_CONTACT)
    list(APPEND command --no-contact)
  endif()
  if(DEFINED ARG_GOLDEN)
    get_filename_component(golden ${ARG_GOLDEN} ABSOLUTE)
    list(APPEND command --golden ${golden} --html ${folder}/difference.html)
  endif()
  if(NOT DEFINED ARG_TIMEOUT)
    set(ARG_TIMEOUT 300)
  endif()
  add_test(NAME ${ARG_NAME} COMMAND ruedo::ruedo ${command} ${ARG_OPTIONS})
  set(labels ruedo)
  if(DEFINED ARG_GOLDEN)
    list(APPEND labels ruedo-golden)
    if(NOT TARGET renew-goldens)
      add_custom_target(renew-goldens COMMAND ${CMAKE_COMMAND} -E env RUEDO_RENEW=1 ${CMAKE_CTEST_COMMAND} -L ruedo-golden --output-on-failure
        WORKING_DIRECTORY ${CMAKE_BINARY_DIR} VERBATIM)
    endif()
  endif()
  set_tests_properties(${ARG_NAME} PROPERTIES LABELS "${labels}" TIMEOUT ${ARG_TIMEOUT} WORKING_DIRECTORY ${folder}
    ENVIRONMENT_MODIFICATION "PYTHONPATH=path_list_prepend:${RUEDO_PYTHON_DIR}")
endfunction()

# The words as one line for a shell.
function(ruedo_shell_line out)
  set(line "")
  foreach(word ${ARGN})
    if(NOT word MATCHES "^[-A-Za-z0-9_./:=,@%+$<>]+$")
      string(REPLACE "'" "'\\''" word "${word}")
      set(word "'${word}'")
    endif()
    string(APPEND line " ${word}")
  endforeach()
  string(STRIP "${line}" line)
  set(${out} "${line}" PARENT_SCOPE)
endfunction()
