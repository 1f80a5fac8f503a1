// SPDX-License-Identifier: LGPL-3.0-or-later
// What the parts of the module share.
#pragma once

#include <pybind11/functional.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "mauve_rt/mauve_rt.hpp"

namespace mauve::bindings {

namespace py = pybind11;

/// Registers MauveError and its translation.
void bind_errors(py::module_& module);
/// Registers the snapshots: descriptions of ports, properties, components, resources.
void bind_descriptions(py::module_& module);
/// Registers Deployer, its reports and the trace's drain.
void bind_deployer(py::module_& module);
/// Registers what a core written in Python sees of its component.
void bind_python_core(py::module_& module);

/// A core that runs a Python object's methods.
std::unique_ptr<CoreBase> make_python_core(py::object factory);

/// A property's value as Python has it.
py::object to_python(const PropertyValue& value);

struct PortDescription {
  std::string name;
  std::string kind;
  std::string type;
  std::string resource;
  std::string service;
};
std::vector<PortDescription> describe_ports(const Shell& shell);

struct PropertyDescription {
  std::string name;
  std::string type;
  PropertyValue value;
  std::string unit;
  std::string description;
  std::optional<double> minimum;
  std::optional<double> maximum;
};
std::vector<PropertyDescription> describe_properties(const Shell& shell);
std::vector<PropertyDescription> describe_properties(const Shell& shell,
                                                     const std::vector<PropertyValue>& values);

struct ServiceDescription {
  std::string name;
  std::string kind;
  std::string type;
};
struct ResourceDescription {
  std::string name;
  std::string kind;
  std::string type;
  std::vector<ServiceDescription> services;
};
ResourceDescription describe_resource(const Resource& resource);

struct ShellDescription {
  std::string name;
  std::vector<PortDescription> ports;
  std::vector<PropertyDescription> properties;
};

/// An architecture with the registry it makes its parts from.
struct PyArchitecture {
  explicit PyArchitecture(PluginRegistry& plugins) : registry(plugins), architecture(&plugins) {}
  PluginRegistry& registry;
  Architecture architecture;
};

/// A component as it is at one moment.
struct ComponentDescription {
  std::string name, shell, core, fsm, state, current_state;
  time_ns_t clock_ns, period_ns, offset_ns;
  std::string policy;
  int priority;
  std::vector<int> cpus;
  std::vector<std::string> alternatives;
  bool reconfigurable;
  std::vector<PortDescription> ports;
  std::vector<PropertyDescription> properties;
  std::string fault;
  std::uint64_t releases, overruns, skipped;
  time_ns_t wakeup_p50_ns, wakeup_p99_ns, wakeup_max_ns;
};
ComponentDescription describe_component(Component& component);

}  // namespace mauve::bindings
