// SPDX-License-Identifier: LGPL-3.0-or-later
#include "parts/lookup.hpp"

namespace mauve {

PortBase& find_port(const Shell& shell, const std::string& name, const std::string& component) {
  if (PortBase* port = shell.find_port(name)) return *port;
  throw Error(ErrorCode::unknown_port, "the shell has no such port",
              {.component = component,
               .element = "port " + name,
               .expected = "one of " + join(names_of(shell.ports())),
               .found = name});
}

PropertyBase& find_property(const Shell& shell, const std::string& name, const std::string& component) {
  if (PropertyBase* property = shell.find_property(name)) return *property;
  throw Error(ErrorCode::unknown_property, "the shell has no such property",
              {.component = component,
               .element = "property " + name,
               .expected = "one of " + join(names_of(shell.properties())),
               .found = name});
}

ServiceBase& find_service(const Resource& resource, const std::string& name, const std::string& component,
                          const std::string& port) {
  if (ServiceBase* service = resource.find_service(name)) return *service;
  throw Error(ErrorCode::unknown_service, "the resource has no such service",
              {.component = component,
               .element = "connection of " + port + " to " + resource.name(),
               .expected = "one of " + join(names_of(resource.services())),
               .found = name});
}

void throw_not_connected(const PortBase& port, const std::string& component, int step) {
  const bool is_call = port.kind() == PortKind::call;
  const std::string where = is_call ? "connect it" : "connect it, or declare it optional in the shell";
  throw Error(ErrorCode::not_connected, "a required port is not connected",
              {.component = component,
               .element = "port " + port.name(),
               .expected = "a connection to a " + std::string(to_string(port.kind())) + " service" +
                           (port.type().empty() ? "" : " of " + port.type()),
               .found = "none",
               .remedy = step == 0 ? where : where + ", in the same transaction",
               .step = step});
}

}  // namespace mauve
