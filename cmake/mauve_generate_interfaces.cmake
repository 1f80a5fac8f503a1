# mauve_generate_interfaces(HEADERS <file>... STRUCTS <struct>... [INTERFACES <file>...] [LIBRARIES <target>...]
#                           [DEPENDENCIES <package>...])
#
# Makes ROS messages of this package out of C++ structs, and generates their code by rosidl_generate_interfaces().
#
#   HEADERS       files with the structs; they find what is in include/, and what mauve_generate_types() has written
#   STRUCTS       structs with MAUVE_TYPE of the name ${PROJECT_NAME}/msg/NAME; structs of this package within them come along
#   INTERFACES    .msg, .srv and .action files of this package, as rosidl_generate_interfaces() takes them
#   LIBRARIES     imported targets whose headers the headers include
#   DEPENDENCIES  packages that INTERFACES use; the packages of messages within structs come by themselves
#
# A macro, as rosidl_generate_interfaces() leaves variables for ament_package().
macro(mauve_generate_interfaces)
  _mauve_write_messages(${ARGN})
  find_package(rosidl_default_generators REQUIRED)
  foreach(_mauve_package IN LISTS _mauve_packages)
    find_package(${_mauve_package} QUIET)
  endforeach()
  foreach(_mauve_message IN LISTS _mauve_messages)
    string(REGEX MATCH "^([^/]+)/(.+)$" _ "${_mauve_message}")
    if(NOT "${CMAKE_MATCH_2}.idl" IN_LIST ${CMAKE_MATCH_1}_IDL_FILES)
      message(FATAL_ERROR "mauve_generate_interfaces: a struct has a field of ${_mauve_message}, found no installed "
        "package ${CMAKE_MATCH_1} with this message. Install the package, and name it in package.xml.")
    endif()
  endforeach()
  # The target has no bare name of the package: a library may have it.
  rosidl_generate_interfaces(${PROJECT_NAME}_interfaces ${_mauve_interfaces}
    LIBRARY_NAME ${PROJECT_NAME} DEPENDENCIES ${_mauve_packages})
endmacro()

