# mauve_generate_types(<target> <interfaces>...)
#
# Writes C++ structs for ROS messages, services and actions, and adds the interface library <target>, which has them.
#
#   <interfaces>   PACKAGE/msg/NAME, PACKAGE/srv/NAME, PACKAGE/action/NAME, or PACKAGE for all it has: of installed packages, or of
#                  a project of this build after its rosidl_generate_interfaces(). Nested messages come with them.
#
# `#include <mauve_types/sensor_msgs/msg/imu.hpp>` then has the struct mauve::msg::sensor_msgs::Imu.
function(mauve_generate_types target)
  if(NOT ARGN)
    message(FATAL_ERROR "mauve_generate_types(${target}): expected interfaces such as sensor_msgs/msg/Imu, found none")
  endif()
  find_package(Python3 REQUIRED COMPONENTS Interpreter)
  set(program "${CMAKE_CURRENT_FUNCTION_LIST_DIR}/mauve_generate_types.py")
  set(folder "${CMAKE_CURRENT_BINARY_DIR}/mauve_types/include")
  _mauve_python_path(python_path)
  file(TO_CMAKE_PATH "$ENV{AMENT_PREFIX_PATH}" prefixes)
  list(TRANSFORM ARGN REPLACE "/.*" "" OUTPUT_VARIABLE packages)
  list(REMOVE_DUPLICATES packages)
  set(of_this_build "")
  foreach(package IN LISTS packages)
    if(DEFINED ${package}_BINARY_DIR) # as project() sets it
      list(APPEND of_this_build
        --package ${package} "${${package}_BINARY_DIR}/rosidl_adapter/${package}" "${${package}_SOURCE_DIR}")
    endif()
  endforeach()
  execute_process(
    COMMAND "${CMAKE_COMMAND}" -E env "PYTHONPATH=${python_path}" PYTHONDONTWRITEBYTECODE=1
            "${Python3_EXECUTABLE}" "${program}" --target ${target} --output "${folder}"
            --prefixes ${prefixes} ${CMAKE_PREFIX_PATH}
            ${of_this_build} --interfaces ${ARGN}
    OUTPUT_VARIABLE read ERROR_VARIABLE error RESULT_VARIABLE result OUTPUT_STRIP_TRAILING_WHITESPACE)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "mauve_generate_types(${target}): ${error}")
  endif()
  string(REPLACE "\n" ";" read "${read}")
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${read} "${program}")
  add_library(${target} INTERFACE)
  target_include_directories(${target} INTERFACE "$<BUILD_INTERFACE:${folder}>")
  target_link_libraries(${target} INTERFACE mauve_rt::kernel)
endfunction()

# Where the package mauve_rt is in Python: beside these files in its sources, else in the prefix that they are installed to.
function(_mauve_python_path result)
  get_filename_component(sources "${CMAKE_CURRENT_FUNCTION_LIST_DIR}" DIRECTORY)
  if(EXISTS "${sources}/mauve_rt/modelling/__main__.py")
    set(found "${sources}")
  else()
    get_filename_component(prefix "${sources}" DIRECTORY)
    get_filename_component(prefix "${prefix}" DIRECTORY)
    file(GLOB found "${prefix}/lib/python3*/site-packages/mauve_rt" "${prefix}/lib/python3/dist-packages/mauve_rt"
      "${prefix}/local/lib/python3*/dist-packages/mauve_rt")
    list(TRANSFORM found REPLACE "/mauve_rt$" "")
  endif()
  string(REPLACE ";" ":" found "${found};$ENV{PYTHONPATH}")
  set(${result} "${found}" PARENT_SCOPE)
endfunction()
