// SPDX-License-Identifier: LGPL-3.0-or-later
// Finding parts by name, or saying which names there are.
#pragma once

#include <string>

#include "mauve_rt/base/error.hpp"
#include "mauve_rt/data/resource.hpp"
#include "mauve_rt/parts/shell.hpp"

#include "base/names.hpp"

namespace mauve {

/// Throws Error (unknown_port), on behalf of a component. [non-rt]
PortBase& find_port(const Shell& shell, const std::string& name, const std::string& component);
/// Throws Error (unknown_property), on behalf of a component. [non-rt]
PropertyBase& find_property(const Shell& shell, const std::string& name, const std::string& component);
/// The service a component's port is to be connected to. Throws Error (unknown_service). [non-rt]
ServiceBase& find_service(const Resource& resource, const std::string& name, const std::string& component,
                          const std::string& port);

/// Of a required port that leads nowhere. [non-rt]
[[noreturn]] void throw_not_connected(const PortBase& port, const std::string& component, int step = 0);

/// `present`: those there are. [non-rt]
template <typename Items>
[[noreturn]] void throw_no_component(const std::string& name, const Items& present) {
  throw Error(
      ErrorCode::unknown_component, "there is no such component",
      {.element = "component " + name, .expected = "one of " + join(names_of(present)), .found = name});
}
/// `present`: those there are. [non-rt]
template <typename Items>
[[noreturn]] void throw_no_resource(const std::string& name, const Items& present) {
  throw Error(
      ErrorCode::unknown_resource, "there is no such resource",
      {.element = "resource " + name, .expected = "one of " + join(names_of(present)), .found = name});
}

}  // namespace mauve