# Writes the .msg files by a program that is compiled with the headers, unless all that they are made of is as it was. Gives
# _mauve_interfaces as rosidl takes them, and of other packages _mauve_messages and _mauve_packages.
function(_mauve_write_messages)
  cmake_parse_arguments(PARSE_ARGV 0 arg "" "" "HEADERS;STRUCTS;INTERFACES;LIBRARIES;DEPENDENCIES")
  set(where "mauve_generate_interfaces")
  if(arg_UNPARSED_ARGUMENTS OR NOT arg_HEADERS OR NOT arg_STRUCTS)
    message(FATAL_ERROR "${where}: expected HEADERS <file>... STRUCTS <struct>..., found '${ARGN}'")
  endif()
  if(NOT CMAKE_C_COMPILER_LOADED)
    message(FATAL_ERROR "${where}: expected the languages C and CXX, found no C, in which rosidl generates code. "
      "Write project(${PROJECT_NAME} LANGUAGES C CXX).")
  endif()

  set(includes "")
  foreach(header IN LISTS arg_HEADERS)
    get_filename_component(header "${header}" ABSOLUTE)
    if(NOT EXISTS "${header}")
      message(FATAL_ERROR "${where}: there is no header ${header}. Correct HEADERS.")
    endif()
    string(APPEND includes "#include \"${header}\"\n")
  endforeach()
  set(adds "")
  foreach(struct IN LISTS arg_STRUCTS)
    string(APPEND adds "    add<${struct}>(\"${struct}\", files);\n")
  endforeach()
  set(folder "${CMAKE_CURRENT_BINARY_DIR}/mauve_interfaces")
  set(program "${folder}/program.cpp")
  configure_file("${CMAKE_CURRENT_FUNCTION_LIST_DIR}/mauve_generate_interfaces.cpp.in" "${program}" @ONLY)

  _mauve_digest(digest "${CMAKE_CXX_COMPILER} ${CMAKE_CXX_FLAGS} ${arg_LIBRARIES}" "${program}" ${_MAUVE_MESSAGES_READ})
  if(NOT digest STREQUAL "${_MAUVE_MESSAGES_DIGEST}")
    message(STATUS "Making messages of ${arg_STRUCTS}")
    try_run(ran compiled "${folder}/program" "${program}"
      CMAKE_FLAGS "-DINCLUDE_DIRECTORIES=${CMAKE_CURRENT_SOURCE_DIR}/include;${CMAKE_CURRENT_BINARY_DIR}/mauve_types/include"
      COMPILE_DEFINITIONS -H # prints which files are included
      LINK_LIBRARIES mauve_rt::kernel ${arg_LIBRARIES}
      COMPILE_OUTPUT_VARIABLE output RUN_OUTPUT_VARIABLE printed ARGS "${folder}")
    string(REGEX MATCHALL "\n[.]+ [^\n;]+" read "\n${output}")
    if(NOT compiled)
      string(REGEX REPLACE "\n([.]+ |Multiple include guards)[^\n]*" "" output "\n${output}")
      message(FATAL_ERROR "${where}: the headers do not compile with ${arg_STRUCTS}. Correct what the compiler names; each "
        "struct, also one within another, needs MAUVE_TYPE.\n${output}")
    endif()
    string(STRIP "${printed}" printed)
    if(NOT ran EQUAL 0)
      message(FATAL_ERROR "${where}: ${printed}")
    endif()
    list(TRANSFORM read REPLACE "\n[.]+ " "")
    list(FILTER read EXCLUDE REGEX "^/usr/(include|lib)/")
    list(REMOVE_DUPLICATES read)
    string(REPLACE "\n" ";" printed "${printed}")
    _mauve_digest(digest "${CMAKE_CXX_COMPILER} ${CMAKE_CXX_FLAGS} ${arg_LIBRARIES}" "${program}" ${read})
    set(_MAUVE_MESSAGES_READ "${read}" CACHE INTERNAL "Headers of which messages were made")
    set(_MAUVE_MESSAGES "${printed}" CACHE INTERNAL "Messages that were made, and those that they use")
    set(_MAUVE_MESSAGES_DIGEST ${digest} CACHE INTERNAL "Of all that they were made of")
  endif()
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${_MAUVE_MESSAGES_READ})

  set(own ${_MAUVE_MESSAGES})
  list(FILTER own INCLUDE REGEX "^${PROJECT_NAME}/")
  list(TRANSFORM own REPLACE "^[^/]+/(.+)$" "\\1.msg")
  foreach(name IN LISTS own)
    if(name IN_LIST arg_INTERFACES)
      message(FATAL_ERROR "${where}: found ${name} as a file and as a struct. Remove one, of INTERFACES or of STRUCTS.")
    endif()
  endforeach()
  list(TRANSFORM own PREPEND "${folder}:")
  set(_mauve_interfaces ${own} ${arg_INTERFACES} PARENT_SCOPE)
  set(others ${_MAUVE_MESSAGES})
  list(FILTER others EXCLUDE REGEX "^${PROJECT_NAME}/")
  set(_mauve_messages ${others} PARENT_SCOPE)
  list(TRANSFORM others REPLACE "/.*" "")
  list(APPEND others ${arg_DEPENDENCIES})
  list(REMOVE_DUPLICATES others)
  set(_mauve_packages ${others} PARENT_SCOPE)
endfunction()

# Of words and of files' contents.
function(_mauve_digest variable words)
  foreach(file IN LISTS ARGN)
    set(sum "no file")
    if(EXISTS "${file}")
      file(SHA256 "${file}" sum)
    endif()
    string(APPEND words " ${sum}")
  endforeach()
  string(SHA256 sum "${words}")
  set(${variable} ${sum} PARENT_SCOPE)
endfunction()
