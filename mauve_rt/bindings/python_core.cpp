// SPDX-License-Identifier: LGPL-3.0-or-later
// Cores written in Python. Their methods run on the component's own thread under the interpreter's lock; that
// lock is taken here, around the call, and nowhere while a priority-inheritance mutex is held.
#include "translate.hpp"

namespace mauve::bindings {

namespace {

std::string python_error(const py::error_already_set& error) {
  return error.what();  // type, message and traceback; asked for under the interpreter's lock
}

/// Runs a call into Python; its exception becomes a C++ one that holds no Python object.
template <typename Call>
auto in_python(Call&& call) {
  const py::gil_scoped_acquire lock;
  try {
    return call();
  } catch (const py::error_already_set& error) {
    throw std::runtime_error(python_error(error));
  }
}

py::bytes to_bytes(const std::vector<std::byte>& message) {
  return {reinterpret_cast<const char*>(message.data()), message.size()};
}

std::span<const std::byte> as_bytes_view(std::string_view data) { return std::as_bytes(std::span(data)); }

/// What a Python core sees of its component: ports by name, properties, the logical clock.
class ShellView {
 public:
  ShellView(Shell& shell, const Context* context) : shell_(shell), context_(context) {}

  py::tuple read(const std::string& name) const {
    std::vector<std::byte> message;
    DataStatus status = DataStatus::none;
    time_ns_t time_ns = 0;
    PortBase& port = require_port(name);
    bool readable = false;
    {
      const py::gil_scoped_release release;
      readable = port.read_serialized(message, status, time_ns);
    }
    if (!readable)
      throw py::type_error("port '" + name + "' is a " + std::string(to_string(port.kind())) + " port");
    return py::make_tuple(to_bytes(message), static_cast<int>(status), time_ns);
  }
  bool write(const std::string& name, const py::bytes& data) const {
    PortBase& port = require_port(name);
    if (port.kind() != PortKind::write) {
      throw py::type_error("port '" + name + "' is a " + std::string(to_string(port.kind())) + " port");
    }
    const std::string_view message = data;
    const py::gil_scoped_release release;
    return port.write_serialized(as_bytes_view(message));
  }
  py::object property(const std::string& name) const {
    const PropertyBase* property = shell_.find_property(name);
    if (property == nullptr) throw py::key_error("the shell has no property '" + name + "'");
    return to_python(property->boxed());
  }
  std::vector<PortDescription> ports() const { return describe_ports(shell_); }
  std::vector<PropertyDescription> properties() const { return describe_properties(shell_); }
  time_ns_t clock() const { return context_->clock_ns.load(std::memory_order_relaxed); }
  time_ns_t period() const { return context_->period_ns; }

 private:
  PortBase& require_port(const std::string& name) const {
    PortBase* port = shell_.find_port(name);
    if (port == nullptr) throw py::key_error("the shell has no port '" + name + "'");
    return *port;
  }

  Shell& shell_;
  const Context* context_;
};

class PythonCore final : public DynamicCore {
 public:
  explicit PythonCore(py::object factory) : factory_(std::move(factory)) {}
  ~PythonCore() override {
    const py::gil_scoped_acquire lock;
    methods_.clear();
    core_.release().dec_ref();
    factory_.release().dec_ref();
  }

  bool bind_shell(Shell& shell) noexcept override {
    shell_ = &shell;
    return true;
  }
  void set_context(const Context* context) noexcept override {
    CoreBase::set_context(context);
    context_ = context;
  }
  int find_method(std::string_view name) const override {
    return in_python([&] {
      make();
      const std::string attribute(name);
      if (!py::hasattr(core_, attribute.c_str())) return -1;
      methods_.push_back(core_.attr(attribute.c_str()));
      return static_cast<int>(methods_.size()) - 1;
    });
  }
  void run(int method) override {
    in_python([&] { methods_[static_cast<std::size_t>(method)](); });
  }
  bool test(int method) override {
    return in_python([&] { return methods_[static_cast<std::size_t>(method)]().cast<bool>(); });
  }
  // A Python core's state moves by way of Python: adopt sees the old core's object, or None if it is no
  // Python core.
  bool adopt(const CoreBase& old) override {
    return in_python([&] {
      if (!py::hasattr(core_, "adopt")) return true;
      const auto* python = dynamic_cast<const PythonCore*>(&old);
      const py::object answer = core_.attr("adopt")(python != nullptr ? python->core_ : py::none());
      return answer.is_none() || answer.cast<bool>();
    });
  }
  time_ns_t budget_ns() const noexcept override { return ms_to_ns(2); }

 protected:
  bool configure_hook() override { return call_hook("configure"); }
  void cleanup_hook() override { call_hook("cleanup"); }

 private:
  void make() const {
    if (!core_) core_ = factory_(ShellView(*shell_, context_));
  }
  bool call_hook(const char* name) {
    return in_python([&] {
      make();
      if (!py::hasattr(core_, name)) return true;
      const py::object answer = core_.attr(name)();
      return answer.is_none() || answer.cast<bool>();
    });
  }

  py::object factory_;
  Shell* shell_{nullptr};
  const Context* context_{nullptr};
  mutable py::object core_;                  // made at prepare, when shell and context are known
  mutable std::vector<py::object> methods_;  // bound methods by slot
};

}  // namespace

std::unique_ptr<CoreBase> make_python_core(py::object factory) {
  return std::make_unique<PythonCore>(std::move(factory));
}

void bind_python_core(py::module_& module) {
  py::class_<ShellView>(module, "ShellView")
      .def("read", &ShellView::read)
      .def("write", &ShellView::write)
      .def("property", &ShellView::property)
      .def("ports", &ShellView::ports)
      .def("properties", &ShellView::properties)
      .def("clock", &ShellView::clock)
      .def("period", &ShellView::period);
}

}  // namespace mauve::bindings
