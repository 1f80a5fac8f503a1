// SPDX-License-Identifier: LGPL-3.0-or-later
#include "translate.hpp"

namespace mauve::bindings {

py::object to_python(const PropertyValue& value) {
  return std::visit([](const auto& held) -> py::object { return py::cast(held); }, value);
}

std::vector<PortDescription> describe_ports(const Shell& shell) {
  std::vector<PortDescription> ports;
  for (const auto& port : shell.ports()) {
    ports.push_back({port->name(), std::string(to_string(port->kind())), port->type(), port->resource_name(),
                     port->service() == nullptr ? "" : port->service()->name()});
  }
  return ports;
}

std::vector<PropertyDescription> describe_properties(const Shell& shell) {
  std::vector<PropertyValue> values;
  for (const auto& property : shell.properties()) values.push_back(property->boxed());
  return describe_properties(shell, values);
}

std::vector<PropertyDescription> describe_properties(const Shell& shell,
                                                     const std::vector<PropertyValue>& values) {
  std::vector<PropertyDescription> properties;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const PropertyBase& property = *shell.properties()[i];
    const PropertyOptions& options = property.options();
    properties.push_back({property.name(), std::string(property_type_name(values[i])), values[i],
                          options.unit, options.description, options.minimum, options.maximum});
  }
  return properties;
}

ResourceDescription describe_resource(const Resource& resource) {
  ResourceDescription description{resource.name(), resource.kind(), resource.type(), {}};
  for (const ServiceBase* service : resource.services()) {
    description.services.push_back(
        {service->name(), std::string(to_string(service->kind())), service->type()});
  }
  return description;
}

ComponentDescription describe_component(Component& component) {
  const Task& task = component.task();
  const ComponentState state = task.state();
  const bool faulted = state == ComponentState::faulted;
  const Fault fault = faulted ? task.fault() : Fault{};
  const bool deployed = task.has_thread();
  const TaskStatistics& statistics = task.statistics();
  constexpr double kMedian = 0.5;
  constexpr double kTail = 0.99;
  return {.name = component.name(),
          .shell = component.shell().implementation(),
          .core = component.core_implementation(),
          .fsm = component.fsm().implementation(),
          .state = std::string(to_string(state)),
          .current_state = task.current_state(),
          .clock_ns = task.get_time(),
          .period_ns = component.task().context().period_ns,
          .offset_ns = task.settings().offset_ns,
          .policy = deployed ? task.facts().policy : "",
          .priority = deployed ? task.facts().priority : task.settings().priority,
          .cpus = deployed ? task.facts().cpus : task.settings().cpus,
          .alternatives = component.alternatives(),
          .reconfigurable = component.is_reconfigurable(),
          .ports = describe_ports(component.shell()),
          .properties = describe_properties(component.shell(), component.property_values()),
          .fault = faulted ? fault.what + " (in state " + fault.where + ", at " +
                                 std::to_string(fault.when_ns) + " ns)"
                           : "",
          .releases = statistics.releases.load(std::memory_order_relaxed),
          .overruns = statistics.overruns.load(std::memory_order_relaxed),
          .skipped = statistics.skipped.load(std::memory_order_relaxed),
          .wakeup_p50_ns = statistics.wakeup.quantile_ns(kMedian),
          .wakeup_p99_ns = statistics.wakeup.quantile_ns(kTail),
          .wakeup_max_ns = statistics.wakeup.max_ns()};
}

void bind_descriptions(py::module_& module) {
  py::class_<PortDescription>(module, "PortDescription")
      .def_readonly("name", &PortDescription::name)
      .def_readonly("kind", &PortDescription::kind)
      .def_readonly("type", &PortDescription::type)
      .def_readonly("resource", &PortDescription::resource)
      .def_readonly("service", &PortDescription::service);
  py::class_<PropertyDescription>(module, "PropertyDescription")
      .def_readonly("name", &PropertyDescription::name)
      .def_readonly("type", &PropertyDescription::type)
      .def_property_readonly("value", [](const PropertyDescription& self) { return to_python(self.value); })
      .def_readonly("unit", &PropertyDescription::unit)
      .def_readonly("description", &PropertyDescription::description)
      .def_readonly("minimum", &PropertyDescription::minimum)
      .def_readonly("maximum", &PropertyDescription::maximum);
  py::class_<ShellDescription>(module, "ShellDescription")
      .def_readonly("name", &ShellDescription::name)
      .def_readonly("ports", &ShellDescription::ports)
      .def_readonly("properties", &ShellDescription::properties);
  py::class_<ServiceDescription>(module, "ServiceDescription")
      .def_readonly("name", &ServiceDescription::name)
      .def_readonly("kind", &ServiceDescription::kind)
      .def_readonly("type", &ServiceDescription::type);
  py::class_<ResourceDescription>(module, "ResourceDescription")
      .def_readonly("name", &ResourceDescription::name)
      .def_readonly("kind", &ResourceDescription::kind)
      .def_readonly("type", &ResourceDescription::type)
      .def_readonly("services", &ResourceDescription::services);
  using C = ComponentDescription;
  py::class_<C>(module, "ComponentDescription")
      .def_readonly("name", &C::name)
      .def_readonly("shell", &C::shell)
      .def_readonly("core", &C::core)
      .def_readonly("fsm", &C::fsm)
      .def_readonly("state", &C::state)
      .def_readonly("current_state", &C::current_state)
      .def_readonly("clock_ns", &C::clock_ns)
      .def_readonly("period_ns", &C::period_ns)
      .def_readonly("offset_ns", &C::offset_ns)
      .def_readonly("policy", &C::policy)
      .def_readonly("priority", &C::priority)
      .def_readonly("cpus", &C::cpus)
      .def_readonly("alternatives", &C::alternatives)
      .def_readonly("reconfigurable", &C::reconfigurable)
      .def_readonly("ports", &C::ports)
      .def_readonly("properties", &C::properties)
      .def_readonly("fault", &C::fault)
      .def_readonly("releases", &C::releases)
      .def_readonly("overruns", &C::overruns)
      .def_readonly("skipped", &C::skipped)
      .def_readonly("wakeup_p50_ns", &C::wakeup_p50_ns)
      .def_readonly("wakeup_p99_ns", &C::wakeup_p99_ns)
      .def_readonly("wakeup_max_ns", &C::wakeup_max_ns);
}

}  // namespace mauve::bindings
