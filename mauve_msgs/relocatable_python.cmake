# The generated target names the headers of Python and numpy by path: only the build needs them, and what is installed
# may go to another place or machine.
set(generator_py ${PROJECT_NAME}__rosidl_generator_py)
if(TARGET ${generator_py})
  get_target_property(folders ${generator_py} INTERFACE_INCLUDE_DIRECTORIES)
  set(exportable "")
  foreach(folder IN LISTS folders)
    if(IS_ABSOLUTE "${folder}")
      set(folder "$<BUILD_INTERFACE:${folder}>")
    endif()
    list(APPEND exportable "${folder}")
  endforeach()
  set_target_properties(${generator_py} PROPERTIES INTERFACE_INCLUDE_DIRECTORIES "${exportable}")
endif()
