// SPDX-License-Identifier: LGPL-3.0-or-later
// Rules at work beside the components of a host.
#include "mauve_rt/rules/rule_runner.hpp"

#include <algorithm>
#include <set>

#include "host.hpp"

namespace mauve::bindings {

namespace {

using Unlocked = py::call_guard<InterpreterUnlocked>;

/// Its threads end without the interpreter's lock, and before the interpreter does: they may need it for parts in Python.
class PyRuleRunner {
 public:
  PyRuleRunner(PyHost& host, std::vector<rules::Rule> all, std::vector<rules::RuleActions> actions,
               std::map<std::string, std::string> topics, PyRuleRunner* before, bool told)
      : runner_(std::make_unique<rules::RuleRunner>(
            host.host(), std::move(all), std::move(actions), std::move(topics),
            before != nullptr ? before->runner_.get() : nullptr,
            told ? rules::Inputs::told : rules::Inputs::architecture)) {
    living().insert(this);
  }
  ~PyRuleRunner() {
    living().erase(this);
    const InterpreterUnlocked release;
    runner_.reset();
  }
  PyRuleRunner(const PyRuleRunner&) = delete;
  PyRuleRunner& operator=(const PyRuleRunner&) = delete;

  rules::RuleRunner& runner() const noexcept { return *runner_; }

  static void stop_all() {
    const std::set<PyRuleRunner*> all = living();
    const InterpreterUnlocked release;
    for (PyRuleRunner* each : all) each->runner_->stop();
  }

 private:
  /// Under the interpreter's lock.
  static std::set<PyRuleRunner*>& living() {
    static std::set<PyRuleRunner*> all;
    return all;
  }

