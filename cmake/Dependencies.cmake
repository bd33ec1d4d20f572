# Third-party libraries, all from Debian 12 (scripts/setup.sh installs them).  Imported targets
# are SYSTEM, so their headers raise no warnings here.

find_package(PkgConfig REQUIRED)
find_package(Threads REQUIRED)
find_package(Protobuf REQUIRED)
find_package(spdlog REQUIRED)
find_package(Eigen3 REQUIRED NO_MODULE)
find_package(CLI11 REQUIRED)
find_package(nlohmann_json REQUIRED)
find_package(SQLite3 REQUIRED)
find_package(Boost REQUIRED)
pkg_check_modules(bullet REQUIRED IMPORTED_TARGET bullet-float64)
pkg_check_modules(zmq REQUIRED IMPORTED_TARGET libzmq)
# zmq.h needs no folders of its own.  Those of what libzmq links are named otherwise by a second
# configuration than by the first (CMake 3.25 and -isystem), which would compile everything again.
set_target_properties(PkgConfig::zmq PROPERTIES INTERFACE_INCLUDE_DIRECTORIES "" INTERFACE_COMPILE_OPTIONS "")
pkg_check_modules(sodium REQUIRED IMPORTED_TARGET libsodium)
pkg_check_modules(tomlplusplus REQUIRED IMPORTED_TARGET tomlplusplus)
pkg_check_modules(nlopt REQUIRED IMPORTED_TARGET nlopt)
pkg_check_modules(tinyxml2 REQUIRED IMPORTED_TARGET tinyxml2)
find_package(yaml-cpp REQUIRED)
find_package(BZip2 REQUIRED)
pkg_check_modules(lz4 REQUIRED IMPORTED_TARGET liblz4)
pkg_check_modules(zstd REQUIRED IMPORTED_TARGET libzstd)
if(GAPFARM_MUJOCO)
  find_library(mujoco_library mujoco REQUIRED)
endif()
if(GAPFARM_PYTHON)
  # Debian's own: others on the PATH do not see its packages.
  find_program(DEBIAN_PYTHON python3 PATHS /usr/bin NO_DEFAULT_PATH REQUIRED)
endif()

# What gapfarm_share takes from.
if(GAPFARM_SHARE)
  gapfarm_shared_headers(gapfarm_headers)
  gapfarm_shared_headers(gapfarm_headers_cold)
  gapfarm_cold(gapfarm_headers_cold)
endif()
