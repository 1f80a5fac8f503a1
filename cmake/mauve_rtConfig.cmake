# find_package(mauve_rt): the library mauve_rt::kernel; for packages with plug-ins mauve_rt_register_plugins(),
# mauve_generate_types() and mauve_generate_interfaces().
include(CMakeFindDependencyMacro)
find_dependency(Threads)
include("${CMAKE_CURRENT_LIST_DIR}/mauve_rtTargets.cmake")
include("${CMAKE_CURRENT_LIST_DIR}/mauve_rt_register_plugins.cmake")
include("${CMAKE_CURRENT_LIST_DIR}/mauve_generate_types.cmake")
include("${CMAKE_CURRENT_LIST_DIR}/mauve_generate_interfaces.cmake")
