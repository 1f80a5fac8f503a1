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

# Libraries and tests alike: an inline function is the same in both.
if(MAUVE_AUDITS OR MAUVE_SANITIZE)
  add_compile_definitions(MAUVE_AUDITS)
endif()

# GCC collects its garbage from 128 MB on, which is a twentieth of the time of a large unit, a tenth where it is sanitized.
# With 4 GB of memory for each processor it need not: a unit then takes 1.7 GB at most, instead of 1.2 GB.
cmake_host_system_information(RESULT _memory_mib QUERY TOTAL_PHYSICAL_MEMORY)
cmake_host_system_information(RESULT _processors QUERY NUMBER_OF_LOGICAL_CORES)
math(EXPR _needed_mib "4096 * ${_processors}")
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND _memory_mib GREATER_EQUAL _needed_mib)
  add_compile_options(--param=ggc-min-expand=1000 --param=ggc-min-heapsize=800000)
endif()

# mauve_write_units(<variable> <name> <batch> <sources>...): write units of at most <batch> sources; <variable> is their list.
# CMake's own UNITY_BUILD names sources by their absolute paths, which ccache finds in no other clone.
function(mauve_write_units variable name batch)
  set(folder "${CMAKE_CURRENT_BINARY_DIR}/${name}_units")
  set(units "")
  set(number 0)
  foreach(source IN LISTS ARGN)
    get_filename_component(source "${source}" ABSOLUTE)
    file(RELATIVE_PATH source "${PROJECT_SOURCE_DIR}" "${source}")
    file(RELATIVE_PATH path "${folder}" "${MAUVE_NAMED_SOURCES}/${source}")
    math(EXPR unit "${number} / ${batch}")
    set(unit "${folder}/unit_${unit}.cpp")
    string(APPEND text_of_${unit} "#include \"${path}\"\n")
    list(APPEND units "${unit}")
    math(EXPR number "${number} + 1")
  endforeach()
  list(REMOVE_DUPLICATES units)
  foreach(unit IN LISTS units)
    file(CONFIGURE OUTPUT "${unit}" CONTENT "// Written by CMake.\n${text_of_${unit}}" @ONLY)
  endforeach()
  set(${variable} "${units}" PARENT_SCOPE)
endfunction()

# mauve_compile_in_units(<target> <count> [ELSE_PRECOMPILED <header>] [ALONE <sources>...]): with MAUVE_UNITS, compile the
# target's sources but those ALONE as <count> units, since most of the time of each source goes into headers; else precompile
# <header> for all of them. A unit may take 1 GB of memory, which is why large targets have two.
function(mauve_compile_in_units target count)
  cmake_parse_arguments(PARSE_ARGV 2 arg "" "ELSE_PRECOMPILED" "ALONE")
  if(MAUVE_UNITS)
    get_target_property(sources ${target} SOURCES)
    list(REMOVE_ITEM sources ${arg_ALONE})
    list(LENGTH sources length)
    math(EXPR batch "(${length} + ${count} - 1) / ${count}")
    mauve_write_units(units ${target} ${batch} ${sources})
    set_target_properties(${target} PROPERTIES SOURCES "${units};${arg_ALONE}")
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

# mauve_add_programs(PATTERNS <globs>... LIBRARIES <targets>... [PRECOMPILED <header>] [TESTS [IN_UNITS] [ALONE <names>...]]):
# one executable per source, named as the file.
# PRECOMPILED: what all of them include is compiled once, which saves half the time they take.
# TESTS registers every GoogleTest case with ctest; cases are listed when ctest runs, not while building.
# IN_UNITS: with MAUVE_UNITS, the sources of a folder are one program, tests_<folder>, except those ALONE.
function(mauve_add_programs)
  cmake_parse_arguments(PARSE_ARGV 0 arg "TESTS;IN_UNITS" "PRECOMPILED" "PATTERNS;LIBRARIES;ALONE")
  list(TRANSFORM arg_PATTERNS PREPEND "${CMAKE_CURRENT_SOURCE_DIR}/")
  file(GLOB sources CONFIGURE_DEPENDS ${arg_PATTERNS})
  set(programs "")
  foreach(source IN LISTS sources)
    get_filename_component(name "${source}" NAME_WE)
    if(arg_IN_UNITS AND MAUVE_UNITS AND NOT name IN_LIST arg_ALONE)
      get_filename_component(folder "${source}" DIRECTORY)
      get_filename_component(folder "${folder}" NAME)
      set(name "tests_${folder}")
    endif()
    list(APPEND programs ${name})
    list(APPEND sources_of_${name} "${source}")
  endforeach()
  list(REMOVE_DUPLICATES programs)
  foreach(program IN LISTS programs)
    list(LENGTH sources_of_${program} length)
    if(length GREATER 1)
      mauve_write_units(sources_of_${program} ${program} 7 ${sources_of_${program}})
    endif()
    add_executable(${program} ${sources_of_${program}})
    target_link_libraries(${program} PRIVATE ${arg_LIBRARIES} mauve_warnings mauve_sanitizers)
    if(arg_TESTS)
      if(NOT MAUVE_SANITIZE)
        target_compile_options(${program} PRIVATE -Og -g1) # compiled in less than half the time of -O2 -g
      elseif(MAUVE_SANITIZE MATCHES "undefined")
        # A check at each access by a pointer costs a third of the time. Null and dead objects AddressSanitizer finds, too;
        # the libraries under test keep them all.
        target_compile_options(${program} PRIVATE -fno-sanitize=null,alignment,vptr,returns-nonnull-attribute,nonnull-attribute)
      endif()
      gtest_discover_tests(${program} DISCOVERY_MODE PRE_TEST TEST_PREFIX "${program}." PROPERTIES TIMEOUT 600)
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
