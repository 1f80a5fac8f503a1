// SPDX-License-Identifier: LGPL-3.0-or-later
// Parts by name, from libraries and from Python.
#include "python_call.hpp"
#include "serialized.hpp"

namespace mauve::bindings {

namespace {

/// A resource of a data type: the kernel's where a library registered the type, else a serialized one.
struct DataResource {
  std::string kind;
  ResourceParameters parameters;
  SerializedOptions serialized;
  bool has_zero;  // whether it can be serialized
};

std::unique_ptr<Resource> make_data_resource(const DataResource& data, const PluginRegistry& registry) {
  const std::vector<std::string> types = registry.names("type");
  if (data.has_zero && !std::binary_search(types.begin(), types.end(), data.serialized.type)) {
    return make_serialized_resource(data.kind, data.serialized);
  }
  return registry.make_resource(data.kind, data.serialized.type, data.parameters);
}

PartFactory factory_of(const py::object& part, const std::string& kind) {
  if (py::hasattr(part, "_part")) {
    auto factory = part.attr("_part")().cast<PartFactory>();
    if (factory.kind == kind) return factory;
  }
  throw py::type_error("expected a registered name or a class derived from the " + kind + " base, found " +
                       py::repr(part).cast<std::string>());
}

/// The same class under a name of the registry.
PartFactory factory_of(const py::object& part, const std::string& kind, const std::string& name) {
  return {kind, name, factory_of(part, kind).make};
}

}  // namespace

std::unique_ptr<Shell> make_shell(const py::object& part, const PluginRegistry& registry) {
  if (py::isinstance<py::str>(part)) return registry.make_shell(part.cast<std::string>());
  return make_python_shell(factory_of(part, "shell"), registry);
}
std::unique_ptr<CoreBase> make_core(const py::object& part, const PluginRegistry& registry) {
  if (py::isinstance<py::str>(part)) return registry.make_core(part.cast<std::string>());
  return make_python_core(factory_of(part, "core"));
}
std::unique_ptr<FsmBase> make_fsm(const py::object& part, const PluginRegistry& registry) {
  if (py::isinstance<py::str>(part)) return registry.make_fsm(part.cast<std::string>());
  return make_python_fsm(factory_of(part, "fsm"));
}
std::unique_ptr<Resource> make_resource(const py::object& part, const PluginRegistry& registry) {
  if (!PyType_Check(part.ptr()) && py::hasattr(part, "_instance_part")) {
    const py::object made = part.attr("_instance_part")();
    if (py::isinstance<DataResource>(made)) return make_data_resource(made.cast<DataResource>(), registry);
    return make_python_resource(made.cast<PartFactory>());
  }
  return make_python_resource(factory_of(part, "resource"));
}

Component::FsmFactory fsm_factory(const py::object& part, const PluginRegistry& registry) {
  const auto kept = std::make_shared<PythonObject>(part);
  return [kept, &registry] {
    const py::gil_scoped_acquire lock;
    return make_fsm(kept->get(), registry);
  };
}

void bind_registry(py::module_& module) {
  py::class_<PartFactory>(module, "PartFactory")
      .def(py::init([](const std::string& kind, const std::string& name, py::object make) {
             return PartFactory{kind, name, std::make_shared<PythonObject>(std::move(make))};
           }),
           py::arg("kind"), py::arg("name"), py::arg("make"))
      .def_readonly("kind", &PartFactory::kind)
      .def_readonly("name", &PartFactory::name);
  py::class_<DataResource>(module, "DataResource")
      .def(py::init([](const std::string& kind, const std::string& type, std::size_t capacity, bool overwrite,
                       std::size_t max_bytes, std::uint32_t max_readers,
                       const std::optional<std::string>& zero) {
             const std::string held = zero.value_or("");
             const auto bytes = std::as_bytes(std::span(held));
             return DataResource{
                 .kind = kind,
                 .parameters = {.capacity = capacity, .overwrite = overwrite, .max_readers = max_readers},
                 .serialized = {.type = type,
                                .zero = {bytes.begin(), bytes.end()},
                                .max_bytes = max_bytes,
                                .capacity = capacity,
                                .overwrite = overwrite},
                 .has_zero = zero.has_value()};
           }),
           py::kw_only(), py::arg("kind"), py::arg("type"), py::arg("capacity"), py::arg("overwrite"),
           py::arg("max_bytes"), py::arg("max_readers"), py::arg("zero"));
  py::class_<PluginRegistry>(module, "PluginRegistry")
      .def(py::init<>())
      .def("load_library", &PluginRegistry::load_library, py::arg("path"))
      .def(
          "add_python_core",
          [](PluginRegistry& self, const std::string& name, const std::string& shell, py::object factory) {
            const PartFactory part{"core", name, std::make_shared<PythonObject>(std::move(factory))};
            self.add_core(name, shell, [part] { return make_python_core(part); });
          },
          py::arg("name"), py::arg("shell"), py::arg("factory"))
      .def(
          "shell",
          [](PluginRegistry& self, const std::string& name, const py::object& shell) {
            const PartFactory part = factory_of(shell, "shell", name);
            self.add_shell(name, [part, &self] { return make_python_shell(part, self); });
          },
          py::arg("name"), py::arg("shell_class"))
      .def(
          "core",
          [](PluginRegistry& self, const std::string& name, const py::object& core,
             const std::string& shell_name) {
            const PartFactory part = factory_of(core, "core", name);
            self.add_core(name, shell_name, [part] { return make_python_core(part); });
          },
          py::arg("name"), py::arg("core_class"), py::arg("shell_name"))
      .def(
          "fsm",
          [](PluginRegistry& self, const std::string& name, const py::object& fsm,
             const std::string& shell_name) {
            const PartFactory part = factory_of(fsm, "fsm", name);
            self.add_fsm(name, shell_name, [part] { return make_python_fsm(part); });
          },
          py::arg("name"), py::arg("fsm_class"), py::arg("shell_name"))
      .def(
          "resource",
          [](PluginRegistry& self, const std::string& name, const py::object& resource) {
            const PartFactory part = factory_of(resource, "resource", name);
            self.add_resource(name, "",
                              [part](const ResourceParameters&) { return make_python_resource(part); });
          },
          py::arg("name"), py::arg("resource_class"))
      .def("names", &PluginRegistry::names, py::arg("kind"))
      .def("value_bytes", &PluginRegistry::value_bytes, py::arg("type"))
      .def(
          "describe_shell",
          [](const PluginRegistry& self, const std::string& name) {
            const py::gil_scoped_release release;  // ports have locks of their own
            const auto shell = self.make_shell(name);
            return ShellDescription{name, describe_ports(*shell), describe_properties(*shell)};
          },
          py::arg("name"))
      .def(
          "describe_resource",
          [](const PluginRegistry& self, const std::string& kind, const std::string& type) {
            return describe_resource(*self.make_resource(kind, type, {.capacity = 1}));
          },
          py::arg("kind"), py::arg("type"))
      .def(
          "describe_resource",
          [](const PluginRegistry& self, const py::object& resource) {
            return describe_resource(*make_resource(resource, self));
          },
          py::arg("resource"))
      .def("core_shell", &PluginRegistry::core_shell, py::arg("name"))
      .def("fsm_shell", &PluginRegistry::fsm_shell, py::arg("name"));
}

}  // namespace mauve::bindings
