// SPDX-License-Identifier: LGPL-3.0-or-later
// The canonical description of an architecture: equal exactly when nothing was changed.
#pragma once

#include <string>
#include <vector>

#include "mauve_rt/run/component.hpp"

namespace mauve {

struct ComponentFacts {
  std::string name;
  ShownParts parts;  // implementations, wiring, properties
  ComponentState state{ComponentState::unconfigured};
  time_ns_t period_ns{0};     // in force
  time_ns_t reference_ns{0};  // of the grid, from the deployment's epoch
  TaskSettings settings;
  std::vector<std::string> alternatives;
  std::string fallback;
  bool reconfigurable{true};
  bool operator==(const ComponentFacts&) const = default;
};

struct ServiceFacts {
  std::string name;
  PortKind kind{PortKind::read};
  std::string type;
  bool operator==(const ServiceFacts&) const = default;
};

struct ResourceFacts {
  std::string name;
  std::string kind;
  std::string type;
  std::vector<ServiceFacts> services;
  time_ns_t longest_hold_ns{0};  // of its lock; 0: not declared
  Frames frames{};
  bool operator==(const ResourceFacts&) const = default;
};

/// Components and resources, each sorted by name.
struct ArchitectureDescription {
  std::vector<ComponentFacts> components;
  std::vector<ResourceFacts> resources;
  bool operator==(const ArchitectureDescription&) const = default;
};

/// One line a fact, the same text for the same description. [non-rt]
std::string to_string(const ArchitectureDescription& description);

}  // namespace mauve
