# Who publishes Ruedo: set these before `scripts/release`, in this file or as -DRUEDO_...= of CMake. They go into the wheel, the Debian
# package and the Maven artifact; an address that is empty is left out.
set(RUEDO_MAINTAINER "The Ruedo authors" CACHE STRING "maintainer of the packages")
set(RUEDO_EMAIL "ruedo@localhost" CACHE STRING "the maintainer's address")
set(RUEDO_HOMEPAGE "" CACHE STRING "https://...: the project's page")
set(RUEDO_SOURCES "" CACHE STRING "https://...: its repository")
set(RUEDO_MAVEN_GROUP "ruedo" CACHE STRING "Maven's groupId; Maven Central wants a domain of the publisher's, such as org.example")
