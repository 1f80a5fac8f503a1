# Where ROS is, the interpreter, pybind11, and the one folder that all Python modules of this project are installed to.

# A sourced ROS names its prefixes in this variable, which CMake itself does not read.
file(TO_CMAKE_PATH "$ENV{AMENT_PREFIX_PATH}" _ament_prefixes)
list(APPEND CMAKE_PREFIX_PATH ${_ament_prefixes})

find_package(Python3 REQUIRED COMPONENTS Interpreter Development.Module)

# ament computes the same folder, except where a distribution patches Python's default scheme. Setting it here keeps
# mauve_msgs, mauve_rt and mauve_examples side by side.
set(PYTHON_INSTALL_DIR "lib/python${Python3_VERSION_MAJOR}.${Python3_VERSION_MINOR}/site-packages")

if(NOT pybind11_DIR)
  execute_process(
    COMMAND "${Python3_EXECUTABLE}" -c "import pybind11; print(pybind11.get_cmake_dir())"
    OUTPUT_VARIABLE _pybind11_dir OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET RESULT_VARIABLE _result)
  if(_result EQUAL 0)
    set(pybind11_DIR "${_pybind11_dir}" CACHE PATH "")
  endif()
endif()
# After Python3: otherwise pybind11 looks for an interpreter of its own.
find_package(pybind11 2.11 REQUIRED)

# Stubs need a module that this interpreter can load, and packages of which Ubuntu 24.04 has none.
set(MAUVE_STUBS OFF)
if(NOT MAUVE_DEMO_ONLY AND NOT MAUVE_SANITIZE AND NOT CMAKE_CROSSCOMPILING)
  execute_process(
    COMMAND "${Python3_EXECUTABLE}" -c "import pybind11_stubgen" OUTPUT_QUIET ERROR_QUIET RESULT_VARIABLE _result)
  if(_result EQUAL 0)
    set(MAUVE_STUBS ON)
  else()
    message(STATUS "No type stubs of the compiled modules: ${Python3_EXECUTABLE} has no pybind11-stubgen")
  endif()
endif()

# mauve_add_python_module(<name> PACKAGE <package> SOURCES ... LIBRARIES ...): a pybind11 module inside a package, and
# its stub.
function(mauve_add_python_module name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "PACKAGE" "SOURCES;LIBRARIES")
  set(target ${arg_PACKAGE}_${name})
  pybind11_add_module(${target} MODULE ${arg_SOURCES})
  set_target_properties(${target} PROPERTIES
    OUTPUT_NAME ${name}
    INSTALL_RPATH "$ORIGIN/../../..")  # site-packages/<package> -> lib
  target_link_libraries(${target} PRIVATE ${arg_LIBRARIES} mauve_warnings mauve_sanitizers)
  install(TARGETS ${target} LIBRARY DESTINATION "${PYTHON_INSTALL_DIR}/${arg_PACKAGE}")
  if(MAUVE_STUBS)
    set(writer "${PROJECT_SOURCE_DIR}/scripts/write_stub.py")
    set(stub "${CMAKE_CURRENT_BINARY_DIR}/${name}.pyi")
    add_custom_command(OUTPUT "${stub}"
      COMMAND "${Python3_EXECUTABLE}" "${writer}" "$<TARGET_FILE:${target}>" ${arg_PACKAGE}.${name} "${stub}"
      DEPENDS ${target} "${writer}" VERBATIM COMMENT "Writing ${arg_PACKAGE}/${name}.pyi")
    add_custom_target(${target}_stub ALL DEPENDS "${stub}")
    install(FILES "${stub}" DESTINATION "${PYTHON_INSTALL_DIR}/${arg_PACKAGE}")
  endif()
endfunction()

# mauve_install_python_package(<package>): its Python sources, type information and data files.
function(mauve_install_python_package package)
  install(DIRECTORY "${PROJECT_SOURCE_DIR}/${package}/" DESTINATION "${PYTHON_INSTALL_DIR}/${package}"
    FILES_MATCHING
    PATTERN "*.py" PATTERN "py.typed" PATTERN "*.yaml" PATTERN "*.json" PATTERN "*.css" PATTERN "*.js" PATTERN "*.j2"
    PATTERN "*.xml"
    PATTERN "__pycache__" EXCLUDE
    PATTERN "kernel" EXCLUDE PATTERN "bindings" EXCLUDE PATTERN "bridge/src" EXCLUDE PATTERN "bridge/include" EXCLUDE PATTERN "sentinel" EXCLUDE PATTERN "trace/keeper" EXCLUDE
    PATTERN "maps" EXCLUDE PATTERN "architecture" EXCLUDE PATTERN "launch" EXCLUDE PATTERN "tests" EXCLUDE)
  mauve_link_installed("${PROJECT_SOURCE_DIR}/${package}" "${PYTHON_INSTALL_DIR}/${package}")
  # Compiled now: who runs it may have no right to write here, and would compile it at every start.
  install(CODE "execute_process(COMMAND \"${Python3_EXECUTABLE}\" -m compileall -q
    \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${PYTHON_INSTALL_DIR}/${package}\" COMMAND_ERROR_IS_FATAL ANY)")
endfunction()

# mauve_register_package(<name>): lets `ros2 run`, `ros2 pkg` and our own plug-in search find the package.
function(mauve_register_package name)
  file(WRITE "${CMAKE_CURRENT_BINARY_DIR}/ament_index/${name}" "")
  install(FILES "${CMAKE_CURRENT_BINARY_DIR}/ament_index/${name}"
    DESTINATION share/ament_index/resource_index/packages)
endfunction()

# mauve_install_program(<name> <module> <folder>): a program that calls <module>:main.
function(mauve_install_program name module folder)
  set(MAUVE_PROGRAM_MODULE ${module})
  configure_file("${PROJECT_SOURCE_DIR}/cmake/program.py.in" "${CMAKE_CURRENT_BINARY_DIR}/programs/${name}" @ONLY)
  install(PROGRAMS "${CMAKE_CURRENT_BINARY_DIR}/programs/${name}" DESTINATION ${folder})
endfunction()
