# What every C++ target of the project shares: language, warnings, sanitizers, run-time paths.

set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)

# For our own sources, never for generated ones.
add_library(mauve_warnings INTERFACE)
target_compile_options(mauve_warnings INTERFACE -Wall -Wextra -Wpedantic -Wconversion -Werror)

add_library(mauve_sanitizers INTERFACE)
if(MAUVE_SANITIZE)
  # What is sanitized is compiled once, run once and never measured: little optimisation, line numbers only.
  set(_level -O0)
  if(MAUVE_SANITIZE STREQUAL "thread")
    set(_level -O1)
  endif()
  target_compile_options(mauve_sanitizers INTERFACE
    ${_level} -g1 -fsanitize=${MAUVE_SANITIZE} -fno-sanitize-recover=all -fno-omit-frame-pointer)
  target_link_options(mauve_sanitizers INTERFACE -fsanitize=${MAUVE_SANITIZE})
endif()

# mauve_compile_in_units(<target> <count> [ELSE_PRECOMPILED <header>]): with MAUVE_UNITS, compile the target's sources as
# <count> units, since most of the time of each source goes into headers; else precompile <header> for all of them.
# A unit may take 1 GB of memory, which is why large targets have two.
function(mauve_compile_in_units target count)
  cmake_parse_arguments(PARSE_ARGV 2 arg "" "ELSE_PRECOMPILED" "")
  if(MAUVE_UNITS)
    get_target_property(sources ${target} SOURCES)
    list(LENGTH sources length)
    math(EXPR batch "(${length} + ${count} - 1) / ${count}")
    set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE ${batch})
  elseif(arg_ELSE_PRECOMPILED)
    target_precompile_headers(${target} PRIVATE "${arg_ELSE_PRECOMPILED}")
  endif()
endfunction()

# Parts are written one after the other: what is not there yet is left out.
macro(mauve_add_part folder)
  if(EXISTS "${CMAKE_CURRENT_SOURCE_DIR}/${folder}/CMakeLists.txt")
    add_subdirectory("${folder}")
  endif()
endmacro()

# mauve_add_programs(PATTERN <glob> LIBRARIES <targets>... [PRECOMPILED <header>] [TESTS [IN_UNITS] [ALONE <names>...]]):
# one executable per source, named as the file.
# PRECOMPILED: what all of them include is compiled once, which saves half the time they take.
# TESTS registers every GoogleTest case with ctest; cases are listed when ctest runs, not while building.
# IN_UNITS: with MAUVE_UNITS, the sources of a folder are one program, tests_<folder>, except those ALONE.
function(mauve_add_programs)
  cmake_parse_arguments(PARSE_ARGV 0 arg "TESTS;IN_UNITS" "PATTERN;PRECOMPILED" "LIBRARIES;ALONE")
  file(GLOB sources CONFIGURE_DEPENDS "${CMAKE_CURRENT_SOURCE_DIR}/${arg_PATTERN}")
  set(programs "")
  foreach(source IN LISTS sources)
    get_filename_component(name "${source}" NAME_WE)
    if(arg_IN_UNITS AND MAUVE_UNITS AND NOT name IN_LIST arg_ALONE)
      get_filename_component(folder "${source}" DIRECTORY)
      get_filename_component(folder "${folder}" NAME)
      set(name "tests_${folder}")
    endif()
    if(TARGET ${name})
      target_sources(${name} PRIVATE "${source}")
      set_target_properties(${name} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 7)
      continue()
    endif()
    list(APPEND programs ${name})
    add_executable(${name} "${source}")
    target_link_libraries(${name} PRIVATE ${arg_LIBRARIES} mauve_warnings mauve_sanitizers)
    if(arg_TESTS)
      if(NOT MAUVE_SANITIZE)
        target_compile_options(${name} PRIVATE -O1 -g1) # compiled in little more than half the time of -O2 -g
      endif()
      gtest_discover_tests(${name} DISCOVERY_MODE PRE_TEST TEST_PREFIX "${name}." PROPERTIES TIMEOUT 600)
    endif()
  endforeach()
  if(arg_PRECOMPILED)
    list(POP_FRONT programs first)
    target_precompile_headers(${first} PRIVATE "${arg_PRECOMPILED}")
    foreach(program IN LISTS programs)
      target_precompile_headers(${program} REUSE_FROM ${first})
    endforeach()
  endif()
endfunction()

# mauve_add_target_without_tests(): the target `without_tests`, what `all` builds so far but for folders named tests.
function(mauve_add_target_without_tests)
  add_custom_target(without_tests)
  set(folders "${PROJECT_SOURCE_DIR}")
  while(folders)
    list(POP_FRONT folders folder)
    file(RELATIVE_PATH relative "${PROJECT_SOURCE_DIR}" "${folder}")
    if(relative MATCHES "(^|/)tests$")
      continue()
    endif()
    get_property(targets DIRECTORY "${folder}" PROPERTY BUILDSYSTEM_TARGETS)
    foreach(target IN LISTS targets)
      get_target_property(excluded ${target} EXCLUDE_FROM_ALL)
      if(NOT excluded AND NOT target STREQUAL "without_tests")
        add_dependencies(without_tests ${target})
      endif()
    endforeach()
    get_property(inner DIRECTORY "${folder}" PROPERTY SUBDIRECTORIES)
    list(APPEND folders ${inner})
  endwhile()
endfunction()
