// SPDX-License-Identifier: LGPL-3.0-or-later
// What the parts of the module share.
#pragma once

#include <pybind11/functional.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <map>
#include <mutex>

#include "mauve_rt/mauve_rt.hpp"

#include "interpreter.hpp"
#include "text.hpp"
#include "types.hpp"

namespace mauve::bindings {

namespace py = pybind11;

/// Registers MauveError and its translation.
void bind_errors(py::module_& module);
/// Registers the snapshots: descriptions of ports, properties, components, resources.
void bind_descriptions(py::module_& module);
/// Registers PluginRegistry and PartFactory.
void bind_registry(py::module_& module);
/// Registers TaskSetting and the table of them.
void bind_settings(py::module_& module);
/// Registers ActionStep, Overlays and what they tell of; before Architecture.
void bind_overlays(py::module_& module);
void bind_state_keeper(py::module_& module);
/// Registers Architecture and Component.
void bind_architecture(py::module_& module);
/// Registers StepReport, RealtimeStatus and TraceDrain.
void bind_reports(py::module_& module);
/// Registers GoalState, GoalReason and what a host reports of goals; before Host.
void bind_goals(py::module_& module);
/// Registers Host and Deployer.
void bind_host(py::module_& module);
void bind_value_log(py::module_& module);
/// Registers TransformBuffer.
void bind_transforms(py::module_& module);
/// Registers Transaction and its reports.
void bind_transaction(py::module_& module);
void bind_probation(py::module_& module);
void bind_output_steps(py::module_& module);
void bind_shadow(py::module_& module);
void bind_open_change(py::module_& module);
/// Registers what parts written in Python see of their shell, and what they declare themselves with.
void bind_python_shell(py::module_& module);
void bind_python_fsm(py::module_& module);
/// Registers the table of conditions and the engine of rules.
void bind_rules(py::module_& module);
/// Registers what lets rules act beside the components of a host; after Host and the engine of rules.
void bind_rule_runner(py::module_& module);
void bind_process_end(py::module_& module);
/// Registers Simulation and its hosts; after Host.
void bind_simulation(py::module_& module);

py::handle mauve_error_type();
/// The code of a name; internal when it is none.
ErrorCode error_code_of(std::string_view name) noexcept;

class PythonObject;

/// How to make a part written in Python, and what it is called.
struct PartFactory {
  std::string kind;  // shell, core, fsm or resource, so that none is taken for another
  std::string name;  // package/Class
  std::shared_ptr<PythonObject> make;
  CoreTimes wcet_ns{};  // of a core
};
std::unique_ptr<Shell> make_python_shell(const PartFactory& factory, const PluginRegistry& registry);
std::unique_ptr<CoreBase> make_python_core(const PartFactory& factory);
std::unique_ptr<FsmBase> make_python_fsm(const PartFactory& factory);
std::unique_ptr<Resource> make_python_resource(const PartFactory& factory,
                                               const ResourceParameters& parameters = {});

// A part as Python names it: a registered name, or a class. Under the interpreter's lock.

std::unique_ptr<Shell> make_shell(const py::object& part, const PluginRegistry& registry);
std::unique_ptr<CoreBase> make_core(const py::object& part, const PluginRegistry& registry);
std::unique_ptr<FsmBase> make_fsm(const py::object& part, const PluginRegistry& registry);
std::unique_ptr<Resource> make_resource(const py::object& part, const PluginRegistry& registry);

/// What a resource is told by keyword. Throws a TypeError of Python.
ResourceParameters parameters_of(const py::dict& keywords);
/// A property's value as Python has it.
py::object to_python(const PropertyValue& value);

/// Settings as keyword arguments; those not given have their defaults. Throws Error, py::type_error.
TaskSettings task_settings(const std::string& component, const py::kwargs& given);

struct PortDescription {
  std::string name;
  std::string kind;
  std::string type;
  std::string resource;
  std::string service;
  bool required{true};
  std::vector<MessageShape> messages{};  // of a shell's; a component's tells none
  time_ns_t longest_hold_ns{0};
  bool wait_free{false};                  // takes no lock, as ports are connected now; of a component's
  std::vector<std::byte> stop_message{};  // of a component's
  std::string on_commit{};                // of a shell's write port: "hold" or "set_zero"
  std::string on_stop{};
  Frames frames{};
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
  std::vector<std::string> structural;  // the parts that read it only when they are configured
};
std::vector<PropertyDescription> describe_properties(const Shell& shell);
PropertyDescription describe_property(const ShownProperty& property);

struct ServiceDescription {
  std::string name;
  std::string kind;
  std::string type;
  bool takes_messages;
  std::vector<MessageShape> messages;
  bool is_wait_free{false};  // of ports, as things are
};
struct ResourceDescription {
  std::string name;
  std::string kind;
  std::string type;
  std::vector<ServiceDescription> services;
  time_ns_t longest_hold_ns;
  std::uint64_t refused_values{0};
  std::string why_refused_value{};
  std::size_t memory_bytes{0};
  Frames frames{};
};
ResourceDescription describe_resource(const Resource& resource);

struct ShellDescription {
  std::string name;
  std::vector<PortDescription> ports;
  std::vector<PropertyDescription> properties;
  std::size_t bytes{0};  // of its class; 0: not written in C++
};

struct CoreDescription {
  std::string name;
  std::string shell;
  bool is_python{false};
  std::vector<std::string> classes;
  CoreTimes wcet_ns;
  time_ns_t budget_ns{0};
  std::vector<std::pair<std::string, std::string>> state_fields;  // name and type
};
/// Of a core that is made only to be described. Throws Error (type_mismatch): it was written for another shell.
CoreDescription describe_core(CoreBase& core, Shell& shell, const PluginRegistry& registry);

/// An architecture with the registry it makes its parts from.
struct PyArchitecture {
  explicit PyArchitecture(PluginRegistry& plugins)
      : registry(plugins), owned(std::make_unique<Architecture>(&plugins)), architecture(*owned) {}
  ~PyArchitecture() {
    const InterpreterUnlocked release;  // a component thread may need the interpreter to come to its end
    owned.reset();
  }
  PyArchitecture(const PyArchitecture&) = delete;
  PyArchitecture& operator=(const PyArchitecture&) = delete;

  PluginRegistry& registry;
  std::unique_ptr<Architecture> owned;
  Architecture& architecture;
  std::recursive_mutex
      describing;  // cleanup takes away what a description reads; a core's hook may ask for one
};

/// How long an execution state took so far.
struct ExecutionTimeDescription {
  std::string state;
  std::uint64_t count;
  time_ns_t mean_ns, max_ns;
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
  std::string fault, fallback;
  bool fell_back;
  std::uint64_t releases, overruns, skipped;
  time_ns_t wakeup_p50_ns, wakeup_p99_ns, wakeup_max_ns;
  std::uint64_t allocations, page_faults;
  std::vector<ExecutionTimeDescription> execution_times;
  StateAge state_age;
  time_ns_t deadline_ns;
  std::string overrun;
  std::vector<DescribedState> states;
  std::vector<SlewRecord> slew_limits;
};
ComponentDescription describe_component(Component& component);

/// The largest figures of a component since they were taken last.
struct RecentMaxima {
  std::string component;
  time_ns_t wakeup_ns;
  time_ns_t response_ns;
  std::map<std::string, time_ns_t> execution_ns;  // by state
};
RecentMaxima take_recent_maxima(const Component& component);

}  // namespace mauve::bindings
