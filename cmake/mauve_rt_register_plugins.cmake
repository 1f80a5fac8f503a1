# mauve_rt_register_plugins(<index file> [PACKAGE <name>] [LIBRARIES <target>...])
#
# Installs what a package offers to executors: its list of plug-ins into the ament index, where executors and `mauve
# plugins` find it, and the shared libraries of the C++ ones into lib/.
#
#   <index file>   one line per class: kind; name; shell; library or module:Class
#   PACKAGE        whose plug-ins they are; ${PROJECT_NAME} by default
#   LIBRARIES      targets of shared libraries, each named in the list
function(mauve_rt_register_plugins index_file)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "PACKAGE" "LIBRARIES")
  if(NOT arg_PACKAGE)
    set(arg_PACKAGE ${PROJECT_NAME})
  endif()
  set(where "mauve_rt_register_plugins of ${arg_PACKAGE}")
  if(arg_UNPARSED_ARGUMENTS)
    message(FATAL_ERROR "${where}: expected <index file> [PACKAGE <name>] [LIBRARIES <target>...], "
      "found '${arg_UNPARSED_ARGUMENTS}' besides")
  endif()
  get_filename_component(index_file "${index_file}" ABSOLUTE)
  if(NOT EXISTS "${index_file}" OR IS_DIRECTORY "${index_file}")
    message(FATAL_ERROR "${where}: there is no file ${index_file}; "
      "write one with a line 'kind; name; shell; library or module:Class' per class")
  endif()

  file(READ "${index_file}" lines)
  foreach(target IN LISTS arg_LIBRARIES)
    if(NOT TARGET ${target})
      message(FATAL_ERROR "${where}: '${target}' is no target; add it with add_library(${target} SHARED ...) before")
    endif()
    get_target_property(type ${target} TYPE)
    if(NOT type MATCHES "^(SHARED|MODULE)_LIBRARY$")
      message(FATAL_ERROR "${where}: expected a shared library, found that '${target}' is of type ${type}; "
        "executors load plug-ins while they run: add_library(${target} SHARED ...)")
    endif()
    get_target_property(name ${target} OUTPUT_NAME)
    if(NOT name)
      set(name ${target})
    endif()
    if(NOT lines MATCHES ";[ \t]*${name}[ \t]*(#[^\n]*)?(\n|$)")
      message(FATAL_ERROR "${where}: no line of ${index_file} names the library '${name}'; "
        "add its classes, or leave it out of LIBRARIES")
    endif()
    get_target_property(rpath ${target} INSTALL_RPATH)
    if(NOT rpath)
      set_target_properties(${target} PROPERTIES INSTALL_RPATH "$ORIGIN") # finds the kernel beside it
    endif()
  endforeach()

  install(FILES "${index_file}"
    DESTINATION share/ament_index/resource_index/mauve_rt_plugins RENAME ${arg_PACKAGE})
  if(arg_LIBRARIES)
    install(TARGETS ${arg_LIBRARIES} LIBRARY DESTINATION lib)
  endif()
endfunction()
