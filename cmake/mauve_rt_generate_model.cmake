# mauve_rt_generate_model(<target>|PYTHON [<model file>] [PACKAGE <name>] [INTERFACES <file>...] [DEPENDENCIES <package>...])
#
# Generates shells, abstract cores, fsms and their registration from the package's model, at first when CMake runs, and again
# when the model has changed.
#
#   <target>      a shared library with the implementations in C++: it gets the generated source, headers and types
#   PYTHON        all in Python: installs ${PROJECT_NAME}_parts/ with the generated module `model`, and its list of plug-ins
#   <model file>  model.yaml by default; it is installed to share/${PROJECT_NAME}
#   PACKAGE       whose parts they are; ${PROJECT_NAME} by default
#   INTERFACES    .msg, .srv and .action files of this package besides the model's types
#   DEPENDENCIES  packages that INTERFACES use
#
# Parts of another package's model, named as package/Name, are searched for where that package is installed: in
# CMAKE_PREFIX_PATH and AMENT_PREFIX_PATH. The generated headers are installed to include/, for the packages that use this one.
#
# A macro, as rosidl_generate_interfaces() leaves variables for ament_package().
macro(mauve_rt_generate_model _mauve_target)
  _mauve_write_model(${_mauve_target} ${ARGN})
  if(_mauve_interfaces)
    find_package(rosidl_default_generators REQUIRED)
    foreach(_mauve_package IN LISTS _mauve_packages)
      find_package(${_mauve_package} REQUIRED)
    endforeach()
    # The target has no bare name of the package: a library may have it.
    rosidl_generate_interfaces(${PROJECT_NAME}_interfaces ${_mauve_interfaces}
      LIBRARY_NAME ${PROJECT_NAME} DEPENDENCIES ${_mauve_packages})
  endif()
  if("${_mauve_target}" STREQUAL "PYTHON")
    _mauve_install_python_model()
  else()
    _mauve_compile_model(${_mauve_target})
  endif()
  install(FILES "${_mauve_model}" DESTINATION share/${_mauve_model_package} RENAME model.yaml)
endmacro()

# Writes the files. Gives _mauve_model and _mauve_generated (the model, the folder), _mauve_interfaces and _mauve_packages as
# rosidl takes them, and _mauve_types as mauve_generate_types() does.
function(_mauve_write_model target)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "PACKAGE" "INTERFACES;DEPENDENCIES")
  if(NOT arg_PACKAGE)
    set(arg_PACKAGE ${PROJECT_NAME})
  endif()
  set(where "mauve_rt_generate_model(${target})")
  list(LENGTH arg_UNPARSED_ARGUMENTS others)
  if(others GREATER 1)
    message(FATAL_ERROR "${where}: expected one model file, found '${arg_UNPARSED_ARGUMENTS}'")
  endif()
  if(NOT target STREQUAL "PYTHON" AND NOT TARGET ${target})
    message(FATAL_ERROR "${where}: '${target}' is no target; add it with add_library(${target} SHARED ...) before")
  endif()
  set(model model.yaml)
  if(arg_UNPARSED_ARGUMENTS)
    set(model "${arg_UNPARSED_ARGUMENTS}")
  endif()
  get_filename_component(model "${model}" ABSOLUTE)
  if(NOT EXISTS "${model}")
    message(FATAL_ERROR "${where}: there is no file ${model}")
  endif()

  find_package(Python3 REQUIRED COMPONENTS Interpreter)
  _mauve_python_path(python_path)
  set(folder "${CMAKE_CURRENT_BINARY_DIR}/mauve_model")
  file(TO_CMAKE_PATH "$ENV{AMENT_PREFIX_PATH}" prefixes)
  set(words "${model}" --package ${arg_PACKAGE} --output "${folder}" --prefixes ${CMAKE_PREFIX_PATH} ${prefixes})
  if(target STREQUAL "PYTHON")
    list(APPEND words --python)
  endif()
  execute_process(
    COMMAND "${CMAKE_COMMAND}" -E env "PYTHONPATH=${python_path}" PYTHONDONTWRITEBYTECODE=1
            "${Python3_EXECUTABLE}" -m mauve_rt.modelling ${words}
    OUTPUT_VARIABLE printed ERROR_VARIABLE error RESULT_VARIABLE result OUTPUT_STRIP_TRAILING_WHITESPACE)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "${where}:\n${error}")
  elseif(error)
    message(WARNING "${where}:\n${error}")
  endif()
  string(REPLACE "\n" ";" printed "${printed}")
  foreach(kind reads message interface uses)
    set(${kind} ${printed})
    list(FILTER ${kind} INCLUDE REGEX "^${kind} ")
    list(TRANSFORM ${kind} REPLACE "^${kind} " "")
  endforeach()
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${reads})

  set(packages ${interface})
  list(TRANSFORM packages REPLACE "/.*" "")
  list(APPEND packages ${arg_DEPENDENCIES})
  list(REMOVE_DUPLICATES packages)
  if(message AND NOT CMAKE_C_COMPILER_LOADED)
    message(FATAL_ERROR "${where}: expected the languages C and CXX, found no C, in which rosidl generates code. "
      "Write project(${PROJECT_NAME} LANGUAGES C CXX).")
  endif()
  set(types ${interface})
  if(message)
    list(APPEND types ${PROJECT_NAME})
  endif()
  list(TRANSFORM message REPLACE "^(.+)$" "${folder}:msg/\\1.msg")
  set(_mauve_used_prefixes ${uses} PARENT_SCOPE)
  set(_mauve_model "${model}" PARENT_SCOPE)
  set(_mauve_model_package ${arg_PACKAGE} PARENT_SCOPE)
  set(_mauve_generated "${folder}" PARENT_SCOPE)
  set(_mauve_python_path "${python_path}" PARENT_SCOPE)
  set(_mauve_interfaces ${message} ${arg_INTERFACES} PARENT_SCOPE)
  set(_mauve_packages ${packages} PARENT_SCOPE)
  set(_mauve_types ${types} PARENT_SCOPE)
