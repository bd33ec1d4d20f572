# build/gapfarm_fingerprint.h: what this build is.  The fingerprint is a hash of every source that
# can change a result (the messages and whatever the worker links), the compiler and the libraries
# that do arithmetic, so two machines with the same sources and toolchain agree, and a run refuses
# workers that differ.  Included once all libraries are known.
gapfarm_linked(gapfarm-worker linked)
set(folders)
foreach(library IN LISTS linked)
  get_target_property(folder ${library} SOURCE_DIR)
  file(RELATIVE_PATH folder ${PROJECT_SOURCE_DIR} ${folder})
  list(APPEND folders ${folder})
endforeach()
list(REMOVE_DUPLICATES folders)
list(SORT folders)
list(JOIN folders "," folders)
add_custom_target(gapfarm_fingerprint
  COMMAND ${CMAKE_COMMAND}
          -DSOURCE_DIR=${PROJECT_SOURCE_DIR}
          -DOUT=${PROJECT_BINARY_DIR}/gapfarm_fingerprint.h
          -DFOLDERS=${folders}
          -DVERSION=${PROJECT_VERSION}
          "-DCOMPILER=${CMAKE_CXX_COMPILER_ID} ${CMAKE_CXX_COMPILER_VERSION}"
          "-DBULLET=${bullet_VERSION}" "-DEIGEN=${Eigen3_VERSION}"
          "-DBUILD_TYPE=${CMAKE_BUILD_TYPE}" "-DSANITIZE=${GAPFARM_SANITIZE}"
          -P ${PROJECT_SOURCE_DIR}/cmake/write_fingerprint.cmake
  BYPRODUCTS ${PROJECT_BINARY_DIR}/gapfarm_fingerprint.h
  COMMENT "Fingerprinting the sources")
