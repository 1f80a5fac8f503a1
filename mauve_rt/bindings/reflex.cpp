// SPDX-License-Identifier: LGPL-3.0-or-later
// Rules at work beside the components of a host.
#include "mauve_rt/rules/reflex.hpp"

#include <algorithm>
#include <set>

#include "host.hpp"

namespace mauve::bindings {

namespace {

using Unlocked = py::call_guard<py::gil_scoped_release>;

/// Its threads end without the interpreter's lock, and before the interpreter does: they may need it for parts in Python.
class PyReflex {
 public:
  PyReflex(PyHost& host, std::vector<rules::Rule> all, const std::vector<rules::RuleActions>& actions,
           std::map<std::string, std::string> topics)
      : reflex_(std::make_unique<rules::Reflex>(host.host(), std::make_unique<rules::Engine>(std::move(all)),
                                                actions, std::move(topics))) {
    living().insert(this);
  }
  ~PyReflex() {
    living().erase(this);
    const py::gil_scoped_release release;
    reflex_.reset();
  }
  PyReflex(const PyReflex&) = delete;
  PyReflex& operator=(const PyReflex&) = delete;

  rules::Reflex& reflex() const noexcept { return *reflex_; }

  static void stop_all() {
    const std::set<PyReflex*> all = living();
    const py::gil_scoped_release release;
    for (PyReflex* each : all) each->reflex_->stop();
  }

 private:
  /// Under the interpreter's lock.
  static std::set<PyReflex*>& living() {
    static std::set<PyReflex*> all;
    return all;
  }

  std::unique_ptr<rules::Reflex> reflex_;
};

rules::RuleActions rule_actions(rules::ActionSteps steps, rules::ActionSteps undo) {
  rules::RuleActions actions;
  actions.do_steps = std::move(steps);
  actions.undo_steps = std::move(undo);
  return actions;
}

void bind_actions(py::module_& module) {
  py::class_<rules::ActionStep>(module, "ActionStep")
      .def(py::init([](std::string kind, std::string target, std::string name,
                       std::optional<PropertyValue> value) {
             return rules::ActionStep{std::move(kind), std::move(target), std::move(name), std::move(value)};
           }),
           py::arg("kind"), py::arg("target") = "", py::arg("name") = "", py::arg("value") = std::nullopt);
  py::class_<rules::RuleActions>(module, "RuleActions")
      .def(py::init(&rule_actions), py::arg("do"), py::kw_only(), py::arg("undo") = rules::ActionSteps{});
}

void bind_told(py::module_& module) {
  py::class_<rules::Told>(module, "ToldDecision")
      .def_readonly("decision", &rules::Told::decision)
      .def_property_readonly("report", [](const rules::Told& self) { return self.action.report; })
      .def_property_readonly("failure", [](const rules::Told& self) { return self.action.failure; });
  py::class_<rules::RuleFacts>(module, "RuleFacts")
      .def_readonly("name", &rules::RuleFacts::name)
      .def_readonly("status", &rules::RuleFacts::status)
      .def_readonly("ready", &rules::RuleFacts::ready)
      .def_readonly("problem", &rules::RuleFacts::problem)
      .def_readonly("memory_bytes", &rules::RuleFacts::memory_bytes);
}

}  // namespace

void bind_reflex(py::module_& module) {
  bind_actions(module);
  bind_told(module);
  py::class_<PyReflex>(module, "Reflex")
      .def(py::init<PyHost&, std::vector<rules::Rule>, const std::vector<rules::RuleActions>&,
                    std::map<std::string, std::string>>(),
           py::arg("host"), py::arg("rules"), py::arg("actions"),
           py::arg("topics") = std::map<std::string, std::string>{}, py::keep_alive<1, 2>())
      .def(
          "start", [](PyReflex& self) { self.reflex().start(); }, Unlocked())
      .def(
          "stop", [](PyReflex& self) { self.reflex().stop(); }, Unlocked())
      .def(
          "wait_told",
          [](PyReflex& self, time_ns_t timeout_ns) { return self.reflex().wait_told(timeout_ns); },
          py::arg("timeout_ns"), Unlocked())
      .def(
          "wake", [](PyReflex& self) { self.reflex().wake(); }, Unlocked())
      .def(
          "facts", [](PyReflex& self) { return self.reflex().facts(); }, Unlocked())
      .def("beat", [](PyReflex& self) { self.reflex().beat(); })
      .def("lost", [](PyReflex& self) { return self.reflex().lost(); })
      .def("advance", [](PyReflex& self) { return self.reflex().advance(); }, Unlocked());
  // Called before the hosts' own: what is registered last is called first.
  py::module_::import("atexit").attr("register")(py::cpp_function(&PyReflex::stop_all));
}

}  // namespace mauve::bindings
