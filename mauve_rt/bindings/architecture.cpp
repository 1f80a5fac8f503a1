// SPDX-License-Identifier: LGPL-3.0-or-later
// Architectures and their components.
#include "component.hpp"
#include "log.hpp"
#include "transaction.hpp"

namespace mauve::bindings {

namespace {

// A lock that a call may wait for is never waited for under the interpreter's lock.
using Unlocked = py::call_guard<InterpreterUnlocked>;

/// Whether a port takes a lock depends on all ports of its service, and changes with them.
void describe_locking(const Architecture& architecture, std::vector<PortDescription>& ports) {
  for (PortDescription& port : ports) {
    const auto resource = architecture.find_resource(port.resource);
    const ServiceBase* service = resource == nullptr ? nullptr : resource->find_service(port.service);
    port.wait_free = service != nullptr && service->is_wait_free();
  }
}

std::vector<ComponentDescription> describe_components(PyArchitecture& self) {
  const InterpreterUnlocked release;
  const std::lock_guard lock(self.describing);
  std::vector<ComponentDescription> all;
  for (const auto& component : self.architecture.components()) {
    all.push_back(describe_component(*component));
    describe_locking(self.architecture, all.back().ports);
  }
  return all;
}

std::vector<RecentMaxima> take_all_recent_maxima(PyArchitecture& self) {
  const InterpreterUnlocked release;
  const std::lock_guard lock(self.describing);
  std::vector<RecentMaxima> all;
  for (const auto& component : self.architecture.components()) all.push_back(take_recent_maxima(*component));
  return all;
}

std::vector<ResourceDescription> describe_resources(PyArchitecture& self) {
  std::vector<ResourceDescription> all;
  for (const auto& resource : self.architecture.resources()) all.push_back(describe_resource(*resource));
  return all;
}

/// Waits for a change under way without the interpreter's lock, which that may need.
void commit_one(PyArchitecture& self, Transaction transaction) {
  const InterpreterUnlocked release;
  self.architecture.commit_one(std::move(transaction));
}

/// A whole transaction without a host; where there is one, by it.
TransactionReport commit_transaction(PyArchitecture& self, const PyTransaction& steps) {
  Transaction transaction = steps.build(self.registry);
  const InterpreterUnlocked release;
  return self.architecture.commit(std::move(transaction));
}

}  // namespace

void bind_architecture(py::module_& module) {
  bind_component(module);
  py::class_<PyArchitecture> architecture(
      module, "Architecture",
      "Components and resources, connected. Parts are classes written in Python or registered names.");
  add_log_methods(architecture);
  architecture.def(py::init<PluginRegistry&>(), py::arg("registry"), py::keep_alive<1, 2>())
      .def(
          "add_component",
          [](const py::object& object, const std::string& name, const AnyShell& shell, const AnyCore& core,
             const AnyFsm& fsm, const std::vector<std::string>& alternatives,
             const std::optional<AnyCore>& fallback, bool reconfigurable, const py::kwargs& settings) {
            auto& self = object.cast<PyArchitecture&>();
            const PluginRegistry& registry = self.registry;
            std::unique_ptr<CoreBase> fallback_core;
            if (fallback) fallback_core = make_core(*fallback, registry);
            const ComponentParts rest{.settings = task_settings(name, settings),
                                      .alternatives = alternatives,
                                      .reconfigurable = reconfigurable};
            Transaction transaction;
            transaction.add_component(name,
                                      Parts{.shell = make_shell(shell, registry),
                                            .core = make_core(core, registry),
                                            .fsm = make_fsm(fsm, registry)},
                                      rest, std::move(fallback_core));
            commit_one(self, std::move(transaction));
            return PyComponent(object, name);
          },
          py::arg("name"), py::arg("shell"), py::arg("core"), py::arg("fsm"), py::kw_only(),
          py::arg("alternatives") = std::vector<std::string>{}, py::arg("fallback") = std::nullopt,
          py::arg("reconfigurable") = true, "`fallback`: the core that takes over after a fault.")
      .def(
          "component",
          [](const py::object& object, const std::string& name) {
            static_cast<void>(object.cast<PyArchitecture&>().architecture.component(name));
            return PyComponent(object, name);
          },
          py::arg("name"))
      .def(
          "add_resource",
          [](PyArchitecture& self, const std::string& name, const AnyResource& resource,
             time_ns_t longest_hold_ns, const std::string& frame, const std::string& child_frame) {
            Transaction transaction;
            transaction.add_resource(name, make_resource(resource, self.registry), TopicBinding::none,
                                     longest_hold_ns, {.frame = frame, .child_frame = child_frame});
            commit_one(self, std::move(transaction));
          },
          py::arg("name"), py::arg("resource"), py::kw_only(), py::arg("longest_hold_ns") = 0,
          py::arg("frame") = "", py::arg("child_frame") = "")
      .def(
          "add_resource",
          [](PyArchitecture& self, const std::string& name, const std::string& kind, const std::string& type,
             time_ns_t longest_hold_ns, const std::string& frame, const std::string& child_frame,
             const py::kwargs& keywords) {
            Transaction transaction;
            transaction.add_resource(name, self.registry.make_resource(kind, type, parameters_of(keywords)),
                                     TopicBinding::none, longest_hold_ns,
                                     {.frame = frame, .child_frame = child_frame});
            commit_one(self, std::move(transaction));
          },
          py::arg("name"), py::kw_only(), py::arg("kind"), py::arg("type") = "",
          py::arg("longest_hold_ns") = 0, py::arg("frame") = "", py::arg("child_frame") = "",
          R"(Adds a resource of a kind; PluginRegistry.resource_kind tells its parameters.

`longest_hold_ns`: the longest execution for which one user holds its lock, for the timing analysis:
nothing enforces it. 0: what the resource's own code declares. `frame`, `child_frame`: those of its values;
ports that declare another frame are not connected, and messages in another frame are refused.)")
      .def(
          "connect",
          [](PyArchitecture& self, const std::string& component, const std::string& port,
             const std::string& resource,
             const std::string& service) { self.architecture.connect(component, port, resource, service); },
          py::arg("component"), py::arg("port"), py::arg("resource"), py::arg("service"), Unlocked())
      .def("commit", &commit_transaction, py::arg("transaction"),
           "Carries out a transaction, by the host if there is one; as Host.commit.")
      .def(
          "set_property",
          [](PyArchitecture& self, const std::string& component, const std::string& name,
             const PropertyValue& value) {
            self.architecture.component(component).set_property(name, value);
          },
          py::arg("component"), py::arg("name"), py::arg("value"), Unlocked(),
          "At once before the start, else in the component's next wait.")
      .def_property_readonly(
          "pointer",
          [](PyArchitecture& self) { return reinterpret_cast<std::uintptr_t>(&self.architecture); },
          "Its address, for other native modules.")
      .def(
          "publish",
          [](PyArchitecture& self, const std::string& resource) { self.architecture.publish(resource); },
          py::arg("resource"), Unlocked(), R"(Marks a resource as bound to an outgoing topic.

Host.wait_published yields what is written to it.)")
      .def(
          "subscribe",
          [](PyArchitecture& self, const std::string& resource) { self.architecture.subscribe(resource); },
          py::arg("resource"), Unlocked(),
          R"(Counts an incoming topic, which uses Host.write_resource, as a writer of a resource.

Refused for a latest_value that has one.)")
      .def(
          "configure", [](PyArchitecture& self) { self.architecture.configure(); }, Unlocked())
      .def(
          "cleanup",
          [](PyArchitecture& self) {
            const auto change =
                self.architecture.change_lock().join_alone();  // first: a hook may ask for a description
            const std::lock_guard lock(self.describing);
            self.architecture.cleanup();
          },
          Unlocked())
      .def(
          "describe", [](PyArchitecture& self) { return self.architecture.describe(); }, Unlocked(),
          "Components, implementations, wiring, properties, states, grids and resources, as of one moment.")
      .def(
          "authors",
          [](PyArchitecture& self) {
            std::vector<std::tuple<std::string, std::string, std::string>> found;
            for (const Authored& one : self.architecture.authors())
              found.emplace_back(one.target, one.element, one.author);
            return found;
          },
          R"((target, element, author) of what was changed since the file or program made it.

element: core, fsm, shell, state, "property NAME", "port NAME"; empty: the target itself.)")
      .def(
          "note_author",
          [](PyArchitecture& self, const Assignment& step, const std::string& author) {
            self.architecture.note_author({{.target = step.target, .name = "state"}, step}, author);
          },
          py::arg("step"), py::arg("author"), "Of a start or stop that was made without a transaction.")
      .def_property_readonly(
          "overlays", [](PyArchitecture& self) -> Overlays& { return self.architecture.overlays(); },
          py::return_value_policy::reference_internal)
      .def(
          "follow",
          [](PyArchitecture& self) {
            const Overlays::Look look = self.architecture.overlays().look();
            self.architecture.follow(look, self.architecture.describe());
          },
          Unlocked(), "Let the overlays know what has become of the architecture.")
      .def(
          "restore",
          [](PyArchitecture& self, const KeptState& state, const std::set<std::string>& rules) {
            return self.architecture.overlays().restore(state, rules, self.architecture.describe());
          },
          py::arg("state"), py::arg("rules"),
          R"(Puts what was kept in force, before a deployment; the bases that the file overrules.

`rules`: those that the executor has; another one stays active, of the source KEPT.)")
      .def(
          "restoring_steps",
          [](PyArchitecture& self) {
            return self.architecture.overlays().restoring_steps(self.architecture.describe());
          },
          "(author, step): what makes the architecture as it is wanted, without starts and stops.")
      .def(
          "note_overlays", [](PyArchitecture& self) { self.architecture.changes().bump(); },
          "Somebody changed what is wanted.")
      .def(
          "revision", [](PyArchitecture& self) { return self.architecture.revision(); },
          "Grows with every committed change and every start, stop and fault; never 0.")
      .def("is_configured", [](PyArchitecture& self) { return self.architecture.is_configured(); })
      .def(
          "threads_left_behind", [](PyArchitecture& self) { return self.architecture.threads_left_behind(); },
          "Threads of removed components that still run a timed-out execution.")
      .def("components", &describe_components)
      .def(
          "previewed_states",
          [](PyArchitecture& self, const std::string& component) {
            const InterpreterUnlocked unlocked;  // the fsm may be written in Python
            return self.architecture.component(component).previewed_states();
          },
          py::arg("component"),
          R"(The states that the component's fsm will have, before anything is configured.

Raises:
    MauveError: it cannot be so.)")
      .def("take_recent_maxima", &take_all_recent_maxima,
           "Of every component, and counted anew from here on: for one caller only.")
      .def("resources", &describe_resources);
}

}  // namespace mauve::bindings
