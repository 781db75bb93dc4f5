# One layer of Ruedo: the static library ruedo_<name> of all sources below src/<path>/<name>.

add_library(ruedo_flags INTERFACE)
# The same bytes everywhere: no contraction to FMA, no fast math, no -march=native.
set(RUEDO_SAME_BYTES -ffp-contract=off)
if(CMAKE_SYSTEM_PROCESSOR STREQUAL aarch64)
  # Eigen names fused multiply-adds where the processor has them, and plain char has no sign.
  list(APPEND RUEDO_SAME_BYTES -U__ARM_FEATURE_FMA -fsigned-char)
  target_compile_options(ruedo_flags INTERFACE -Wno-psabi)    # of calls that GCC 9 compiled otherwise
endif()
target_compile_options(ruedo_flags INTERFACE ${RUEDO_SAME_BYTES} -Wall -Wextra -Wpedantic)
if(CMAKE_CXX_COMPILER_ID STREQUAL GNU AND CMAKE_CXX_COMPILER_VERSION VERSION_GREATER_EQUAL 13)
  target_compile_options(ruedo_flags INTERFACE -Wno-maybe-uninitialized)    # it takes a moved std::variant for one that holds all at once
endif()

# Sanitizers: -DRUEDO_SANITIZE=address,undefined or thread (see CMakePresets.json).
if(RUEDO_SANITIZE)
  # With -O2, or with the checks that are disabled here, GCC 12 needs up to nine minutes for one file that uses Eigen. The
  # address sanitizer finds null and misaligned pointers when they are used.
  add_compile_options(-O1 -fsanitize=${RUEDO_SANITIZE} -fno-omit-frame-pointer -g1)
  if(RUEDO_SANITIZE MATCHES undefined)
    add_compile_options(-fno-sanitize=null,alignment,vptr,object-size)
  endif()
  add_link_options(-fsanitize=${RUEDO_SANITIZE})
endif()

# ruedo_layer([PATH/]NAME LINK ...): a layer inside another one's folder is declared before it, and is not part of it.
function(ruedo_layer path)
  cmake_parse_arguments(ARG "" "" "LINK" ${ARGN})
  get_filename_component(name ${path} NAME)
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/src/${path}/*.cpp)
  list(FILTER sources EXCLUDE REGEX "_(main|module)\\.cpp$")
  get_property(layers GLOBAL PROPERTY RUEDO_LAYERS)
  foreach(layer ${layers})
    list(FILTER sources EXCLUDE REGEX "/src/${layer}/")
  endforeach()
  set_property(GLOBAL APPEND PROPERTY RUEDO_LAYERS ${path})
  add_library(ruedo_${name} STATIC ${sources})
  target_include_directories(ruedo_${name} PUBLIC ${CMAKE_CURRENT_SOURCE_DIR}/src ${CMAKE_CURRENT_SOURCE_DIR}/include)
  target_link_libraries(ruedo_${name} PUBLIC ${ARG_LINK} PRIVATE ruedo_flags)
endfunction()

# libruedo_<name>.so of one source file, which the program loads when it needs it (src/system/late_library.h). It lies beside our
# copies of libraries, where the program looks.
function(ruedo_late_library name source)
  add_library(ruedo_${name} MODULE ${source})
  target_include_directories(ruedo_${name} PRIVATE ${CMAKE_CURRENT_SOURCE_DIR}/src ${CMAKE_CURRENT_SOURCE_DIR}/include)
  target_link_libraries(ruedo_${name} PRIVATE ruedo_flags ${ARGN})
  set_target_properties(ruedo_${name} PROPERTIES LIBRARY_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/math INSTALL_RPATH "\$ORIGIN")
  set_property(GLOBAL APPEND PROPERTY RUEDO_LATE_LIBRARIES ruedo_${name})
endfunction()
