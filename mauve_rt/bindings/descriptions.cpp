// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/data/message_file.hpp"

#include "translate.hpp"

namespace mauve::bindings {

py::object to_python(const PropertyValue& value) {
  return std::visit([](const auto& held) -> py::object { return py::cast(held); }, value);
}

ResourceParameters parameters_of(const py::dict& keywords) {
  ResourceParameters parameters;
  for (const auto& [name, value] : keywords) {
    if (py::isinstance<py::dict>(value)) {  // capacity={"ranges": 1081}
      for (const auto& [key, inner] : parameters_of(value.cast<py::dict>()))
        parameters.emplace(name.cast<std::string>() + "." + key, inner);
      continue;
    }
    try {
      parameters.emplace(name.cast<std::string>(), value.cast<PropertyValue>());
    } catch (const py::cast_error&) {
      throw py::type_error(py::str("parameter {}: expected bool, int, float or str, found {!r}")
                               .format(name, value)
                               .cast<std::string>());
    }
  }
  return parameters;
}

std::vector<PortDescription> describe_ports(const Shell& shell) {
  std::vector<PortDescription> ports;
  for (const auto& port : shell.ports()) {
    auto [resource, service, longest_hold_ns] = port->connected_to();
    const bool is_output = port->kind() == PortKind::write;
    const auto policy = [&](OutputPolicy each) { return is_output ? std::string(to_string(each)) : ""; };
    ports.push_back({.name = port->name(),
                     .kind = std::string(to_string(port->kind())),
                     .type = port->type(),
                     .resource = std::move(resource),
                     .service = std::move(service),
                     .required = port->is_required(),
                     .messages = port->messages(),
                     .longest_hold_ns = longest_hold_ns,
                     .on_commit = policy(port->output().on_commit),
                     .on_stop = policy(port->output().on_stop),
                     .frames = port->frames() == nullptr ? Frames{} : *port->frames()});
  }
  return ports;
}

std::vector<PropertyDescription> describe_properties(const Shell& shell) {
  std::vector<PropertyDescription> properties;
  for (const auto& property : shell.properties())
    properties.push_back(describe_property({property->name(), property->boxed(), property->options()}));
  return properties;
}

PropertyDescription describe_property(const ShownProperty& property) {
  const PropertyOptions& options = property.options;
  return {property.name,       std::string(property_type_name(property.value)),
          property.value,      options.unit,
          options.description, options.minimum,
          options.maximum,     names_of(options.structural)};
}

ResourceDescription describe_resource(const Resource& resource) {
  ResourceDescription description{resource.name(),
                                  resource.kind(),
                                  resource.type(),
                                  {},
                                  resource.longest_hold_ns(),
                                  resource.refused_values(),
                                  resource.why_refused_value(),
                                  resource.memory_bytes(),
                                  resource.frame_guard().declared()};
  for (const ServiceBase* service : resource.services()) {
    description.services.push_back({service->name(), std::string(to_string(service->kind())), service->type(),
                                    service->is_call_serializable(), service->messages(),
                                    service->is_wait_free()});
  }
  return description;
}

namespace {

std::vector<ExecutionTimeDescription> describe_execution_times(const StateTimes& states) {
  std::vector<ExecutionTimeDescription> times;
  for (const auto& [state, time] : states)
    times.push_back({state, time.count(), time.mean_ns(), time.max_ns()});
  return times;
}

}  // namespace

ComponentDescription describe_component(Component& component) {
  const ShownParts shown = component.shown();
  std::vector<PortDescription> ports;
  ports.reserve(shown.ports.size());
  for (const ShownPort& port : shown.ports)
    ports.push_back({.name = port.name,
                     .kind = std::string(to_string(port.kind)),
                     .type = port.type,
                     .resource = port.resource,
                     .service = port.service,
                     .longest_hold_ns = port.longest_hold_ns,
                     .stop_message = port.stop_message,
                     .frames = port.frames});
  std::vector<PropertyDescription> properties;
  properties.reserve(shown.properties.size());
  for (const ShownProperty& property : shown.properties) properties.push_back(describe_property(property));
  const Task& task = component.task();
  const ComponentState state = task.state();
  const bool faulted = state == ComponentState::faulted;
  const bool fell_back = task.has_fallen_back();
  const Fault fault = faulted || fell_back ? task.fault() : Fault{};
  const bool deployed = task.has_thread();
  const TaskStatistics& statistics = task.statistics();
  const StateAge age = task.state_age();
  constexpr double kMedian = 0.5;
  constexpr double kTail = 0.99;
  return {.name = component.name(),
          .shell = shown.shell,
          .core = shown.core,
          .fsm = shown.fsm,
          .state = std::string(to_string(state)),
          .current_state = age.state,
          .clock_ns = task.get_time(),
          .period_ns = component.task().context().period_ns,
          .offset_ns = task.settings().offset_ns,
          .policy = deployed ? task.facts().policy : "",
          .priority = deployed ? task.facts().priority : task.settings().priority,
          .cpus = deployed ? task.facts().cpus : task.settings().cpus,
          .alternatives = component.alternatives(),
          .reconfigurable = component.is_reconfigurable(),
          .ports = std::move(ports),
          .properties = std::move(properties),
          .fault = fault.what.empty() ? ""
                                      : fault.what + " (in state " + fault.where + ", at " +
                                            std::to_string(fault.when_ns) + " ns)",
          .fallback = component.fallback_implementation(),
          .fell_back = fell_back,
          .releases = statistics.releases.load(std::memory_order_relaxed),
          .overruns = statistics.overruns.load(std::memory_order_relaxed),
          .skipped = statistics.skipped.load(std::memory_order_relaxed),
          .wakeup_p50_ns = statistics.wakeup.quantile_ns(kMedian),
          .wakeup_p99_ns = statistics.wakeup.quantile_ns(kTail),
          .wakeup_max_ns = statistics.wakeup.max_ns(),
          .allocations = task.counters().allocations(),
          .page_faults = task.counters().page_faults(),
          .execution_times = describe_execution_times(*component.state_times()),
          .state_age = age,
          .deadline_ns = task.settings().deadline_ns,
          .overrun = std::string(kOverrunPolicies[static_cast<std::size_t>(task.settings().overrun)]),
          .states = component.described_states(),
          .slew_limits = component.slews()};
}

RecentMaxima take_recent_maxima(const Component& component) {
  const TaskStatistics& statistics = component.task().statistics();
  RecentMaxima maxima{component.name(),
                      statistics.wakeup.maximum().take_recent_ns(),
                      statistics.response.take_recent_ns(),
                      {}};
  const auto times = component.state_times();  // keeps them to the end of the loop
  for (const auto& [state, time] : *times) maxima.execution_ns[state] = time.maximum().take_recent_ns();
  return maxima;
}

void bind_descriptions(py::module_& module) {
  py::class_<FieldShape>(module, "FieldShape", "A field of a message as its C++ struct has it.")
      .def_readonly("name", &FieldShape::name)
      .def_readonly("type", &FieldShape::type,
                    "Of an element, as in .msg files: 'float64', 'string', 'geometry_msgs/msg/Point'.")
      .def_readonly("text_capacity", &FieldShape::text_capacity, "Of a string; 0: any length.")
      .def_property_readonly("item", &item_text, "Of an element, as in .msg files: `string<=10`.")
      .def_property_readonly("array", &array_text, "As in .msg files: `[3]`, `[<=3]` or `[]`; empty: none.")
      .def_property_readonly("is_array", [](const FieldShape& self) { return self.arity != FieldArity::one; })
      .def_property_readonly(
          "is_fixed", [](const FieldShape& self) { return self.arity == FieldArity::fixed; },
          "An array of exactly `size`, not of at most.")
      .def_readonly("size", &FieldShape::size)
      .def_readonly("offset", &FieldShape::offset, "In bytes, within its struct.")
      .def_readonly("fields", &FieldShape::fields, "Of a message within the message.");
  py::class_<MessageShape>(module, "MessageShape", "A message as its C++ struct has it.")
      .def_readonly("type", &MessageShape::type)
      .def_readonly("bytes", &MessageShape::bytes, "Of the struct.")
      .def_readonly("fields", &MessageShape::fields);
  py::class_<MessageFile>(module, "MessageFile", "The .msg file of a struct.")
      .def_readonly("name", &MessageFile::name, "Of the message: package/msg/Name.")
      .def_readonly("text", &MessageFile::text);
  module.def("message_files", &message_files,
             "The .msg file of a struct, then those of the structs within it, each once.");
  module.def("message_name", &message_name, "Of a struct of this type: package/msg/Name.");
  py::class_<PortDescription>(module, "PortDescription")
      .def_readonly("name", &PortDescription::name)
      .def_readonly("kind", &PortDescription::kind, "'read', 'write', 'call', 'event'.")
      .def_readonly("type", &PortDescription::type,
                    "'geometry_msgs/msg/Point'; of a call port the name that its service declares.")
      .def_readonly("resource", &PortDescription::resource, "'' when not connected.")
      .def_readonly("service", &PortDescription::service)
      .def_readonly("required", &PortDescription::required, "Told of a shell's ports, not of a component's.")
      .def_readonly("messages", &PortDescription::messages,
                    "Of its type. Told of a shell's ports, not of a component's.")
      .def_readonly("longest_hold_ns", &PortDescription::longest_hold_ns,
                    "For how long a user holds its resource's lock; 0: not declared.")
      .def_readonly("wait_free", &PortDescription::wait_free,
                    "It takes no lock, as ports are connected now; told of a component's ports.")
      .def_property_readonly(
          "stop_message",
          [](const PortDescription& self) {
            return py::bytes(reinterpret_cast<const char*>(self.stop_message.data()),
                             self.stop_message.size());
          },
          "What a stop writes, as a message; empty: nothing. Told of a component's connected ports.")
      .def_readonly("on_commit", &PortDescription::on_commit,
                    "Of a shell's write port: 'hold' or 'set_zero'; else ''.")
      .def_readonly("on_stop", &PortDescription::on_stop,
                    "Of a shell's write port: 'hold' or 'set_zero'; else ''.")
      .def_property_readonly(
          "frame", [](const PortDescription& self) { return self.frames.frame; },
          "That its values are in; '': not declared.")
      .def_property_readonly(
          "child_frame", [](const PortDescription& self) { return self.frames.child_frame; },
          "Whose pose its values are; '': not declared.");
  py::class_<PropertyDescription>(module, "PropertyDescription")
      .def_readonly("name", &PropertyDescription::name)
      .def_readonly("type", &PropertyDescription::type, "'bool', 'int', 'float', 'str'.")
      .def_readonly("value", &PropertyDescription::value, "Default, or the present value for a component.")
      .def_readonly("unit", &PropertyDescription::unit)
      .def_readonly("description", &PropertyDescription::description)
      .def_readonly("minimum", &PropertyDescription::minimum)
      .def_readonly("maximum", &PropertyDescription::maximum)
      .def_readonly("structural", &PropertyDescription::structural,
                    "Parts that read it only when they are configured: shell, core, fsm.")
      .def(
          "check",
          [](const PropertyDescription& self, const PropertyValue& value) {
            const PropertyOptions options{
                .unit = self.unit, .minimum = self.minimum, .maximum = self.maximum};
            static_cast<void>(checked(self.name, self.value, options, value));
          },
          py::arg("value"),
          "Raises MauveError (type_mismatch, out_of_range) for a value that it does not take.");
  py::class_<ShellDescription>(module, "ShellDescription")
      .def_readonly("name", &ShellDescription::name)
      .def_readonly("ports", &ShellDescription::ports)
      .def_readonly("properties", &ShellDescription::properties)
      .def_readonly("bytes", &ShellDescription::bytes, "Of its class; 0: not written in C++.");
  py::class_<CoreDescription>(module, "CoreDescription", "What a registered core says of itself.")
      .def_readonly("name", &CoreDescription::name)
      .def_readonly("shell", &CoreDescription::shell, "Name of the shell that it was written for.")
      .def_readonly("is_python", &CoreDescription::is_python, "Whether it is written in Python.")
      .def_readonly("classes", &CoreDescription::classes, "As PluginRegistry.classes_of().")
      .def_readonly("wcet_ns", &CoreDescription::wcet_ns,
                    "The worst-case execution times of its methods, as far as they are declared.")
      .def_readonly("budget_ns", &CoreDescription::budget_ns,
                    "Of its adopt and take together; 0: not declared.")
      .def_readonly("state_fields", &CoreDescription::state_fields,
                    "Name and type of each field that a core which replaces it may take over.");
  py::class_<ServiceDescription>(module, "ServiceDescription")
      .def_readonly("name", &ServiceDescription::name)
      .def_readonly("kind", &ServiceDescription::kind,
                    "As PortDescription.kind: the kind of port that connects to it.")
      .def_readonly("type", &ServiceDescription::type)
      .def_readonly("takes_messages", &ServiceDescription::takes_messages,
                    "A call that can be a ROS service.")
      .def_readonly("messages", &ServiceDescription::messages,
                    "A call's request and response; none where C++ has no struct.")
      .def_readonly("is_wait_free", &ServiceDescription::is_wait_free,
                    "Whether a port takes no lock, as ports are connected now.");
  py::class_<ResourceDescription>(module, "ResourceDescription")
      .def_readonly("name", &ResourceDescription::name)
      .def_readonly("kind", &ResourceDescription::kind, "A given kind, or the plug-in's name.")
      .def_readonly("type", &ResourceDescription::type)
      .def_readonly("services", &ResourceDescription::services)
      .def_readonly("longest_hold_ns", &ResourceDescription::longest_hold_ns,
                    "For how long a user holds its lock; 0: not declared.")
      .def_readonly("refused_values", &ResourceDescription::refused_values,
                    "Values in another frame, or with a sequence that had more elements than the capacity.")
      .def_readonly("why_refused_value", &ResourceDescription::why_refused_value,
                    "The last of them, in words.")
      .def_readonly("memory_bytes", &ResourceDescription::memory_bytes,
                    "What all values take that it has room for; 0: not known.")
      .def_property_readonly(
          "frame", [](const ResourceDescription& self) { return self.frames.frame; },
          "That its values are in; '': not declared.")
      .def_property_readonly(
          "child_frame", [](const ResourceDescription& self) { return self.frames.child_frame; },
          "Whose pose its values are; '': not declared.");
  using E = ExecutionTimeDescription;
  py::class_<E>(module, "ExecutionTimeDescription",
                "How long an execution state took since its machine was configured.")
      .def_readonly("state", &E::state)
      .def_readonly("count", &E::count)
      .def_readonly("mean_ns", &E::mean_ns)
      .def_readonly("max_ns", &E::max_ns);
  using S = DescribedState;
  py::class_<S>(module, "DescribedState",
                "A state of an fsm; it has the fields of mauve_msgs/msg/StateInfo, and more.")
      .def_readonly("name", &S::name)
      .def_readonly("is_initial", &S::is_initial)
      .def_readonly("is_wait", &S::is_wait)
      .def_readonly("is_event_wait", &S::is_event_wait)
      .def_readonly("duration_ns", &S::duration_ns,
                    "Of a wait; of an event wait its timeout; FOREVER: it has none.")
      .def_readonly("min_interarrival_ns", &S::min_interarrival_ns, "Of an event wait.")
      .def_readonly("max_execution_ns", &S::max_execution_ns, "Of an execution state: its bound; 0: none.")
      .def_readonly("simulated_execution_ns", &S::simulated_execution_ns, "What it takes in virtual time.")
      .def_readonly("successors", &S::successors,
                    "In the order in which guards are asked; last the one without a guard.")
      .def_readonly("wcet_ns", &S::wcet_ns, "Of an execution state: its worst case; 0: not declared.")
      .def_readonly("duration_text", &S::duration_text,
                    "The expression of duration_ns, as '5 * unit_ms'; '': a plain number of ns.")
      .def_readonly("min_interarrival_text", &S::min_interarrival_text,
                    "The expression of min_interarrival_ns; '': a plain number of ns.")
      .def_readonly("action", &S::action, "Of an execution state: the core's method that it runs.")
      .def_readonly("guards", &S::guards, "The core's methods, one for each successor but the last.")
      .def_readonly("event_port", &S::event_port, "Of an event wait.")
      .def_readonly("wcet_core", &S::wcet_core,
                    "The core that declares wcet_ns; '': the architecture file or the fsm does.")
      .def_readonly("methods_without_wcet", &S::methods_without_wcet,
                    "Of a core that declares times of other methods: wcet_ns is 0.")
      .def_readonly("wcet_enforced", &S::wcet_enforced,
                    "An execution that uses more CPU time than wcet_ns faults its component.");
  py::class_<SlewRecord>(module, "SlewRecord",
                         "A number with a max_slew; fields as mauve_msgs/msg/SlewLimit.")
      .def_readonly("output", &SlewRecord::output, "PORT.PATH, such as command.torque.")
      .def_readonly("max_slew", &SlewRecord::max_slew, "Units of the number per second.")
      .def_readonly("limited", &SlewRecord::limited,
                    "Writes in which the kernel wrote another value than the component asked for.")
      .def_readonly("not_limited", &SlewRecord::not_limited,
                    "Values of a stop that were written at once, further away than max_slew allows.");
  using C = ComponentDescription;
  py::class_<C>(module, "ComponentDescription", "A snapshot; fields as mauve_msgs/msg/ComponentInfo.")
      .def_readonly("name", &C::name)
      .def_readonly("shell", &C::shell)
      .def_readonly("core", &C::core)
      .def_readonly("fsm", &C::fsm)
      .def_readonly("state", &C::state, "'UNCONFIGURED', 'STOPPED', 'RUNNING', 'STOPPING', 'FAULTED'.")
      .def_readonly("current_state", &C::current_state, "FSM state being executed or waited in.")
      .def_readonly("clock_ns", &C::clock_ns)
      .def_readonly("period_ns", &C::period_ns)
      .def_readonly("offset_ns", &C::offset_ns)
      .def_readonly("policy", &C::policy, "'SCHED_FIFO' | 'SCHED_OTHER' | '' before deployment.")
      .def_readonly("priority", &C::priority)
      .def_readonly("cpus", &C::cpus)
      .def_readonly("alternatives", &C::alternatives)
      .def_readonly("reconfigurable", &C::reconfigurable)
      .def_readonly("ports", &C::ports)
      .def_readonly("properties", &C::properties)
      .def_readonly("fault", &C::fault, "Also of a core that the fallback has replaced.")
      .def_readonly("fallback", &C::fallback,
                    "The core that takes over after a fault; '' when none was declared.")
      .def_readonly("fell_back", &C::fell_back, "It took over.")
      .def_readonly("releases", &C::releases)
      .def_readonly("overruns", &C::overruns)
      .def_readonly("skipped", &C::skipped)
      .def_readonly("wakeup_p50_ns", &C::wakeup_p50_ns)
      .def_readonly("wakeup_p99_ns", &C::wakeup_p99_ns)
      .def_readonly("wakeup_max_ns", &C::wakeup_max_ns)
      .def_readonly("allocations", &C::allocations,
                    "C++ operators new of its thread since its last start; see allocation_counting().")
      .def_readonly("page_faults", &C::page_faults, "Of its thread since its last start, minor and major.")
      .def_readonly("execution_times", &C::execution_times, "One for each execution state.")
      .def_readonly("deadline_ns", &C::deadline_ns, "Declared; 0: the next instant.")
      .def_readonly("overrun", &C::overrun, "'skip', 'catch_up', 'fault'.")
      .def_readonly("states", &C::states, "Of the fsm.")
      .def_readonly("slew_limits", &C::slew_limits, "Of the numbers of its outputs that have a max_slew.")
      .def_property_readonly(
          "state_age_ns", [](const C& self) { return self.state_age.age_ns; },
          "How long it has been executing current_state; of a wait: how long past its pending instant; 0: "
          "parked.")
      .def_property_readonly(
          "state_bound_ns", [](const C& self) { return self.state_age.bound_ns; },
          "Declared max_execution of current_state; 0: none, or a wait.")
      .def_property_readonly(
          "hung_after_ns", [](const C& self) { return self.state_age.hung_after_ns; },
          "An older state is reported as hung.")
      .def_property_readonly(
          "waiting", [](const C& self) { return self.state_age.is_wait; }, "current_state is a wait.")
      .def_property_readonly("hung", [](const C& self) { return self.state_age.is_hung(); });
  py::class_<RecentMaxima>(
      module, "RecentMaxima",
      "The largest figures of a component since they were taken last; 0 where nothing happened.")
      .def_readonly("component", &RecentMaxima::component)
      .def_readonly("wakeup_ns", &RecentMaxima::wakeup_ns)
      .def_readonly("response_ns", &RecentMaxima::response_ns,
                    "From the nominal instant of a release to the entry of the next wait.")
      .def_readonly("execution_ns", &RecentMaxima::execution_ns, "By execution state.");
  module.def(
      "allocation_counting", [] { return std::string(to_string(allocation_counting())); },
      R"(Which C++ allocations the counters see: 'none', 'some' or 'all'.

'none' under a sanitizer. 'some': not those inside the C++ standard library (streams), when the process
had loaded it before; start it with LD_PRELOAD=libmauve_rt.so and it is 'all'. malloc, called directly by
C code or by the interpreter, is never counted.)");
}

}  // namespace mauve::bindings
