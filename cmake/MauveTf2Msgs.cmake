# tf2_msgs, where no other prefix has it: the messages of /tf and /tf_static, to which a transform_tree is bound.
file(TO_CMAKE_PATH "$ENV{AMENT_PREFIX_PATH}" _prefixes)
list(APPEND _prefixes ${CMAKE_PREFIX_PATH})
list(REMOVE_ITEM _prefixes "${CMAKE_INSTALL_PREFIX}") # which has it from the last build
set(_has_tf2_msgs FALSE)
foreach(_prefix IN LISTS _prefixes)
  if(EXISTS "${_prefix}/share/ament_index/resource_index/rosidl_interfaces/tf2_msgs")
    set(_has_tf2_msgs TRUE)
  endif()
endforeach()
if(NOT _has_tf2_msgs)
  mauve_add_part(tf2_msgs)
endif()
