# What ROS 2 and Python need of mauve_rt besides the kernel.

mauve_install_python_package(mauve_rt)
# Of `mauve new`: there are folders among them that the package's own files are not installed from.
set(_templates "${PYTHON_INSTALL_DIR}/mauve_rt/scaffold/templates")
install(DIRECTORY mauve_rt/scaffold/templates/ DESTINATION "${_templates}")
mauve_link_installed("${PROJECT_SOURCE_DIR}/mauve_rt/scaffold/templates" "${_templates}")
mauve_register_package(mauve_rt)
install(FILES package.xml DESTINATION share/mauve_rt)
install(FILES mauve_rt/node/shared/local.xml mauve_rt/node/shared/local_udp.xml mauve_rt/node/shared/open.xml
              mauve_rt/node/shared/open_udp.xml DESTINATION share/mauve_rt/dds)
install(DIRECTORY mauve_rt/launch DESTINATION share/mauve_rt PATTERN "__pycache__" EXCLUDE)
mauve_link_installed("${PROJECT_SOURCE_DIR}/mauve_rt/launch" share/mauve_rt/launch)
# A workspace's setup files source these of every ament package, for each kind of shell: the prefix is put on
# AMENT_PREFIX_PATH.
foreach(shell dsv sh)
  install(FILES cmake/local_setup.${shell} DESTINATION share/mauve_rt)
endforeach()
foreach(shell bash zsh)
  install(FILES cmake/local_setup.sh DESTINATION share/mauve_rt RENAME local_setup.${shell})
endforeach()

mauve_install_program(executor mauve_rt.node.executor.main lib/mauve_rt)
mauve_install_program(supervisor mauve_rt.node.supervisor.main lib/mauve_rt)
mauve_install_program(mauve mauve_rt.cli.main bin)

# What pip writes beside a package it installs: by it `ros2` finds the entry points, and with them `ros2 mauve`.
set(_metadata "${CMAKE_CURRENT_BINARY_DIR}/metadata/mauve_rt-${PROJECT_VERSION}.dist-info")
configure_file(cmake/METADATA.in "${_metadata}/METADATA" @ONLY)
configure_file(mauve_rt/cli/entry_points.txt "${_metadata}/entry_points.txt" COPYONLY)
install(DIRECTORY "${_metadata}" DESTINATION "${PYTHON_INSTALL_DIR}")
