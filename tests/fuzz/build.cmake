# Configures and builds the fuzzers with clang, and gathers their seeds: cmake -DSOURCE= -DBUILD= -DCLANG= -DCLANG_C=
# -DLAUNCHER= -DFUZZERS= -DPYTHON= -DIMPORTER= -P build.cmake
function(call)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE result)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "failed: ${ARGN}")
  endif()
endfunction()

set(ENV{CCACHE_SLOPPINESS} pch_defines,time_macros)    # else it keeps nothing of what uses precompiled headers
call(${CMAKE_COMMAND} -S ${SOURCE} -B ${BUILD} -G Ninja -DCMAKE_BUILD_TYPE=None -DCMAKE_CXX_COMPILER=${CLANG} -DCMAKE_C_COMPILER=${CLANG_C}
  -DCMAKE_CXX_COMPILER_LAUNCHER=${LAUNCHER} -DRUEDO_SANITIZE=fuzzer-no-link,address,undefined,float-cast-overflow -DRUEDO_FUZZ=ON -DRUEDO_TESTS=OFF -DRUEDO_BENCHMARKS=OFF -DRUEDO_CONSOLE=OFF
  -DCMAKE_CXX_FLAGS=-fno-sanitize-recover=all -DRUEDO_IMPORTER=${IMPORTER})
call(${CMAKE_COMMAND} --build ${BUILD} --target fuzzers --parallel 1)    # one of the tests that run side by side
foreach(name ${FUZZERS})
  file(MAKE_DIRECTORY ${BUILD}/corpus/${name})
endforeach()
call(${PYTHON} ${SOURCE}/tests/fuzz/seeds.py ${BUILD}/seeds ${SOURCE}/worlds ${SOURCE}/tests)    # the same everywhere
call(${PYTHON} ${SOURCE}/tests/fuzz/seeds.py ${BUILD}/seeds_nightly ${SOURCE}/../shared/corpus)