  std::unique_ptr<rules::RuleRunner> runner_;
};

rules::RuleActions rule_actions(rules::ActionSteps steps, rules::ActionSteps undo, const std::string& reserve,
                                bool takes_over, bool whole) {
  if (reserve != "stop" && reserve != "safe_outputs") {
    throw Error(ErrorCode::invalid_argument, "there is no such reserve action",
                {.expected = "stop or safe_outputs", .found = reserve});
  }
  rules::RuleActions actions;
  actions.reserve = reserve == "stop" ? rules::ReserveKind::stop : rules::ReserveKind::safe_outputs;
  actions.do_steps = std::move(steps);
  actions.undo_steps = std::move(undo);
  actions.takes_over = takes_over;
  actions.whole = whole;
  return actions;
}

void bind_actions(py::module_& module) {
  py::class_<rules::RuleActions>(
      module, "RuleActions",
      R"(What a rule does. `undo`: what becomes the base at its end; without, what was there before comes back.

reserve: stop or safe_outputs. takes_over: `undo` also counts where a person gave the base. whole: it does nothing
while a part of it is taken.)")
      .def(py::init(&rule_actions), py::arg("do"), py::kw_only(), py::arg("undo") = rules::ActionSteps{},
           py::arg("reserve") = "stop", py::arg("takes_over") = false, py::arg("whole") = false);
}

void bind_told(py::module_& module) {
  py::class_<rules::Told>(module, "ToldDecision",
                          "A decision, and of `done` and `failed` what came of the action.")
      .def_readonly("decision", &rules::Told::decision)
      .def_property_readonly(
          "steps", [](const rules::Told& self) { return self.action.steps; }, "What was to be done.")
      .def_property_readonly("report", [](const rules::Told& self) { return self.action.report; })
      .def_property_readonly(
          "failure", [](const rules::Told& self) { return self.action.failure; },
          "Why it is not in force, in words.");
  py::class_<rules::RuleFacts>(module, "RuleFacts", "How one rule of a RuleRunner fares.")
      .def_readonly("name", &rules::RuleFacts::name)
      .def_readonly("status", &rules::RuleFacts::status)
      .def_readonly("ready", &rules::RuleFacts::ready, "Whether what it would do or undo next could begin.")
      .def_readonly("problem", &rules::RuleFacts::problem,
                    "Why that cannot be made ready, or what the rule hears not be heard.")
      .def_readonly("memory_bytes", &rules::RuleFacts::memory_bytes, "What is kept prepared.");
}

}  // namespace

void bind_rule_runner(py::module_& module) {
  bind_actions(module);
  bind_told(module);
  py::class_<PyRuleRunner>(
      module, "RuleRunner",
      R"(Rules at work beside the components of a host, on native threads: they need no Python to act.

Raises MauveError (invalid_argument, unknown_component, unknown_resource ...) for what cannot be there.)")
      .def(py::init<PyHost&, std::vector<rules::Rule>, std::vector<rules::RuleActions>,
                    std::map<std::string, std::string>, PyRuleRunner*, bool>(),
           py::arg("host"), py::arg("rules"), py::arg("actions"),
           py::arg("topics") = std::map<std::string, std::string>{}, py::arg("before") = nullptr,
           py::kw_only(), py::arg("told") = false, py::keep_alive<1, 2>(),
           R"(`actions`: of the rules, in their order. `topics`: topic -> the resource that is bound to it.

`before`: those of the same host whose place these take, stopped: a rule that is in both, and the same,
goes on, and what it receives in between counts. It is of no use afterwards, and as it was where this raises.
`told`: in virtual time tell() alone tells the conditions, not the architecture.)")
      .def(
          "start", [](PyRuleRunner& self) { self.runner().start(); }, Unlocked(),
          "Begin to watch; the host is deployed.")
      .def(
          "stop", [](PyRuleRunner& self) { self.runner().stop(); }, Unlocked(),
          "Nothing is done any more; what is in effect stays so. May be called again.")
      .def(
          "reset", [](PyRuleRunner& self, const std::string& rule) { return self.runner().reset(rule); },
          py::arg("rule"), Unlocked(),
          "End an active rule whose condition is false, be it latched; '': done, else why not.")
      .def(
          "wait_told",
          [](PyRuleRunner& self, time_ns_t timeout_ns) { return self.runner().wait_told(timeout_ns); },
          py::arg("timeout_ns"), Unlocked(),
          "Decisions not taken yet; waits for one at most so long, or until wake().")
      .def(
          "wake", [](PyRuleRunner& self) { self.runner().wake(); }, Unlocked(),
          "End that wait, now and from now on.")
      .def(
          "facts", [](PyRuleRunner& self) { return self.runner().facts(); }, Unlocked())
      .def(
          "beat", [](PyRuleRunner& self) { self.runner().beat(); },
          "Say that the executor's Python side works, for conditions `node_silent`.")
      .def(
          "lost", [](PyRuleRunner& self) { return self.runner().lost(); },
          "Decisions that were left out, because those before them were not taken in time.")
      .def_property_readonly(
          "signals", [](const PyRuleRunner& self) { return self.runner().signals(); },
          "One for each condition that listens; several may listen to the same.")
      .def(
          "tell",
          [](PyRuleRunner& self, std::size_t signal, time_ns_t time_ns, double value) {
            return self.runner().tell(signal, time_ns, value);
          },
          py::arg("signal"), py::arg("time_ns"), py::arg("value") = 0.0,
          "With `told`: one of `signals` reports a value. Whether advance() has something to decide.")
      .def(
          "adopt", [](PyRuleRunner& self, std::size_t rule) { self.runner().adopt(rule); }, py::arg("rule"),
          "With `told`: the rule is active since before, and the architecture is as it wants it.")
      .def(
          "advance", [](PyRuleRunner& self) { return self.runner().advance(); }, Unlocked(),
          "In virtual time: do all that is due now; when to call again at the latest.");
  // Called before the hosts' own: what is registered last is called first.
  py::module_::import("atexit").attr("register")(py::cpp_function(&PyRuleRunner::stop_all));
}

}  // namespace mauve::bindings
