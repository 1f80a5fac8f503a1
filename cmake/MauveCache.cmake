# ccache, where it is installed and no other launcher was asked for: what was compiled once on this machine, in whatever
# clone, workspace or pip's build, is not compiled again.

option(MAUVE_CCACHE "Compile by ccache where it is installed" ON)
find_program(MAUVE_CCACHE_PROGRAM ccache)
mark_as_advanced(MAUVE_CCACHE_PROGRAM)

set(MAUVE_NAMED_SOURCES "${PROJECT_SOURCE_DIR}") # the folder by which units name their sources
if(MAUVE_CCACHE AND MAUVE_CCACHE_PROGRAM AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  # ccache compares names of files, too. Links in the build folder give the sources and ROS the same names everywhere.
  set(_links "${PROJECT_BINARY_DIR}/CMakeFiles")
  file(CREATE_LINK "${PROJECT_SOURCE_DIR}" "${_links}/sources" SYMBOLIC)
  set(MAUVE_NAMED_SOURCES "${_links}/sources")
  find_path(_ros share/ament_cmake PATHS ENV AMENT_PREFIX_PATH NO_DEFAULT_PATH NO_CACHE)
  if(_ros)
    string(REGEX REPLACE "/$" "" _ros "${_ros}")
    file(CREATE_LINK "${_ros}" "${_links}/ros" SYMBOLIC)
  endif()
  set(_options "")
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU") # GCC names a header of ROS by its real path where that is the shorter one
    set(_options -fno-canonical-system-headers)
  endif()
  set(_launcher "${_links}/mauve_ccache")
  configure_file("${PROJECT_SOURCE_DIR}/cmake/mauve_ccache.in" "${_launcher}" @ONLY
    FILE_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
  set(CMAKE_C_COMPILER_LAUNCHER "${_launcher}")
  set(CMAKE_CXX_COMPILER_LAUNCHER "${_launcher}")
endif()
