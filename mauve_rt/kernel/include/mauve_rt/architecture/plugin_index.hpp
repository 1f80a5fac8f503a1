// SPDX-License-Identifier: LGPL-3.0-or-later
// Which plug-ins a library registers, as the ament index lists them.
#pragma once

#include <string>

namespace mauve {

/// Loads a library and lists what it registers, a line each: kind; name; shell; target. Types and calls that another library of
/// this process has registered before are not among them. [setup] Throws Error (plugin) as PluginRegistry::load_library().
std::string plugin_lines(class PluginRegistry& registry, const std::string& library,
                         const std::string& target);

/// The program that CMake's mauve_rt_register_plugins() builds and runs:
///   PROGRAM OUTPUT [--with FILE] [TARGET LIBRARY]...
/// writes the index of the libraries, behind the lines of a file. Returns the exit status; an error is one line. [setup]
int write_plugin_index(int count, char** words);

}  // namespace mauve
