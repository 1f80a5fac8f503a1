// SPDX-License-Identifier: LGPL-3.0-or-later
// Shells written in Python, and what Python objects see of the shell of their component.
#include "log.hpp"
#include "python_call.hpp"
#include "python_resource.hpp"
#include "request_port.hpp"
#include "serialized.hpp"

namespace mauve::bindings {

namespace {

std::span<const std::byte> as_bytes_view(std::string_view data) { return std::as_bytes(std::span(data)); }

OutputPolicy output_policy(const std::string& name, const char* element) {
  if (name == "hold") return OutputPolicy::hold;
  if (name == "set_zero") return OutputPolicy::set_zero;
  throw Error(ErrorCode::invalid_argument, "there is no such output policy",
              {.element = element, .expected = "hold or set_zero", .found = name});
}

ReadBy read_by(const std::vector<std::string>& parts) {
  ReadBy all = ReadBy::none;
  for (const std::string& part : parts) {
    const ReadBy one = part == "shell"  ? ReadBy::shell
                       : part == "core" ? ReadBy::core
                       : part == "fsm"  ? ReadBy::fsm
                                        : ReadBy::none;
    if (one == ReadBy::none) {
      throw Error(ErrorCode::invalid_argument, "a component has no such part",
                  {.element = "structural", .expected = "shell, core or fsm", .found = part});
    }
    all = all | one;
  }
  return all;
}

/// Handed to the Python object while it declares itself.
class ShellBuilder {
 public:
  ShellBuilder(PythonShell& shell, const PluginRegistry& registry) : shell_(shell), registry_(registry) {}

  void read_port(const std::string& name, const std::string& type, const std::optional<py::bytes>& zero,
                 bool optional, const std::string& frame, const std::string& child_frame) {
    data_port(PortKind::read, name, type, {}, zero, optional);
    shell_.find_port(name)->declare_frames({.frame = frame, .child_frame = child_frame});
  }
  void write_port(const std::string& name, const std::string& type, const std::optional<py::bytes>& zero,
                  const std::string& on_commit, const std::string& on_stop, bool optional,
                  const std::string& frame, const std::string& child_frame) {
    data_port(
        PortKind::write, name, type,
        {.on_commit = output_policy(on_commit, "on_commit"), .on_stop = output_policy(on_stop, "on_stop")},
        zero, optional);
    shell_.find_port(name)->declare_frames({.frame = frame, .child_frame = child_frame});
  }
  void call_port(const std::string& name, const std::string& type) {
    shell_.add_port(std::make_unique<PythonCallPort>(name, type));
  }
  void request_port(const std::string& name, const std::string& type) {
    shell_.add_port(std::make_unique<RequestPort>(name, type));
  }
  void event_port(const std::string& name, bool optional) {
    EventPort& port = shell_.event_port(name);
    if (optional) port.make_optional();
  }
  void property(const std::string& name, const PropertyValue& value, const std::string& unit,
                const std::string& description, std::optional<double> minimum, std::optional<double> maximum,
                const std::vector<std::string>& structural) {
    const PropertyOptions options{unit, description, minimum, maximum, read_by(structural)};
    std::visit([&](const auto& initial) { add_property(name, initial, options); }, value);
    static_cast<void>(shell_.find_property(name)->checked(value));  // the default is in the range, too
  }

 private:
  template <typename T>
  void add_property(const std::string& name, const T& initial, const PropertyOptions& options) {
    shell_.property(name, initial, options);
  }
  void add_property(const std::string& name, const std::string& initial, const PropertyOptions& options) {
    shell_.property(name, initial.c_str(), options);
  }
  /// C++ has the type where a plug-in registered it; a message that none registered travels serialized.
  void data_port(PortKind kind, const std::string& name, const std::string& type, OutputOptions output,
                 const std::optional<py::bytes>& zero, bool optional) {
    const std::vector<std::string> registered = registry_.names("type");
    if (zero.has_value() && !std::binary_search(registered.begin(), registered.end(), type)) {
      shell_.add_port(make_serialized_port(kind, name, type, output, as_bytes_view(*zero)));
    } else {
      shell_.add_port(registry_.make_port(kind, type, name, output));
    }
    if (optional) shell_.find_port(name)->make_optional();
  }

