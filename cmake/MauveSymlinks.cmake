# `colcon build --symlink-install`: what needs no compiler - Python sources, architecture, rules and launch files, maps -
# is installed as links into the clone, so that an edit is seen without a build.

# ament_cmake's own way replaces install() for all of a CMake project, by a script of one folder: it does not hold for
# several packages. What it would link of mauve_msgs is generated; that is copied as ever.
set(MAUVE_SYMLINK_INSTALL "${AMENT_CMAKE_SYMLINK_INSTALL}")
set(AMENT_CMAKE_SYMLINK_INSTALL OFF)
if(MAUVE_SYMLINK_INSTALL)
  message(STATUS "Python sources and data files are installed as links; what is compiled needs a build")
endif()

# mauve_link_installed(<folder> <destination>): to be called after the install() of a folder, whose choice it keeps:
# of what is at the destination then, every file that came from the folder becomes a link to it.
function(mauve_link_installed folder destination)
  if(MAUVE_SYMLINK_INSTALL)
    install(CODE "
      set(source \"${folder}\")
      set(copy \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${destination}\")
      file(GLOB_RECURSE names LIST_DIRECTORIES FALSE RELATIVE \"\${copy}\" \"\${copy}/*\")
      list(FILTER names EXCLUDE REGEX \"\\\\.(so|pyi|pyc)$\") # the clone may have those of another build
      foreach(name IN LISTS names)
        if(EXISTS \"\${source}/\${name}\")
          file(CREATE_LINK \"\${source}/\${name}\" \"\${copy}/\${name}\" SYMBOLIC)
        endif()
      endforeach()")
  endif()
endfunction()
