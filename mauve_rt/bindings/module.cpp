// SPDX-License-Identifier: LGPL-3.0-or-later
// mauve_rt._kernel; its interface with docs is _kernel.pyi.
#include "translate.hpp"

namespace mauve::bindings {

namespace {

// A lock that a call may wait for is never waited for under the interpreter's lock.
using Unlocked = py::call_guard<py::gil_scoped_release>;

OverrunPolicy overrun_policy(const std::string& name) {
  if (name == "skip") return OverrunPolicy::skip;
  if (name == "catch_up") return OverrunPolicy::catch_up;
  if (name == "fault") return OverrunPolicy::fault;
  throw Error(ErrorCode::invalid_argument, "there is no such overrun policy",
              {.element = "overrun", .expected = "skip, catch_up or fault", .found = name});
}

void bind_registry(py::module_& module) {
  py::class_<PluginRegistry>(module, "PluginRegistry")
      .def(py::init<>())
      .def("load_library", &PluginRegistry::load_library, py::arg("path"))
      .def(
          "add_python_core",
          [](PluginRegistry& self, const std::string& name, const std::string& shell, py::object factory) {
            // Shared, and given back under the interpreter's lock wherever the registry ends.
            const std::shared_ptr<py::object> kept(new py::object(std::move(factory)),
                                                   [](py::object* object) {
                                                     const py::gil_scoped_acquire lock;
                                                     delete object;
                                                   });
            self.add_core(name, shell, [kept] {
              const py::gil_scoped_acquire lock;
              return make_python_core(*kept);
            });
          },
          py::arg("name"), py::arg("shell"), py::arg("factory"))
      .def("names", &PluginRegistry::names, py::arg("kind"))
      .def(
          "describe_shell",
          [](const PluginRegistry& self, const std::string& name) {
            const auto shell = self.make_shell(name);
            return ShellDescription{name, describe_ports(*shell), describe_properties(*shell)};
          },
          py::arg("name"))
      .def(
          "describe_resource",
          [](const PluginRegistry& self, const std::string& kind, const std::string& type) {
            return describe_resource(*self.make_resource(kind, type, {.capacity = 1, .overwrite = false}));
          },
          py::arg("kind"), py::arg("type"))
      .def("core_shell", &PluginRegistry::core_shell, py::arg("name"))
      .def("fsm_shell", &PluginRegistry::fsm_shell, py::arg("name"));
}

void bind_architecture(py::module_& module) {
  py::class_<PyArchitecture>(module, "Architecture")
      .def(py::init<PluginRegistry&>(), py::arg("registry"), py::keep_alive<1, 2>())
      .def(
          "add_component",
          [](PyArchitecture& self, const std::string& name, const std::string& shell, const std::string& core,
             const std::string& fsm, int priority, const std::vector<int>& cpus, time_ns_t offset_ns,
             time_ns_t period_ns, const std::string& overrun, std::int64_t max_backlog,
             std::size_t stack_bytes, const std::vector<std::string>& alternatives, bool reconfigurable) {
            Component& component =
                self.architecture.add_component(name, shell, core, fsm,
                                                TaskSettings{.priority = priority,
                                                             .cpus = cpus,
                                                             .offset_ns = offset_ns,
                                                             .period_ns = period_ns,
                                                             .overrun = overrun_policy(overrun),
                                                             .max_backlog = max_backlog,
                                                             .stack_bytes = stack_bytes});
            component.allow(alternatives, reconfigurable);
          },
          py::arg("name"), py::kw_only(), py::arg("shell"), py::arg("core"), py::arg("fsm"),
          py::arg("priority") = 50, py::arg("cpus") = std::vector<int>{}, py::arg("offset_ns") = 0,
          py::arg("period_ns") = 0, py::arg("overrun") = "skip", py::arg("max_backlog") = 10,
          py::arg("stack_bytes") = TaskSettings{}.stack_bytes,
          py::arg("alternatives") = std::vector<std::string>{}, py::arg("reconfigurable") = true)
      .def(
          "add_resource",
          [](PyArchitecture& self, const std::string& name, const std::string& kind, const std::string& type,
             std::size_t capacity, bool overwrite) {
            self.architecture.add_resource(
                name,
                self.registry.make_resource(kind, type, {.capacity = capacity, .overwrite = overwrite}));
          },
          py::arg("name"), py::kw_only(), py::arg("kind"), py::arg("type") = "", py::arg("capacity") = 0,
          py::arg("overwrite") = false)
      .def(
          "connect",
          [](PyArchitecture& self, const std::string& component, const std::string& port,
             const std::string& resource,
             const std::string& service) { self.architecture.connect(component, port, resource, service); },
          py::arg("component"), py::arg("port"), py::arg("resource"), py::arg("service"))
      .def(
          "set_property",
          [](PyArchitecture& self, const std::string& component, const std::string& name,
             const PropertyValue& value) {
            self.architecture.component(component).set_property(name, value);
          },
          py::arg("component"), py::arg("name"), py::arg("value"))
      .def(
          "publish",
          [](PyArchitecture& self, const std::string& resource) { self.architecture.publish(resource); },
          py::arg("resource"))
      .def(
          "configure", [](PyArchitecture& self) { self.architecture.configure(); }, Unlocked())
      .def(
          "cleanup", [](PyArchitecture& self) { self.architecture.cleanup(); }, Unlocked())
      .def("components",
           [](PyArchitecture& self) {
             const py::gil_scoped_release release;
             std::vector<ComponentDescription> all;
             for (const auto& component : self.architecture.components())
               all.push_back(describe_component(*component));
             return all;
           })
      .def("resources", [](PyArchitecture& self) {
        std::vector<ResourceDescription> all;
        for (const auto& resource : self.architecture.resources())
          all.push_back(describe_resource(*resource));
        return all;
      });
}

}  // namespace

}  // namespace mauve::bindings

PYBIND11_MODULE(_kernel, module) {
  using namespace mauve::bindings;
  module.doc() = "The native kernel, translated one to one. Times are int64 nanoseconds of CLOCK_MONOTONIC.";
  bind_errors(module);
  bind_descriptions(module);
  bind_python_core(module);
  bind_registry(module);
  bind_architecture(module);
  bind_deployer(module);
  module.attr("NOT_MEASURED") = mauve::kNotMeasured;
  module.def("monotonic_ns", &mauve::monotonic_now_ns);
}
