# Compiler settings that every target shares, and the one way to declare a library.

set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/bin)

# Asserts stay alive: they are cheap beside a physics step, and they guard our own mistakes.
# The sanitizers' presets bring flags of their own.
if(NOT GAPFARM_SANITIZE)
  set(CMAKE_CXX_FLAGS_RELEASE "-O2")
endif()
# Results are part of the interface (docs/determinism.md): no contraction, no reassociation.
add_compile_options(-ffp-contract=off)
# Finding what to warn of is a twentieth of a whole build; who only builds has no use for it.
if(GAPFARM_WARNINGS OR GAPFARM_WERROR)
  add_compile_options(-Wall -Wextra -Wshadow -Wnon-virtual-dtor -Wcast-align)
endif()
if(GAPFARM_WERROR)
  add_compile_options(-Werror)
endif()
if(GAPFARM_SANITIZE)
  add_compile_options(-fsanitize=${GAPFARM_SANITIZE} -fno-omit-frame-pointer)
  add_link_options(-fsanitize=${GAPFARM_SANITIZE})
endif()

# gcc throws away what it no longer needs whenever its heap has doubled, a twentieth of the time of
# a whole build; below these kilobytes it goes without.
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  add_compile_options(--param=ggc-min-heapsize=2000000)
endif()

# From the compiler's list of headers, where ccache would run the preprocessor over each source first.
find_program(CCACHE ccache)
if(CCACHE AND GAPFARM_CCACHE)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CMAKE_COMMAND} -E env CCACHE_DEPEND=1
      CCACHE_SLOPPINESS=pch_defines,time_macros ${CCACHE})
endif()

# gapfarm_linked(TARGET OUT): this project's libraries that TARGET links, itself too if it is one.
function(gapfarm_linked target out)
  set(found)
  set(open ${target})
  while(open)
    list(POP_FRONT open next)
    if(NOT TARGET ${next} OR NOT next MATCHES "^gapfarm" OR next IN_LIST found)
      continue()
    endif()
    list(APPEND found ${next})
    get_target_property(type ${next} TYPE)
    if(type STREQUAL "INTERFACE_LIBRARY")
      get_target_property(links ${next} INTERFACE_LINK_LIBRARIES)
    else()
      get_target_property(links ${next} LINK_LIBRARIES)
    endif()
    if(links)
      list(APPEND open ${links})
    endif()
  endwhile()
  set(${out} ${found} PARENT_SCOPE)
endfunction()

# gapfarm_shared_headers(NAME [HEADER...]): the standard library's headers, Eigen's and these, parsed
# once for all that share them.
function(gapfarm_shared_headers name)
  file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/headers.cc CONTENT "")
  add_library(${name} OBJECT ${PROJECT_BINARY_DIR}/headers.cc)
  target_link_libraries(${name} PRIVATE Eigen3::Eigen)
  target_compile_options(${name} PRIVATE -fpch-preprocess)  # for ccache
  target_precompile_headers(${name} PRIVATE
    <algorithm> <array> <chrono> <cmath> <cstdint> <filesystem> <fstream> <functional> <map>
    <memory> <optional> <set> <span> <sstream> <string> <string_view> <utility> <vector>
    <Eigen/Dense> ${ARGN})
endfunction()

# gapfarm_share(TARGET [FROM]): takes the headers of FROM, where GAPFARM_SHARE asks for it; of none
# the libraries' (cmake/Dependencies.cmake).  gcc keeps its options with them: one for each
# optimisation.
function(gapfarm_share name)
  if(GAPFARM_SHARE)
    get_target_property(options ${name} COMPILE_OPTIONS)
    if(ARGN)
      set(from ${ARGN})
    elseif("${options}" MATCHES "-O1")
      set(from gapfarm_headers_cold)
    else()
      set(from gapfarm_headers)
    endif()
    target_precompile_headers(${name} REUSE_FROM ${from})
    target_compile_options(${name} PRIVATE -fpch-preprocess)
  endif()
endfunction()

# gapfarm_join(TARGET PARTS [SOURCE...]): compiles the target's sources in so many parts, where
# GAPFARM_JOIN asks for it, and these each by itself.  Headers are read once a part, and what they
# are made into (CLI11's parser, Eigen's decompositions) is compiled once a part.
function(gapfarm_join name parts)
  if(GAPFARM_JOIN)
    get_target_property(sources ${name} SOURCES)
    list(LENGTH sources count)
    list(LENGTH ARGN separate)
    math(EXPR batch "(${count} - ${separate} + ${parts} - 1) / ${parts}")
    set_target_properties(${name} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE ${batch})
    set_source_files_properties(${ARGN} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
  endif()
endfunction()

# gapfarm_cold(TARGET): the target's own code never takes the time of a run, which is spent in
# simulations, scores and decompositions, all in other libraries.  -O1 compiles in three quarters of
# -O2's time.  No result depends on it: without -ffast-math and with contraction off, floating point
# has the same bits at all levels (tests/unit/golden holds -O0 against -O2).
function(gapfarm_cold name)
  if(NOT GAPFARM_SANITIZE)
    target_compile_options(${name} PRIVATE $<$<CONFIG:Release>:-O1>)
  endif()
endfunction()

# gapfarm_texts(HEADER kName=FILE...): build/FOLDER/HEADER with these files as strings.
function(gapfarm_texts header)
  file(RELATIVE_PATH folder ${PROJECT_SOURCE_DIR} ${CMAKE_CURRENT_SOURCE_DIR})
  set(text "#pragma once\n\nnamespace gapfarm {\n\n")
  foreach(entry IN LISTS ARGN)
    string(REGEX MATCH "^([^=]*)=(.*)$" entry ${entry})
    set(name ${CMAKE_MATCH_1})
    set(file ${CMAKE_MATCH_2})
    set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${file})
    file(READ ${file} content)
    string(APPEND text "inline constexpr char ${name}[] = R\"text(${content})text\";\n\n")
  endforeach()
  string(APPEND text "}  // namespace gapfarm\n")
  # Written only where it differs; what stands in the text is not replaced once more.
  file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/${folder}/${header} CONTENT "@text@" @ONLY)
endfunction()

# gapfarm_library(NAME [COLD] [PARTS n] SOURCES a.cc b.cc DEPS x y [SEPARATE c.cc...]): one library a
# folder, sources listed by hand; SEPARATE ones define names that others define too; PARTS, where one
# compilation would be too long.
function(gapfarm_library name)
  cmake_parse_arguments(ARG "COLD" "PARTS" "SOURCES;SEPARATE;DEPS" ${ARGN})
  if(NOT ARG_PARTS)
    set(ARG_PARTS 1)
  endif()
  if(ARG_SOURCES)
    add_library(${name} STATIC ${ARG_SOURCES} ${ARG_SEPARATE})
    target_include_directories(${name} PUBLIC ${PROJECT_SOURCE_DIR} ${PROJECT_BINARY_DIR})
    target_link_libraries(${name} PUBLIC ${ARG_DEPS})
    gapfarm_join(${name} ${ARG_PARTS} ${ARG_SEPARATE})
    if(ARG_COLD)
      gapfarm_cold(${name})
    endif()
    gapfarm_share(${name})
    set_target_properties(${name} PROPERTIES GAPFARM_SEPARATE "${ARG_SEPARATE}")
  else()
    add_library(${name} INTERFACE)
    target_include_directories(${name} INTERFACE ${PROJECT_SOURCE_DIR} ${PROJECT_BINARY_DIR})
    target_link_libraries(${name} INTERFACE ${ARG_DEPS})
  endif()
endfunction()
