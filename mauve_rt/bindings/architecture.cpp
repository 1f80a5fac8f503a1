// SPDX-License-Identifier: LGPL-3.0-or-later
// Architectures and their components.
#include "component.hpp"
#include "transaction.hpp"

namespace mauve::bindings {

namespace {

// A lock that a call may wait for is never waited for under the interpreter's lock.
using Unlocked = py::call_guard<py::gil_scoped_release>;

/// Whether a port takes a lock depends on all ports of its service, and changes with them.
void describe_locking(const Architecture& architecture, std::vector<PortDescription>& ports) {
  for (PortDescription& port : ports) {
    const auto resource = architecture.find_resource(port.resource);
    const ServiceBase* service = resource == nullptr ? nullptr : resource->find_service(port.service);
    port.wait_free = service != nullptr && service->is_wait_free();
  }
}

std::vector<ComponentDescription> describe_components(PyArchitecture& self) {
  const py::gil_scoped_release release;
  const std::lock_guard lock(self.describing);
  std::vector<ComponentDescription> all;
  for (const auto& component : self.architecture.components()) {
    all.push_back(describe_component(*component));
    describe_locking(self.architecture, all.back().ports);
  }
  return all;
}

std::vector<RecentMaxima> take_all_recent_maxima(PyArchitecture& self) {
  const py::gil_scoped_release release;
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
  const py::gil_scoped_release release;
  self.architecture.commit_one(std::move(transaction));
}

/// A whole transaction without a host; where there is one, by it.
TransactionReport commit_transaction(PyArchitecture& self, const PyTransaction& steps) {
  Transaction transaction = steps.build(self.registry);
  const py::gil_scoped_release release;
  return self.architecture.commit(std::move(transaction));
}

}  // namespace

void bind_architecture(py::module_& module) {
  bind_component(module);
  py::class_<PyArchitecture>(module, "Architecture")
      .def(py::init<PluginRegistry&>(), py::arg("registry"), py::keep_alive<1, 2>())
      .def(
          "add_component",
          [](const py::object& object, const std::string& name, const py::object& shell,
             const py::object& core, const py::object& fsm, const std::vector<std::string>& alternatives,
             const py::object& fallback, bool reconfigurable, const py::kwargs& settings) {
            auto& self = object.cast<PyArchitecture&>();
            const PluginRegistry& registry = self.registry;
            std::unique_ptr<CoreBase> fallback_core;
            if (!fallback.is_none()) fallback_core = make_core(fallback, registry);
            const ComponentParts rest{.settings = task_settings(name, settings),
                                      .alternatives = alternatives,
                                      .reconfigurable = reconfigurable};
            Transaction transaction;
            transaction.add_component(name,
                                      Parts{.shell = make_shell(shell, registry),
                                            .core = make_core(core, registry),
                                            .fsm = make_fsm(fsm, registry)},
                                      rest, fsm_factory(fsm, registry), std::move(fallback_core));
            commit_one(self, std::move(transaction));
            return PyComponent(object, name);
          },
          py::arg("name"), py::arg("shell"), py::arg("core"), py::arg("fsm"), py::kw_only(),
          py::arg("alternatives") = std::vector<std::string>{}, py::arg("fallback") = py::none(),
          py::arg("reconfigurable") = true)
      .def(
          "component",
          [](const py::object& object, const std::string& name) {
            static_cast<void>(object.cast<PyArchitecture&>().architecture.component(name));
            return PyComponent(object, name);
          },
          py::arg("name"))
      .def(
          "add_resource",
          [](PyArchitecture& self, const std::string& name, const py::object& resource,
             time_ns_t longest_hold_ns) {
            Transaction transaction;
            transaction.add_resource(name, make_resource(resource, self.registry), TopicBinding::none,
                                     longest_hold_ns);
            commit_one(self, std::move(transaction));
          },
          py::arg("name"), py::arg("resource"), py::kw_only(), py::arg("longest_hold_ns") = 0)
      .def(
          "add_resource",
          [](PyArchitecture& self, const std::string& name, const std::string& kind, const std::string& type,
             time_ns_t longest_hold_ns, const py::kwargs& keywords) {
            Transaction transaction;
            transaction.add_resource(name, self.registry.make_resource(kind, type, parameters_of(keywords)),
                                     TopicBinding::none, longest_hold_ns);
            commit_one(self, std::move(transaction));
          },
          py::arg("name"), py::kw_only(), py::arg("kind"), py::arg("type") = "",
          py::arg("longest_hold_ns") = 0)
      .def(
          "connect",
          [](PyArchitecture& self, const std::string& component, const std::string& port,
             const std::string& resource,
             const std::string& service) { self.architecture.connect(component, port, resource, service); },
          py::arg("component"), py::arg("port"), py::arg("resource"), py::arg("service"), Unlocked())
      .def("commit", &commit_transaction, py::arg("transaction"))
      .def(
          "set_property",
          [](PyArchitecture& self, const std::string& component, const std::string& name,
             const PropertyValue& value) {
            self.architecture.component(component).set_property(name, value);
          },
          py::arg("component"), py::arg("name"), py::arg("value"), Unlocked())
      .def_property_readonly(
          "pointer",
          [](PyArchitecture& self) { return reinterpret_cast<std::uintptr_t>(&self.architecture); })
      .def(
          "publish",
          [](PyArchitecture& self, const std::string& resource) { self.architecture.publish(resource); },
          py::arg("resource"), Unlocked())
      .def(
          "subscribe",
          [](PyArchitecture& self, const std::string& resource) { self.architecture.subscribe(resource); },
          py::arg("resource"), Unlocked())
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
          "describe", [](PyArchitecture& self) { return self.architecture.describe(); }, Unlocked())
      .def("authors",
           [](PyArchitecture& self) {
             std::vector<std::tuple<std::string, std::string, std::string>> found;
             for (const Authored& one : self.architecture.authors())
               found.emplace_back(one.target, one.element, one.author);
             return found;
           })
      .def(
          "note_author",
          [](PyArchitecture& self, const std::string& target, const std::string& element,
             const std::string& author) { self.architecture.note_author(target, element, author); },
          py::arg("target"), py::arg("element"), py::arg("author"))
      .def("revision", [](PyArchitecture& self) { return self.architecture.revision(); })
      .def("is_configured", [](PyArchitecture& self) { return self.architecture.is_configured(); })
      .def("threads_left_behind",
           [](PyArchitecture& self) { return self.architecture.threads_left_behind(); })
      .def("components", &describe_components)
      .def(
          "previewed_states",
          [](PyArchitecture& self, const std::string& component) {
            const py::gil_scoped_release unlocked;  // the fsm may be written in Python
            return self.architecture.component(component).previewed_states();
          },
          py::arg("component"))
      .def("take_recent_maxima", &take_all_recent_maxima)
      .def("resources", &describe_resources);
}

}  // namespace mauve::bindings
