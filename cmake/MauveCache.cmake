# ccache, where it is installed and no other launcher was asked for: what was compiled once on this machine, in whatever
# clone, workspace or pip's build, is not compiled again.

option(MAUVE_CCACHE "Compile by ccache where it is installed" ON)
find_program(MAUVE_CCACHE_PROGRAM ccache)
mark_as_advanced(MAUVE_CCACHE_PROGRAM)

if(MAUVE_CCACHE AND MAUVE_CCACHE_PROGRAM AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  # Below the folder that holds the sources and the build, paths count relative to the build: so clones share.
  set(_base "${PROJECT_SOURCE_DIR}")
  cmake_path(IS_PREFIX _base "${PROJECT_BINARY_DIR}" _found)
  while(NOT _found)
    cmake_path(GET _base PARENT_PATH _base)
    cmake_path(IS_PREFIX _base "${PROJECT_BINARY_DIR}" _found)
  endwhile()
  if(_base STREQUAL "/") # the system's headers would count, too
    set(_base "${PROJECT_SOURCE_DIR}")
  endif()
  # The settings stand in the command, so that ninja started by hand finds the same results.
  set(_launcher "${CMAKE_COMMAND}" -E env "CCACHE_BASEDIR=${_base}" CCACHE_NOHASHDIR=1
    CCACHE_SLOPPINESS=pch_defines,time_macros "${MAUVE_CCACHE_PROGRAM}")
  set(CMAKE_C_COMPILER_LAUNCHER ${_launcher})
  set(CMAKE_CXX_COMPILER_LAUNCHER ${_launcher})
endif()
