# find_package(mauve_rt): the library mauve_rt::kernel; for packages with plug-ins mauve_rt_register_plugins(),
# mauve_generate_types(), mauve_generate_interfaces() and mauve_rt_generate_model().
include(CMakeFindDependencyMacro)
find_dependency(Threads)
include("${CMAKE_CURRENT_LIST_DIR}/mauve_rtTargets.cmake")
include("${CMAKE_CURRENT_LIST_DIR}/mauve_rt_register_plugins.cmake")
include("${CMAKE_CURRENT_LIST_DIR}/mauve_generate_types.cmake")
include("${CMAKE_CURRENT_LIST_DIR}/mauve_generate_interfaces.cmake")
include("${CMAKE_CURRENT_LIST_DIR}/mauve_rt_generate_model.cmake")
