# What ROS 2 and Python need of mauve_rt besides the kernel.

mauve_install_python_package(mauve_rt)
mauve_register_package(mauve_rt)
install(FILES package.xml DESTINATION share/mauve_rt)
install(DIRECTORY mauve_rt/launch DESTINATION share/mauve_rt PATTERN "__pycache__" EXCLUDE)
# Named in colcon.pkg: a workspace's setup files then put this prefix on AMENT_PREFIX_PATH, as for any ament package.
install(FILES cmake/ament_prefix_path.dsv cmake/ament_prefix_path.sh DESTINATION share/mauve_rt/hook)

mauve_install_program(executor mauve_rt.node.executor lib/mauve_rt)
mauve_install_program(supervisor mauve_rt.node.supervisor lib/mauve_rt)
mauve_install_program(mauve mauve_rt.cli.main bin)

# What pip writes beside a package it installs: by it `ros2` finds the entry points, and with them `ros2 mauve`.
set(_metadata "${CMAKE_CURRENT_BINARY_DIR}/metadata/mauve_rt-${PROJECT_VERSION}.dist-info")
configure_file(cmake/METADATA.in "${_metadata}/METADATA" @ONLY)
configure_file(mauve_rt/cli/entry_points.txt "${_metadata}/entry_points.txt" COPYONLY)
install(DIRECTORY "${_metadata}" DESTINATION "${PYTHON_INSTALL_DIR}")