endfunction()

function(_mauve_compile_model target)
  target_sources(${target} PRIVATE "${_mauve_generated}/src/plugins.cpp")
  set(used ${_mauve_used_prefixes})
  list(TRANSFORM used APPEND "/include")
  target_include_directories(${target} SYSTEM PUBLIC "$<BUILD_INTERFACE:${used}>")
  target_include_directories(${target}
    PUBLIC "$<BUILD_INTERFACE:${_mauve_generated}/include>"
    PRIVATE "${CMAKE_CURRENT_SOURCE_DIR}/src" "${CMAKE_CURRENT_SOURCE_DIR}/include")
  target_link_libraries(${target} PUBLIC mauve_rt::kernel)
  if(_mauve_types)
    mauve_generate_types(${target}_types ${_mauve_types})
    target_link_libraries(${target} PUBLIC ${target}_types)
  endif()
  install(DIRECTORY "${_mauve_generated}/include/" DESTINATION include)
endfunction()

# The build imports the implementations, so that a method which is missing, or which the model no longer has, ends it.
function(_mauve_install_python_model)
  set(package ${_mauve_model_package}_parts)
  set(sources "${CMAKE_CURRENT_SOURCE_DIR}/${package}")
  file(GLOB_RECURSE modules CONFIGURE_DEPENDS "${sources}/*.py")
  set(used ${_mauve_used_prefixes})
  list(TRANSFORM used APPEND "/lib/python3*/site-packages")
  file(GLOB used ${used})
  set(stamp "${_mauve_generated}/checked")
  add_custom_command(OUTPUT "${stamp}"
    COMMAND "${CMAKE_COMMAND}" -E env "PYTHONPATH=${_mauve_python_path}" PYTHONDONTWRITEBYTECODE=1
            "${Python3_EXECUTABLE}" -m mauve_rt.modelling.implementations "${_mauve_generated}/plugins.txt"
            "${CMAKE_CURRENT_SOURCE_DIR}" "${_mauve_generated}/python" ${used}
    COMMAND "${CMAKE_COMMAND}" -E touch "${stamp}"
    DEPENDS ${modules} "${_mauve_generated}/python/${package}/model.py" "${_mauve_generated}/plugins.txt"
    COMMENT "Checking the implementations of ${_mauve_model_package}" VERBATIM)
  add_custom_target(${_mauve_model_package}_mauve_model ALL DEPENDS "${stamp}")
  find_package(Python3 REQUIRED COMPONENTS Interpreter)
  install(DIRECTORY "${sources}" "${_mauve_generated}/python/${package}"
    DESTINATION "lib/python${Python3_VERSION_MAJOR}.${Python3_VERSION_MINOR}/site-packages"
    FILES_MATCHING PATTERN "*.py")
  mauve_rt_register_plugins("${_mauve_generated}/plugins.txt" PACKAGE ${_mauve_model_package})
endfunction()
