# Finds Ruedo's dependencies; docs/install.md lists the packages.
find_package(PkgConfig REQUIRED)
find_package(Threads REQUIRED GLOBAL)    # of ruedo::client, which others link
find_package(Eigen3 REQUIRED NO_MODULE)
find_package(TBB REQUIRED)
find_package(CLI11 REQUIRED)
find_package(fmt REQUIRED)
find_package(spdlog REQUIRED)
pkg_check_modules(TINYXML2 REQUIRED IMPORTED_TARGET tinyxml2)
pkg_check_modules(URDFDOM REQUIRED urdfdom console_bridge)    # console_bridge: what urdfdom says; Debian 13 names it apart
pkg_check_modules(YAMLCPP REQUIRED IMPORTED_TARGET yaml-cpp)
pkg_check_modules(LIBCRYPTO REQUIRED IMPORTED_TARGET libcrypto)
pkg_check_modules(ZLIB REQUIRED IMPORTED_TARGET zlib)
pkg_check_modules(ZSTD REQUIRED IMPORTED_TARGET libzstd)
pkg_check_modules(SECCOMP REQUIRED IMPORTED_TARGET libseccomp)
# Double precision: its own libraries, and -DBT_USE_DOUBLE_PRECISION in the flags.
pkg_check_modules(BULLET REQUIRED bullet-float64)

# Libraries that compute results, as copies that call our elementary functions.
include(RuedoMath)
function(ruedo_find_for_copies out)
  set(found "")
  foreach(name ${ARGN})
    find_library(RUEDO_LIBRARY_${name} ${name} REQUIRED)
    list(APPEND found ${RUEDO_LIBRARY_${name}})
  endforeach()
  set(${out} ${found} PARENT_SCOPE)
endfunction()
ruedo_find_for_copies(libraries BulletDynamics-float64 BulletCollision-float64 LinearMath-float64)
ruedo_own_math(ruedo_bullet ${libraries})
target_include_directories(ruedo_bullet SYSTEM INTERFACE ${BULLET_INCLUDE_DIRS})
target_compile_options(ruedo_bullet INTERFACE ${BULLET_CFLAGS_OTHER})
ruedo_find_for_copies(libraries urdfdom_model)
ruedo_own_math(ruedo_urdfdom ${libraries})
target_include_directories(ruedo_urdfdom SYSTEM INTERFACE ${URDFDOM_INCLUDE_DIRS})
ruedo_find_for_copies(libraries console_bridge)
target_link_libraries(ruedo_urdfdom INTERFACE ${libraries})
ruedo_find_for_copies(libraries assimp)
ruedo_own_math(ruedo_assimp ${libraries})

# Embree 4 (Debian 13) or 3 (Debian 12); RUEDO_EMBREE is the major version.
find_package(embree 4 QUIET)
if(embree_FOUND)
  set(RUEDO_EMBREE 4)
else()
  find_package(embree 3 REQUIRED)
  set(RUEDO_EMBREE 3)
endif()
add_library(ruedo_embree INTERFACE)
target_link_libraries(ruedo_embree INTERFACE embree)
target_compile_definitions(ruedo_embree INTERFACE RUEDO_EMBREE=${RUEDO_EMBREE})

# OSMesa where there is one (gone from Mesa 25.1 on), surfaceless EGL beside it.
add_library(ruedo_opengl INTERFACE)
pkg_check_modules(OSMESA IMPORTED_TARGET osmesa)    # linked to libruedo_osmesa.so alone
if(OSMESA_FOUND)
  target_compile_definitions(ruedo_opengl INTERFACE RUEDO_OSMESA=1)
endif()
pkg_check_modules(EGL IMPORTED_TARGET egl)
if(EGL_FOUND)
  target_link_libraries(ruedo_opengl INTERFACE PkgConfig::EGL)
  target_compile_definitions(ruedo_opengl INTERFACE RUEDO_EGL=1)
endif()
if(NOT OSMESA_FOUND AND NOT EGL_FOUND)
  message(FATAL_ERROR "neither OSMesa (libosmesa6-dev) nor EGL (libegl-dev) was found: one is needed for cameras")
endif()

# Debian's split OpenCV packages have no CMake configuration. SYSTEM: its headers warn under C++20.
find_path(OPENCV_INCLUDE opencv2/core.hpp PATH_SUFFIXES opencv4 REQUIRED)
add_library(ruedo_opencv INTERFACE)
target_include_directories(ruedo_opencv SYSTEM INTERFACE ${OPENCV_INCLUDE})
target_link_libraries(ruedo_opencv INTERFACE opencv_imgproc opencv_core)

# LCM 1.5.3 from its wheel: lcm_DIR where that is given, the .venv that scripts/run makes, or that of the Python on the PATH.
if(NOT lcm_DIR)
  file(GLOB found ${CMAKE_CURRENT_SOURCE_DIR}/.venv/lib/python3*/site-packages/lib/lcm/cmake)
  if(NOT found)
    execute_process(COMMAND python3 -c "import sysconfig; print(sysconfig.get_path('platlib'), end='')" OUTPUT_VARIABLE found ERROR_QUIET)
    string(APPEND found /lib/lcm/cmake)
  endif()
  list(GET found 0 found)
  set(lcm_DIR ${found})
endif()
# Its files are used, not its package: that defines targets with general names, `lcm` and `lcm-gen`, which a project that
# contains Ruedo may have itself.
get_filename_component(lcm_wheel "${lcm_DIR}/../../.." ABSOLUTE)
set(PACKAGE_VERSION 0)
include(${lcm_DIR}/lcmConfigVersion.cmake OPTIONAL)
set(lcm_library ${lcm_wheel}/lib/liblcm.so.${PACKAGE_VERSION})
if("${PACKAGE_VERSION}" VERSION_LESS 1.5.3 OR NOT EXISTS ${lcm_library})
  message(FATAL_ERROR "LCM 1.5.3 was not found: pip install lcm==1.5.3 into a virtual environment, and give the folder of its lcmConfig.cmake "
    "as -Dlcm_DIR=VENV/lib/python3.X/site-packages/lib/lcm/cmake")
endif()
# Beside our copies of libraries, so that no program says where its virtual environment is.
file(COPY_FILE ${lcm_library} ${ruedo_math_folder}/liblcm.so.1 ONLY_IF_DIFFERENT)
set(lcm_library ${ruedo_math_folder}/liblcm.so.1)
add_library(ruedo::lcm SHARED IMPORTED GLOBAL)
set_target_properties(ruedo::lcm PROPERTIES IMPORTED_LOCATION ${lcm_library} IMPORTED_SONAME liblcm.so.1
  INTERFACE_INCLUDE_DIRECTORIES ${lcm_wheel}/include)
# It runs here, whatever processor the library is for.
set(lcm_gen ${lcm_wheel}/bin/lcm-gen)
if(CMAKE_CROSSCOMPILING)
  find_program(RUEDO_LCM_GEN lcm-gen PATHS ${PROJECT_SOURCE_DIR}/.venv/bin REQUIRED)
  set(lcm_gen ${RUEDO_LCM_GEN})
endif()
add_executable(ruedo::lcm-gen IMPORTED GLOBAL)
set_target_properties(ruedo::lcm-gen PROPERTIES IMPORTED_LOCATION ${lcm_gen})
include(${lcm_DIR}/lcmUtilities.cmake)    # lcm_wrap_types
set(LCM_NAMESPACE ruedo::)                 # of the target lcm-gen that it calls
