# mauve_rt_register_plugins([<index file>] [PACKAGE <name>] [LIBRARIES <target>...])
#
# Installs what a package offers to executors: its list of plug-ins into the ament index, where executors and `mauve
# plugins` find it, and the shared libraries of the C++ ones into lib/.
#
#   <index file>   one line per class: kind; name; shell; library or module:Class. Needed for classes in Python.
#   PACKAGE        whose plug-ins they are; ${PROJECT_NAME} by default
#   LIBRARIES      targets of shared libraries. Of one that no line of the file names, the build lists what it registers.
function(mauve_rt_register_plugins)
  cmake_parse_arguments(PARSE_ARGV 0 arg "" "PACKAGE" "LIBRARIES")
  if(NOT arg_PACKAGE)
    set(arg_PACKAGE ${PROJECT_NAME})
  endif()
  set(where "mauve_rt_register_plugins of ${arg_PACKAGE}")
  list(LENGTH arg_UNPARSED_ARGUMENTS others)
  if(others GREATER 1 OR (others EQUAL 0 AND NOT arg_LIBRARIES))
    message(FATAL_ERROR "${where}: expected [<index file>] [PACKAGE <name>] [LIBRARIES <target>...], "
      "found '${arg_UNPARSED_ARGUMENTS}'")
  endif()
  set(index_file "")
  set(lines "")
  if(arg_UNPARSED_ARGUMENTS)
    get_filename_component(index_file "${arg_UNPARSED_ARGUMENTS}" ABSOLUTE)
    if(NOT EXISTS "${index_file}" OR IS_DIRECTORY "${index_file}")
      message(FATAL_ERROR "${where}: there is no file ${index_file}; "
        "write one with a line 'kind; name; shell; library or module:Class' per class, or leave it out")
    endif()
    set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS "${index_file}")
    file(READ "${index_file}" lines)
  endif()

  set(unlisted "")
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
      list(APPEND unlisted ${name} "$<TARGET_FILE:${target}>")
    endif()
    get_target_property(rpath ${target} INSTALL_RPATH)
    if(NOT rpath)
      set_target_properties(${target} PROPERTIES INSTALL_RPATH "$ORIGIN") # finds the kernel beside it
    endif()
  endforeach()

  if(unlisted)
    _mauve_rt_list_plugins("${where}" "${arg_PACKAGE}" "${index_file}" "${unlisted}" "${arg_LIBRARIES}" index_file)
  endif()
  install(FILES "${index_file}"
    DESTINATION share/ament_index/resource_index/mauve_rt_plugins RENAME ${arg_PACKAGE})
  if(arg_LIBRARIES)
    install(TARGETS ${arg_LIBRARIES} LIBRARY DESTINATION lib)
  endif()
endfunction()

# The build writes the index: a program of its own loads the libraries. It is compiled with the package's options, so that
# a sanitizer is in it, too.
function(_mauve_rt_list_plugins where package index_file unlisted libraries result)
  if(CMAKE_CROSSCOMPILING AND NOT CMAKE_CROSSCOMPILING_EMULATOR)
    message(FATAL_ERROR "${where}: the libraries cannot be loaded while cross-compiling; write an index file that names them")
  endif()
  set(folder "${CMAKE_CURRENT_BINARY_DIR}/mauve_rt_plugins")
  set(program ${package}_mauve_rt_plugins)
  string(CONCAT source "#include <mauve_rt/architecture/plugin_index.hpp>\n\n"
    "int main(int count, char** words) { return mauve::write_plugin_index(count, words); }\n")
  file(CONFIGURE OUTPUT "${folder}/${package}.cpp" CONTENT "${source}" @ONLY)
  add_executable(${program} "${folder}/${package}.cpp")
  target_link_libraries(${program} PRIVATE mauve_rt::kernel)
  set(words "${folder}/${package}.txt")
  if(index_file)
    list(APPEND words --with "${index_file}")
  endif()
  add_custom_command(OUTPUT "${folder}/${package}.txt"
    COMMAND ${program} ${words} ${unlisted}
    DEPENDS ${program} ${libraries} ${index_file}
    COMMENT "Listing the plug-ins of ${package}" VERBATIM)
  add_custom_target(${program}_index ALL DEPENDS "${folder}/${package}.txt")
  set(${result} "${folder}/${package}.txt" PARENT_SCOPE)
endfunction()
