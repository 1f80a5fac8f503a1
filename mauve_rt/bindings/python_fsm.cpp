// SPDX-License-Identifier: LGPL-3.0-or-later
// State machines written in Python: declared there once, run by the kernel like any other.
#include "python_call.hpp"

namespace mauve::bindings {

namespace {

/// In the place of a C++ core's methods, which a machine declared in Python does not know: it takes cores with
/// methods by name only, so that these never run.
struct NoCppCore {
  void run() { throw std::logic_error("a method by name was called by pointer"); }
  bool test() { throw std::logic_error("a guard by name was called by pointer"); }
};

class PythonFsm final : public FsmBase {
 public:
  explicit PythonFsm(std::shared_ptr<PythonObject> factory) : factory_(std::move(factory)) {}
  ~PythonFsm() override {
    const InterpreterLocked lock;
    link_->shell = nullptr;
  }

  bool bind_shell(Shell& shell) noexcept override {
    link_->shell = &shell;
    return true;
  }
  CoreBinding bind_core(CoreBase& core) const override {
    if (auto* dynamic = dynamic_cast<DynamicCore*>(&core)) return bind_dynamic(*dynamic);
    throw Error(ErrorCode::type_mismatch,
                "an fsm in Python finds the core's methods by name, and C++ has none",
                {.element = core.description(),
                 .expected = "a core in Python for " + description(),
                 .remedy = "write the core in Python too, or the fsm in C++"});
  }

  // What the object declares the machine with.

  void add_execution(const std::string& name, const std::string& method, time_ns_t max_execution_ns,
                     time_ns_t simulated_execution_ns, time_ns_t wcet_ns) {
    State& state = FsmBase::add_execution(name);
    state.action = add_method(Method::action(method, method_count(), &NoCppCore::run));
    state.max_execution_ns = max_execution_ns;
    state.simulated_execution_ns = simulated_execution_ns;
    state.wcet_ns = wcet_ns;
  }
  void add_wait(const std::string& name, const Duration& duration) { wait(name, duration); }
  void add_event_wait(const std::string& name, const std::string& port, const Duration& timeout,
                      const Duration& min_interarrival) {
    PortBase* found = link_->shell->find_port(port);
    if (found == nullptr) {
      throw Error(ErrorCode::unknown_port, "the shell has no such port",
                  {.element = "state " + name,
                   .expected = "a port of " + link_->shell->description(),
                   .found = port});
    }
    wait_event(name, *found, timeout, min_interarrival);
  }
  void set_divisor(time_ns_t divisor_ns) { declare_divisor(divisor_ns); }
  void begin_with(const std::string& name) { set_initial(require(name)); }
  void go(const std::string& from, const std::string& to) { next(require(from), require(to)); }
  void go_if(const std::string& from, const std::string& guard, const std::string& to) {
    require(from).transitions.push_back(
        {add_method(Method::guard<NoCppCore>(guard, method_count(), &NoCppCore::test)), &require(to)});
  }

 protected:
  void define() override {
    in_python([&] { object_.get().attr("_define")(py::cast(this, py::return_value_policy::reference)); });
  }
  bool configure_hook() override {
    const bool willing = in_python([&] {
      if (!object_) object_.set(factory_->get()(ShellView(link_)));
      return call_hook(object_.get(), "configure");
    });
    if (!willing || !FsmBase::configure_hook()) return false;
    defined_ = true;
    return true;
  }
  void cleanup_hook() override {
    FsmBase::cleanup_hook();
    if (!std::exchange(defined_, false)) return;  // the kernel also empties a machine before it is defined
    in_python([&] { call_hook(object_.get(), "cleanup"); });
  }

 private:
  State& require(const std::string& name) const {
    std::vector<std::string> known;
    for (const auto& state : states()) {
      if (state->name == name) return *state;
      known.push_back(state->name);
    }
    throw Error(ErrorCode::bad_fsm, "the machine has no such state",
                {.element = "state " + name, .expected = "one of " + join(known), .found = name});
  }

  std::shared_ptr<PythonObject> factory_;
  std::shared_ptr<ShellLink> link_{std::make_shared<ShellLink>()};
  PythonObject object_;
  bool defined_{false};
};

}  // namespace

std::unique_ptr<FsmBase> make_python_fsm(const PartFactory& factory) {
  auto fsm = std::make_unique<PythonFsm>(factory.make);
  fsm->set_implementation(factory.name);
  fsm->set_factory([factory] { return make_python_fsm(factory); });
  return fsm;
}

void bind_python_fsm(py::module_& module) {
  py::class_<PythonFsm>(module, "FsmBuilder",
                        "Takes the declarations of a state machine written in Python; states by their names.")
      .def("execution", &PythonFsm::add_execution, py::arg("name"), py::arg("method"),
           py::arg("max_execution_ns"), py::arg("simulated_execution_ns"), py::arg("wcet_ns"))
      .def("wait", &PythonFsm::add_wait, py::arg("name"), py::arg("duration"))
      .def("wait_event", &PythonFsm::add_event_wait, py::arg("name"), py::arg("port"), py::arg("timeout"),
           py::arg("min_interarrival"))
      .def("divisor", &PythonFsm::set_divisor, py::arg("divisor_ns"), "Its period divides this, too.")
      .def("set_initial", &PythonFsm::begin_with, py::arg("state"))
      .def("next", &PythonFsm::go, py::arg("state"), py::arg("to"))
      .def("transition", &PythonFsm::go_if, py::arg("state"), py::arg("guard"), py::arg("to"));
}

}  // namespace mauve::bindings
