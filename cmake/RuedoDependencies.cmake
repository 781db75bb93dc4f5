# Finds what Ruedo is built on; docs/getting-started.md lists the packages.
find_package(PkgConfig REQUIRED)
find_package(Threads REQUIRED)
find_package(Eigen3 REQUIRED NO_MODULE)
find_package(TBB REQUIRED)
find_package(assimp REQUIRED)
find_package(CLI11 REQUIRED)
find_package(fmt REQUIRED)
find_package(spdlog REQUIRED)
pkg_check_modules(TINYXML2 REQUIRED IMPORTED_TARGET tinyxml2)
pkg_check_modules(URDFDOM REQUIRED IMPORTED_TARGET urdfdom console_bridge)    # console_bridge: what urdfdom says; Debian 13 names it apart
pkg_check_modules(YAMLCPP REQUIRED IMPORTED_TARGET yaml-cpp)
pkg_check_modules(LIBCRYPTO REQUIRED IMPORTED_TARGET libcrypto)
pkg_check_modules(SECCOMP REQUIRED IMPORTED_TARGET libseccomp)
# Double precision: its own libraries, and -DBT_USE_DOUBLE_PRECISION in the flags.
pkg_check_modules(BULLET REQUIRED IMPORTED_TARGET bullet-float64)

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
pkg_check_modules(OSMESA IMPORTED_TARGET osmesa)
if(OSMESA_FOUND)
  target_link_libraries(ruedo_opengl INTERFACE PkgConfig::OSMESA)
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
target_link_libraries(ruedo_opencv INTERFACE opencv_imgcodecs opencv_imgproc opencv_core)

# LCM 1.5.3 from its wheel: the .venv that scripts/run makes, unless lcm_DIR says otherwise.
if(NOT lcm_DIR)
  file(GLOB RUEDO_LCM_CMAKE ${CMAKE_CURRENT_SOURCE_DIR}/.venv/lib/python3*/site-packages/lib/lcm/cmake)
  if(RUEDO_LCM_CMAKE)
    list(GET RUEDO_LCM_CMAKE 0 lcm_DIR)
  endif()
endif()
find_package(lcm 1.5.3 REQUIRED)
