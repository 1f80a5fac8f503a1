// SPDX-License-Identifier: LGPL-3.0-or-later
// Preview: a shell as it will be, for the thread that prepares parts for it.
#pragma once

#include <string>
#include <vector>

#include "mauve_rt/run/component.hpp"

namespace mauve {

/// While it lives the calling thread finds the properties and the wiring of a shell as they will be, and finds no half of a value that
/// another change sets. [non-rt]
class Preview {
 public:
  Preview() = default;
  ~Preview() {
    for (PropertyBase* property : properties_) property->end_preview();
    for (PortBase* port : ports_) port->end_preview();
  }
  Preview(const Preview&) = delete;
  Preview& operator=(const Preview&) = delete;

  void set(const Shell& shell, const std::string& name, const PropertyValue& value) {
    PropertyBase* const property = shell.find_property(name);
    if (property == nullptr) return;
    properties_.push_back(property);
    property->preview(value);
  }
  void set(const Shell& shell, const std::vector<ShownProperty>& properties) {
    for (const ShownProperty& shown : properties) set(shell, shown.name, shown.value);
  }
  void wire(const Shell& shell, const Wires& wires) {
    for (const auto& port : shell.ports()) {
      const auto wire = wires.find(port->name());
      const bool is_wired = wire != wires.end();
      ports_.push_back(port.get());
      port->preview(is_wired ? port->prepare(*wire->second.service, wire->second.resource)
                             : PortConnection{});
    }
  }

 private:
  std::vector<PropertyBase*> properties_;
  std::vector<PortBase*> ports_;
};

}  // namespace mauve
