// SPDX-License-Identifier: LGPL-3.0-or-later
#include "component.hpp"

#include "python_core.hpp"

namespace mauve::bindings {

namespace {

/// Runs a call that may wait, or come back to Python from another thread, without the interpreter's lock.
template <typename Call>
auto unlocked(const PyComponent& self, Call&& call) {
  Component& component = self.get();
  const InterpreterUnlocked release;
  return call(component);
}

py::object shell_of(const PyComponent& self) {
  const auto* python = dynamic_cast<const PythonShell*>(&self.get().shell());
  return python != nullptr ? python->object() : py::none();
}

StepReport swap_core(const PyComponent& self, const AnyCore& core, time_ns_t commit_timeout_ns,
                     time_ns_t phase_timeout_ns) {
  std::unique_ptr<CoreBase> fresh = make_core(core, self.architecture().registry);
  return unlocked(self, [&](Component& component) {
    return component.swap_core(std::move(fresh),
                               {.commit_ns = commit_timeout_ns, .phase_ns = phase_timeout_ns});
  });
}

}  // namespace

void bind_component(py::module_& module) {
  py::class_<PyComponent>(
      module, "Component",
      "One component of an architecture, by name: it keeps the architecture. For ordinary threads.")
      .def_property_readonly("name", &PyComponent::name)
      .def_property_readonly("shell", &shell_of, "Its shell's object; None when that is written in C++.")
      .def_property_readonly(
          "core", [](const PyComponent& self) { return PythonCore::object_of(self.get().core()); },
          "Its core's object; None when that is written in C++. Not while somebody replaces the core.")
      .def_property_readonly(
          "state", [](const PyComponent& self) { return std::string(to_string(self.get().task().state())); },
          "As ComponentDescription.state.")
      .def(
          "get_time", [](const PyComponent& self) { return self.get().task().get_time(); },
          "The nominal instant of the last entry of the initial state.")
      .def("describe",
           [](const PyComponent& self) {
             return unlocked(self, [&self](Component& component) {
               const std::lock_guard lock(self.describing());
               return describe_component(component);
             });
           })
      .def("is_configured", [](const PyComponent& self) { return self.get().is_configured(); })
      .def("configure",
           [](const PyComponent& self) {
             unlocked(self, [](Component& component) { component.configure(); });
           })
      .def("cleanup",
           [](const PyComponent& self) {
             unlocked(self, [&self](Component& component) {
               const auto change = self.architecture().architecture.change_lock().join_alone();  // before it
               const std::lock_guard lock(self.describing());
               component.cleanup();
             });
           })
      .def(
          "set_property",
          [](const PyComponent& self, const std::string& name, const PropertyValue& value) {
            unlocked(self, [&](Component& component) { component.set_property(name, value); });
          },
          py::arg("name"), py::arg("value"), "At once before the start, else in the component's next wait.")
      .def(
          "cleanup_core",
          [](const PyComponent& self) {
            unlocked(self, [](Component& component) { component.cleanup_core(); });
          },
          "Listing 3 of the paper: of a stopped component, cleanup_core, replace_core, configure_core.")
      .def(
          "replace_core",
          [](const PyComponent& self, const AnyCore& core) {
            std::unique_ptr<CoreBase> fresh = make_core(core, self.architecture().registry);
            unlocked(self, [&](Component& component) { component.replace_core(std::move(fresh)); });
          },
          py::arg("core"))
      .def("configure_core",
           [](const PyComponent& self) {
             unlocked(self, [](Component& component) { component.configure_core(); });
           })
      .def("swap_core", &swap_core, py::arg("core"), py::kw_only(), py::arg("commit_timeout_ns") = s_to_ns(1),
           py::arg("phase_timeout_ns") = s_to_ns(1),
           "Replaces the core in flight: prepare, commit inside a wait, retire the old one.");
}

}  // namespace mauve::bindings
