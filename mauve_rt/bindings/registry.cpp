// SPDX-License-Identifier: LGPL-3.0-or-later
// Parts by name, from libraries and from Python.
#include "python_call.hpp"
#include "serialized.hpp"

namespace mauve::bindings {

namespace {

/// A resource of a data type: the kernel's where a library registered the type, else a serialized one.
struct DataResource {
  std::string kind;
  std::string type;
  ResourceParameters parameters;
  std::vector<Message> zeros;  // as of SerializedOptions; none: it cannot be serialized
  int frame_ids{0};            // as of SerializedOptions
};

std::unique_ptr<Resource> make_data_resource(const DataResource& data, const PluginRegistry& registry) {
  const TypeNeed need = registry.resource_kind(data.kind).type;
  if (need != TypeNeed::none && data.zeros.size() == messages_of(need)) {
    const std::vector<std::string> types = registry.names(std::string(to_string(need)));
    if (!std::binary_search(types.begin(), types.end(), data.type)) {
      const ResourceParameters all = registry.checked_parameters(data.kind, data.parameters);
      return make_serialized_resource(
          data.kind,
          {.type = data.type, .zeros = data.zeros, .parameters = all, .frame_ids = data.frame_ids});
    }
  }
  return registry.make_resource(data.kind, data.type, data.parameters);
}

/// How a resource's own object is made into one of the kernel; None of a class.
py::object instance_part(const py::object& resource) {
  if (PyType_Check(resource.ptr()) || !py::hasattr(resource, "_instance_part")) return py::none();
  return resource.attr("_instance_part")();
}

/// For a resource that is made only to be described.
ResourceParameters parameters_needed(const ResourceKind& kind, const std::vector<std::string>& sequences) {
  ResourceParameters needed;
  for (const std::string& path : sequences) needed.emplace("capacity." + path, std::int64_t{1});
  for (const ResourceParameter& parameter : kind.parameters) {
    if (parameter.is_required) needed.emplace(parameter.name, parameter.initial);
  }
  return needed;
}

/// The parameters that a resource class in Python declares.
std::vector<ResourceParameter> declared_parameters(const py::object& resource) {
  return resource.attr("_parameters")().cast<std::vector<ResourceParameter>>();
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
  PartFactory factory = factory_of(part, kind);
  factory.name = name;
  return factory;
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
  const py::object made = instance_part(part);
  if (made.is_none()) return make_python_resource(factory_of(part, "resource"));
  if (py::isinstance<DataResource>(made)) return make_data_resource(made.cast<DataResource>(), registry);
  return make_python_resource(made.cast<PartFactory>());
}

void bind_resource_kinds(py::module_& module) {
  py::class_<ResourceParameter>(module, "ResourceParameter", "What one resource of a kind can be told.")
      .def(py::init([](const std::string& name, const PropertyValue& initial, const std::string& unit,
                       const std::string& description, std::optional<double> minimum,
                       std::optional<double> maximum, bool required) {
             return ResourceParameter{.name = name,
                                      .initial = initial,
                                      .description = description,
                                      .unit = unit,
                                      .minimum = minimum,
                                      .maximum = maximum,
                                      .is_required = required};
           }),
           py::arg("name"), py::arg("initial"), py::kw_only(), py::arg("unit") = "",
           py::arg("description") = "", py::arg("minimum") = std::nullopt, py::arg("maximum") = std::nullopt,
           py::arg("required") = false)
      .def_readonly("name", &ResourceParameter::name)
      .def_property_readonly(
          "type", [](const ResourceParameter& self) { return std::string(property_type_name(self.initial)); },
          "As PropertyDescription.type.")
      .def_readonly("initial", &ResourceParameter::initial, "Unless told otherwise.")
      .def_readonly("description", &ResourceParameter::description)
      .def_readonly("unit", &ResourceParameter::unit)
      .def_readonly("minimum", &ResourceParameter::minimum)
      .def_readonly("maximum", &ResourceParameter::maximum)
      .def_readonly("required", &ResourceParameter::is_required)
      .def_readonly("values_each", &ResourceParameter::values_each,
                    "So many values more take memory, for each one that it counts.")
      .def_readonly("limits_readers", &ResourceParameter::is_reader_limit,
                    "So many ports may connect to the service `read`.")
      .def_property_readonly(
          "file_key",
          [](const ResourceParameter& self) { return self.file_key.empty() ? self.name : self.file_key; },
          "Its key in architecture files: `capacity`, or `service.timeout_ms`.");
  py::class_<ResourceKind>(module, "ResourceKind", "What a kind of resource tells of itself.")
      .def_readonly("name", &ResourceKind::name)
      .def_readonly("parameters", &ResourceKind::parameters)
      .def_property_readonly(
          "type_kind", [](const ResourceKind& self) { return std::string(to_string(self.type)); },
          "Of what its type is: 'type', 'call_type' or 'action_type' of a registry; '': it has none.")
      .def_readonly("messages", &ResourceKind::messages,
                    "As which its topic may say it, the last where no type is given.")
      .def_readonly("values", &ResourceKind::values,
                    "So many take memory, besides those that parameters count.")
      .def_readonly("has_one_writer", &ResourceKind::has_one_writer);
  module.def("given_resource_kinds", &PluginRegistry::given_resource_kinds,
             "The kinds that the kernel gives, in their order.");
}

void bind_registry(py::module_& module) {
  bind_resource_kinds(module);
  py::class_<PartFactory>(module, "PartFactory", "How to make a part written in Python.")
      .def(py::init([](const Typed<"typing.Literal['shell', 'core', 'fsm', 'resource']">& kind,
                       const std::string& name, Typed<"typing.Callable[..., object]"> make,
                       CoreTimes wcet_ns) {
             return PartFactory{kind.cast<std::string>(), name,
                                std::make_shared<PythonObject>(std::move(make)), std::move(wcet_ns)};
           }),
           py::arg("kind"), py::arg("name"), py::arg("make"), py::arg("wcet_ns") = CoreTimes{})
      .def_readonly("kind", &PartFactory::kind)
      .def_readonly("name", &PartFactory::name);
  py::class_<DataResource>(
      module, "DataResource",
      R"(A resource of a data type. `zeros`: the message's default, serialized; empty when it is no message.

Of an action the defaults of its goal, result and feedback.

`frame_ids`: 1 if the message begins with a header, 2 if child_frame_id follows the header; else 0.)")
      .def(py::init([](const std::string& kind, const std::string& type,
                       const Typed<"dict[str, bool | int | float | str]">& parameters,
                       const std::vector<py::bytes>& zeros, int frame_ids) {
             DataResource made{.kind = kind,
                               .type = type,
                               .parameters = parameters_of(py::dict(parameters)),
                               .zeros = {},
                               .frame_ids = frame_ids};
             for (const std::string_view zero : zeros) {
               const auto bytes = std::as_bytes(std::span(zero));
               made.zeros.emplace_back(bytes.begin(), bytes.end());
             }
             return made;
           }),
           py::kw_only(), py::arg("kind"), py::arg("type"), py::arg("parameters"), py::arg("zeros"),
           py::arg("frame_ids") = 0);
  py::class_<PluginGeneration, std::shared_ptr<PluginGeneration>>(
      module, "PluginGeneration",
      "Entries of a registry that are not in force: after begin_generation() those of before.")
      .def(py::init<>());
  py::class_<PluginRegistry>(module, "PluginRegistry")
      .def(py::init<>())
      .def("load_library", &PluginRegistry::load_library, py::arg("path"),
           R"(Opens a plug-in library (RTLD_NOW | RTLD_LOCAL, never closed).

A second call for one path does nothing.)")
      .def("begin_generation", &PluginRegistry::begin_generation, py::arg("number"), py::arg("replaced"),
           "Lets what is added take the place of entries of the same name, until end_generation().")
      .def("end_generation", &PluginRegistry::end_generation)
      .def("drop", &PluginRegistry::drop, py::arg("kind"), py::arg("name"),
           "Within a generation: takes out what the new code has no more.")
      .def("exchange", &PluginRegistry::exchange, py::arg("other"),
           "Puts the kept entries in force and keeps those that go out.")
      .def("generation_of", &PluginRegistry::generation_of, py::arg("kind"), py::arg("name"),
           "1 as first loaded; 0: there is no such entry.")
      .def("classes_of", &PluginRegistry::classes_of, py::arg("kind"), py::arg("name"),
           "The C++ class of a shell or core and its bases, of an fsm those of its core, by the compiler's "
           "names.")
      .def("type_shapes", &PluginRegistry::type_shapes, "The structs of the registered data types.")
      .def(
          "add_python_core",
          [](PluginRegistry& self, const std::string& name, const std::string& shell,
             Typed<"typing.Callable[[ShellView], object]"> factory, CoreTimes wcet_ns) {
            const PartFactory part{"core", name, std::make_shared<PythonObject>(std::move(factory))};
            self.add_core(name, shell, [part] { return make_python_core(part); }, {},
                          {.wcet_ns = std::move(wcet_ns)});
          },
          py::arg("name"), py::arg("shell"), py::arg("factory"), py::arg("wcet_ns") = CoreTimes{},
          R"(factory(shell_view) -> core object. `wcet_ns`: as Core.wcet_ns.

Its actions run on the component's thread under the interpreter's lock.)")
      .def(
          "shell",
          [](PluginRegistry& self, const std::string& name,
             const Typed<"type[mauve_rt.parts.shells.Shell]">& shell) {
            const PartFactory part = factory_of(shell, "shell", name);
            self.add_shell(name, [part, &self] { return make_python_shell(part, self); });
          },
          py::arg("name"), py::arg("shell_class"), "Registers a class under a name, package/Class.")
      .def(
          "core",
          [](PluginRegistry& self, const std::string& name,
             const Typed<"type[mauve_rt.parts.cores.Core[typing.Any]]">& core,
             const std::string& shell_name) {
            const PartFactory part = factory_of(core, "core", name);
            self.add_core(name, shell_name, [part] { return make_python_core(part); }, {},
                          {.wcet_ns = part.wcet_ns});
          },
          py::arg("name"), py::arg("core_class"), py::arg("shell_name"))
      .def(
          "fsm",
          [](PluginRegistry& self, const std::string& name,
             const Typed<"type[mauve_rt.parts.fsms.Fsm[typing.Any, typing.Any]]">& fsm,
             const std::string& shell_name) {
            const PartFactory part = factory_of(fsm, "fsm", name);
            self.add_fsm(name, shell_name, [part] { return make_python_fsm(part); });
          },
          py::arg("name"), py::arg("fsm_class"), py::arg("shell_name"))
      .def(
          "resource",
          [](PluginRegistry& self, const std::string& name,
             const Typed<"type[mauve_rt.parts.resources.Resource]">& resource) {
            const PartFactory part = factory_of(resource, "resource", name);
            self.add_resource(
                {.name = name, .parameters = declared_parameters(resource)},
                [part](const ResourceParameters& given) { return make_python_resource(part, given); });
          },
          py::arg("name"), py::arg("resource_class"),
          "`name` is its kind in architecture files, its parameters are the keys.")
      .def("names", &PluginRegistry::names, py::arg("kind"),
           "kind: 'shell', 'core', 'fsm', 'resource', 'type'.")
      .def("resource_kind", &PluginRegistry::resource_kind, py::arg("name"), py::return_value_policy::copy,
           "Given, or registered.")
      .def("value_bytes", &PluginRegistry::value_bytes, py::arg("type"),
           py::arg("capacities") = ResourceParameters{},
           R"(What a value of a registered data type takes, in bytes; 0 when it is none.

`capacities`: of its sequences, as `capacity.markers.points`.)")
      .def("sequences", &PluginRegistry::sequences, py::arg("type"),
           "The sequences of a registered data type, whose capacities its resources need, as "
           "`markers.points`.")
      .def(
          "describe_shell",
          [](const PluginRegistry& self, const std::string& name) {
            const InterpreterUnlocked release;  // ports have locks of their own
            const auto shell = self.make_shell(name);
            return ShellDescription{name, describe_ports(*shell), describe_properties(*shell),
                                    shell->bytes()};
          },
          py::arg("name"))
      .def(
          "describe_core",
          [](const PluginRegistry& self, const std::string& name) {
            const InterpreterUnlocked release;
            const auto shell = self.make_shell(self.core_shell(name));
            return describe_core(*self.make_core(name), *shell, self);
          },
          py::arg("name"))
      .def(
          "describe_fsm",
          [](const PluginRegistry& self, const std::string& name) {
            const InterpreterUnlocked release;
            const auto shell = self.make_shell(self.fsm_shell(name));
            const auto fsm = self.make_fsm(name);
            if (!fsm->bind_shell(*shell)) {
              throw Error(ErrorCode::type_mismatch, "the fsm does not run its shell",
                          {.element = fsm->description(), .found = shell->implementation()});
            }
            fsm->configure();
            return fsm->describe_states();
          },
          py::arg("name"), "Its states, with the shell's properties as they are unless set.")
      .def(
          "check_max_slew",
          [](const PluginRegistry& self, const std::string& shell,
             const std::map<std::string, double>& max_slew) {
            const InterpreterUnlocked release;
            SlewedOutputs({max_slew.begin(), max_slew.end()}, {}).limit(*self.make_shell(shell), {});
          },
          py::arg("shell"), py::arg("max_slew"),
          "Raises MauveError unless a component with this shell can have it.")
      .def(
          "describe_resource",
          [](const PluginRegistry& self, const std::string& kind, const std::string& type) {
            const ResourceParameters needed =
                parameters_needed(self.resource_kind(kind), self.sequences(type));
            return describe_resource(*self.make_resource(kind, type, needed));
          },
          py::arg("kind"), py::arg("type"))
      .def(
          "describe_resource",
          [](const PluginRegistry& self, const AnyResource& resource) {
            const py::object part = instance_part(resource);
            if (!py::isinstance<DataResource>(part)) return describe_resource(*make_resource(resource, self));
            auto data = part.cast<DataResource>();
            data.parameters =  // as large as it must be
                parameters_needed(self.resource_kind(data.kind), self.sequences(data.type));
            return describe_resource(*make_data_resource(data, self));
          },
          py::arg("resource"))
      .def("core_shell", &PluginRegistry::core_shell, py::arg("name"),
           "Name of the shell a core was written for.")
      .def("fsm_shell", &PluginRegistry::fsm_shell, py::arg("name"));
}

}  // namespace mauve::bindings