  PythonShell& shell_;
  const PluginRegistry& registry_;
};

}  // namespace

PythonShell::PythonShell(const PartFactory& factory, const PluginRegistry& registry)
    : link_(std::make_shared<ShellLink>(ShellLink{.shell = this})) {
  set_implementation(factory.name);
  in_python([&] {
    object_.set(factory.make->get()());
    ShellBuilder builder(*this, registry);
    object_.get().attr("_declare")(py::cast(builder, py::return_value_policy::reference));
    object_.get().attr("_bind")(ShellView(link_));
  });
}

PythonShell::~PythonShell() {
  const InterpreterLocked lock;
  link_->shell = nullptr;
  link_->context = nullptr;
}

bool PythonShell::configure_hook() {
  return in_python([&] { return call_hook(object(), "configure"); });
}
void PythonShell::cleanup_hook() {
  in_python([&] { call_hook(object(), "cleanup"); });
}

Shell& ShellView::shell() const {
  if (link_->shell != nullptr) return *link_->shell;
  throw Error(ErrorCode::not_configured, "the component of this shell is gone",
              {.remedy = "keep no core or shell longer than its component"});
}

PortBase& ShellView::require_port(const std::string& name, PortKind kind) const {
  PortBase* port = shell().find_port(name);
  if (port == nullptr) throw py::key_error("the shell has no port '" + name + "'");
  if (port->kind() != kind) {
    throw py::type_error("port '" + name + "' is a " + std::string(to_string(port->kind())) + " port");
  }
  return *port;
}

ReadMessage ShellView::read(const std::string& name) const {
  PortBase& port = require_port(name, PortKind::read);
  std::vector<std::byte> message;
  DataStatus status = DataStatus::none;
  time_ns_t time_ns = 0;
  {
    const InterpreterUnlocked release;  // the resource has a lock of its own
    port.read_serialized(message, status, time_ns);
  }
  return py::make_tuple(to_bytes(message), static_cast<int>(status), time_ns);
}

bool ShellView::write(const std::string& name, const py::bytes& data) const {
  PortBase& port = require_port(name, PortKind::write);
  const std::string_view message = data;
  const InterpreterUnlocked release;
  return port.write_serialized(as_bytes_view(message));
}

std::pair<std::string, std::string> ShellView::frames(const std::string& name) const {
  const PortBase& port = require_port(name, PortKind::write);
  const ServiceBase* const service = port.service();
  const Resource* const resource = service == nullptr ? nullptr : service->resource();
  const Frames* const frames = resource == nullptr ? nullptr : resource->frame_guard().expected();
  return frames == nullptr ? std::pair<std::string, std::string>()
                           : std::pair(frames->frame, frames->child_frame);
}

py::object ShellView::call(const std::string& name, const py::args& args, const py::kwargs& kwargs) const {
  auto* port = dynamic_cast<PythonCallPort*>(&require_port(name, PortKind::call));
  if (port == nullptr) throw py::type_error("call port '" + name + "' has a signature in C++");
  return port->call(args, kwargs);
}

py::bytes ShellView::request(const std::string& name, const py::bytes& data) const {
  auto* port = dynamic_cast<RequestPort*>(&require_port(name, PortKind::call));
  if (port == nullptr) throw py::type_error("call port '" + name + "' takes no requests");
  const std::string_view message = data;
  std::vector<std::byte> response;
  {
    const InterpreterUnlocked release;
    response = port->call(as_bytes_view(message));
  }
  return to_bytes(response);
}

void ShellView::raise_event(const std::string& name) const {
  auto& port = dynamic_cast<EventPort&>(require_port(name, PortKind::event));
  const InterpreterUnlocked release;
  port.raise();
}

py::object ShellView::property(const std::string& name) const {
  const PropertyBase* property = shell().find_property(name);
  if (property == nullptr) throw py::key_error("the shell has no property '" + name + "'");
  return to_python(property->boxed());
}

Duration ShellView::times(std::int64_t factor, const std::string& property) const {
  const PropertyBase* found = shell().find_property(property);
  if (found == nullptr) throw py::key_error("the shell has no property '" + property + "'");
  return mauve::times(factor, *found);
}

time_ns_t ShellView::clock() const {
  static_cast<void>(shell());
  return link_->context != nullptr ? link_->context->clock_ns.load(std::memory_order_relaxed)
                                   : monotonic_now_ns();
}

time_ns_t ShellView::period() const {
  static_cast<void>(shell());
  return link_->context != nullptr ? link_->context->period_ns.load(std::memory_order_relaxed) : 0;
}

Typed<"mauve_rt.parts.shells.Shell | None"> ShellView::python() const {
  const auto* python = dynamic_cast<const PythonShell*>(&shell());
  return python != nullptr ? python->object() : py::none();
}

std::unique_ptr<Shell> make_python_shell(const PartFactory& factory, const PluginRegistry& registry) {
  auto shell = std::make_unique<PythonShell>(factory, registry);
  shell->set_factory([factory, &registry] { return make_python_shell(factory, registry); });
  return shell;
}

void bind_python_shell(py::module_& module) {
  py::class_<Duration>(module, "Duration",
                       "A length of time that an fsm declares, with the expression it was computed from.")
      .def(py::init<time_ns_t, std::string>(), py::arg("ns"), py::arg("text") = "")
      .def_readonly("ns", &Duration::ns)
      .def_readonly("text", &Duration::text, "As '5 * unit_ms'; '': a plain number of ns.");
  py::class_<ShellView>(
      module, "ShellView",
      R"(What a part written in Python reaches of its component's shell; messages in serialized form.

Raises MauveError (not_configured) once the component is gone.)")
      .def("read", &ShellView::read, py::arg("port"),
           "(message, 0 none - 1 old - 2 new, writer's time in ns).")
      .def("write", &ShellView::write, py::arg("port"), py::arg("data"), "False when there was no room.")
      .def("frames", &ShellView::frames, py::arg("port"),
           "(frame, child_frame) that the resource of a write port expects; '' where nothing is declared.")
      .def("call", &ShellView::call, py::arg("port"), "Calls a service in Python.")
      .def("request", &ShellView::request, py::arg("port"), py::arg("data"),
           "Calls a service in C++; the response.")
      .def("raise_event", &ShellView::raise_event, py::arg("port"))
      .def("property", &ShellView::property, py::arg("name"), "The value in force.")
      .def("times", &ShellView::times, py::arg("factor"), py::arg("property"),
           "A number of times a property that is a length of time.")
      .def("ports", &ShellView::ports)
      .def("properties", &ShellView::properties)
      .def("clock", &ShellView::clock, "The component's logical clock, ns of CLOCK_MONOTONIC.")
      .def("period", &ShellView::period, "The component's period g in ns.")
      .def(
          "log", [](const ShellView& self) { return PyLog(self.link()); }, "Lines of the component.")
      .def("python", &ShellView::python, "The shell's own object, when it is written in Python.")
      .def("implementation", &ShellView::implementation);
  py::class_<ShellBuilder>(
      module, "ShellBuilder",
      "Takes the declarations of a shell written in Python. `zero`: the message's default, serialized.")
      .def("read_port", &ShellBuilder::read_port, py::arg("name"), py::arg("type"), py::arg("zero"),
           py::arg("optional") = false, py::arg("frame") = "", py::arg("child_frame") = "")
      .def("write_port", &ShellBuilder::write_port, py::arg("name"), py::arg("type"), py::arg("zero"),
           py::arg("on_commit"), py::arg("on_stop"), py::arg("optional") = false, py::arg("frame") = "",
           py::arg("child_frame") = "")
      .def("call_port", &ShellBuilder::call_port, py::arg("name"), py::arg("type"))
      .def("request_port", &ShellBuilder::request_port, py::arg("name"), py::arg("type"))
      .def("event_port", &ShellBuilder::event_port, py::arg("name"), py::arg("optional") = false)
      .def("property", &ShellBuilder::property, py::arg("name"), py::arg("value"), py::arg("unit"),
           py::arg("description"), py::arg("minimum"), py::arg("maximum"), py::arg("structural"));
}

}  // namespace mauve::bindings
