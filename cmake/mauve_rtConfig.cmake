# find_package(mauve_rt): the library mauve_rt::kernel, and mauve_rt_register_plugins() for packages with plug-ins.
include(CMakeFindDependencyMacro)
find_dependency(Threads)
include("${CMAKE_CURRENT_LIST_DIR}/mauve_rtTargets.cmake")
include("${CMAKE_CURRENT_LIST_DIR}/mauve_rt_register_plugins.cmake")
