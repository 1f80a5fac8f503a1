// SPDX-License-Identifier: LGPL-3.0-or-later
// The engine of rules. Parameters that are texts, numbers or truths are Python's own.
#include "mauve_rt/rules/engine.hpp"

#include "translate.hpp"

namespace mauve::bindings {

namespace {

using Unlocked = py::call_guard<InterpreterUnlocked>;

constexpr auto kSignalNames = std::to_array<std::string_view>(
    {"message", "write", "arrival", "field", "overruns", "late", "release", "state", "over_declared", "peer",
     "diagnostic", "change", "node", "goal"});
static_assert(kSignalNames.size() == static_cast<std::size_t>(rules::SignalKind::goal) + 1);
constexpr auto kEndings =
    std::to_array<std::string_view>({"done", "refused", "stale", "withdrawn", "timed_out"});

[[noreturn]] void refuse_name(const char* what, const std::string& expected, const std::string& found) {
  throw Error(ErrorCode::invalid_argument, what, {.expected = expected, .found = found});
}

rules::Act act_of(const std::string& name) {
  for (const rules::Act act : {rules::Act::do_, rules::Act::undo, rules::Act::otherwise}) {
    if (rules::name_of(act) == name) return act;
  }
  refuse_name("there is no such act", "do, undo or otherwise", name);
}

rules::Ended ended_of(const std::string& name) {
  const auto* const found = std::find(kEndings.begin(), kEndings.end(), name);
  if (found == kEndings.end())
    refuse_name("an action does not end so", "done, refused, stale, withdrawn or timed_out", name);
  return static_cast<rules::Ended>(found - kEndings.begin());
}

/// An engine, and who asks it about a rule or signal that there is not is told.
class PyRuleEngine {
 public:
  explicit PyRuleEngine(std::vector<rules::Rule> all) : engine(std::move(all)) {}

  std::size_t rule(std::size_t number) const {
    if (number >= engine.size())
      throw py::index_error("there are " + std::to_string(engine.size()) + " rules");
    return number;
  }
  rules::Signal& signal(std::size_t number) const {
    const auto& all = engine.signals();
    if (number >= all.size()) throw py::index_error("there are " + std::to_string(all.size()) + " signals");
    return *all[number].signal;
  }

  rules::Engine engine;
};

void bind_table(py::module_& module) {
  py::class_<rules::ParameterSpec>(module, "ConditionParameter", "What a condition may be told.")
      .def_readonly("name", &rules::ParameterSpec::name)
      .def_readonly("type", &rules::ParameterSpec::type, R"(bool, int, float or str.

Of a text what it is (topic, message_type, component, resource, field, executor), or the texts that it
can be, as 'wake_up|response'.)")
      .def_readonly("unit", &rules::ParameterSpec::unit)
      .def_readonly("minimum", &rules::ParameterSpec::minimum)
      .def_readonly("maximum", &rules::ParameterSpec::maximum)
      .def_readonly("initial", &rules::ParameterSpec::initial)
      .def_readonly("required", &rules::ParameterSpec::required);
  py::class_<rules::ConditionKind>(module, "ConditionKind", "A row of the table of conditions.")
      .def_readonly("name", &rules::ConditionKind::name)
      .def_readonly("summary", &rules::ConditionKind::summary, "When it holds.")
      .def_readonly("parameters", &rules::ConditionKind::parameters);
  module.def("condition_kinds", [] { return rules::condition_kinds(); }, "All conditions that there are.");
}

void bind_rules_of_an_engine(py::module_& module) {
  py::class_<rules::When>(
      module, "WhenSpec",
      "A tree of conditions: `kind` one of the table, or all, any, not, at_least (with `count`).")
      .def(py::init([](std::string kind, rules::Parameters parameters, std::vector<rules::When> parts,
                       std::int64_t count, time_ns_t for_ns, time_ns_t within_ns) {
             return rules::When{std::move(kind), std::move(parameters), std::move(parts), count, for_ns,
                                within_ns};
           }),
           py::arg("kind"), py::kw_only(), py::arg("parameters") = rules::Parameters{},
           py::arg("parts") = std::vector<rules::When>{}, py::arg("count") = 0, py::arg("for_ns") = 0,
           py::arg("within_ns") = 0);
  py::class_<rules::Rule>(
      module, "RuleSpec",
      "One rule; `about`: the components that it changes, of which only one rule at a time decides.")
      .def(py::init([](std::string name, rules::When when, time_ns_t for_ns, bool undoes,
                       time_ns_t undo_for_ns, time_ns_t cooldown_ns, std::int64_t priority,
                       std::vector<std::string> about, std::optional<time_ns_t> otherwise_after_ns,
                       bool safety, bool latch) {
             return rules::Rule{.name = std::move(name),
                                .when = std::move(when),
                                .for_ns = for_ns,
                                .undoes = undoes,
                                .undo_for_ns = undo_for_ns,
                                .cooldown_ns = cooldown_ns,
                                .priority = priority,
                                .about = std::move(about),
                                .otherwise_after_ns = otherwise_after_ns,
                                .safety = safety,
                                .latch = latch};
           }),
           py::arg("name"), py::arg("when"), py::kw_only(), py::arg("for_ns") = 0, py::arg("undoes") = false,
           py::arg("undo_for_ns") = 0, py::arg("cooldown_ns") = 0, py::arg("priority") = 0,
           py::arg("about") = std::vector<std::string>{}, py::arg("otherwise_after_ns") = std::nullopt,
           py::arg("safety") = false, py::arg("latch") = false);
  py::class_<rules::SignalSpec>(module, "SignalSpec", "What one condition hears.")
      .def_property_readonly(
          "kind",
          [](const rules::SignalSpec& self) { return kSignalNames[static_cast<std::size_t>(self.kind)]; },
          "A kind of SignalKind in rules/signal.hpp: message, write, field, overruns ...")
      .def_readonly("target", &rules::SignalSpec::target)
      .def_readonly("detail", &rules::SignalSpec::detail);
}

void bind_answers(py::module_& module) {
  py::class_<rules::PendingAction>(
      module, "PendingAction",
      "What an engine wants done now: do, undo or otherwise. cause_ns: since when its condition is so.")
      .def_readonly("rule", &rules::PendingAction::rule)
      .def_property_readonly("act", [](const rules::PendingAction& self) { return rules::name_of(self.act); })
      .def_readonly("cause_ns", &rules::PendingAction::cause_ns)
      .def_readonly("measured", &rules::PendingAction::measured);
  py::class_<rules::Decision>(
      module, "RuleDecision",
      "One decision. decision: as in SupervisorDecision.msg; why: in words, '' where there is no reason.")
      .def_readonly("stamp_ns", &rules::Decision::stamp_ns)
      .def_readonly("rule", &rules::Decision::rule)
      .def_property_readonly("decision",
                             [](const rules::Decision& self) { return rules::name_of(self.decided); })
      .def_property_readonly("act", [](const rules::Decision& self) { return rules::name_of(self.act); })
      .def_property_readonly("why", [](const rules::Decision& self) { return rules::words_of(self.why); })
      .def_property_readonly(
          "other",
          [](const rules::Decision& self) {
            return self.other < 0 ? std::optional<std::int32_t>() : self.other;
          },
          "The rule that outranks it, or whose action is under way.")
      .def_readonly("cause_ns", &rules::Decision::cause_ns, "Since when the condition is as it is.")
      .def_readonly("sample_ns", &rules::Decision::sample_ns,
                    "What made it so: the last sample before a silence, the first one beyond a bound.")
      .def_readonly("wait_ns", &rules::Decision::wait_ns)
      .def_readonly(
          "held_ns", &rules::Decision::held_ns,
          "Of done and failed: for so long a higher rule or its cooldown held it back when it was due.")
      .def_readonly("measured", &rules::Decision::measured);
  py::class_<rules::RuleStatus>(module, "RuleStatus",
                                "How one rule fares. next: 'do' or 'undo' if nothing changes, and when.")
      .def_readonly("armed", &rules::RuleStatus::armed)
      .def_property_readonly("holds", &rules::RuleStatus::holds)
      .def_property_readonly(
          "known", [](const rules::RuleStatus& self) { return self.truth != rules::Truth::unknown; },
          "Whether its condition is true or false: until something was received of what it is about, it is "
          "neither.")
      .def_readonly("in_effect", &rules::RuleStatus::in_effect)
      .def_readonly("is_at_work", &rules::RuleStatus::is_at_work,
                    "Active, or something is left to be undone or under way.")
      .def_readonly("active", &rules::RuleStatus::active, "Whether what it does is wanted.")
      .def_readonly("since_ns", &rules::RuleStatus::since_ns)
      .def_readonly("measured", &rules::RuleStatus::measured)
      .def_property_readonly("next",
                             [](const rules::RuleStatus& self) {
                               return self.next ? std::optional(rules::name_of(*self.next)) : std::nullopt;
                             })
      .def_property_readonly("next_ns", [](const rules::RuleStatus& self) {
        return self.next ? std::optional(self.next_ns) : std::nullopt;
      });
}

void bind_engine(py::module_& module) {
  py::class_<PyRuleEngine>(
      module, "RuleEngine",
      R"(Decides what rules want done, and when. All but tell, wake and wait from one thread.

Raises MauveError (invalid_argument) for what cannot be so, IndexError for a rule that there is not.)")
      .def(py::init<std::vector<rules::Rule>>(), py::arg("rules"))
      .def_property_readonly(
          "signals",
          [](const PyRuleEngine& self) {
            std::vector<rules::SignalSpec> all;
            for (const auto& heard : self.engine.signals()) all.push_back(heard.spec);
            return all;
          },
          "One for each condition that listens; several may hear the same.")
      .def(
          "tell",
          [](PyRuleEngine& self, std::size_t signal, time_ns_t time_ns, double value) {
            self.signal(signal).tell(time_ns, value);
          },
          py::arg("signal"), py::arg("time_ns"), py::arg("value") = 0.0,
          "Something was heard. One thread at a time for each signal.")
      .def(
          "arm", [](PyRuleEngine& self, time_ns_t now_ns) { self.engine.arm(now_ns); }, py::arg("now_ns"),
          "All rules are present.")
      .def(
          "set_present",
          [](PyRuleEngine& self, std::size_t rule, bool present, time_ns_t now_ns) {
            self.engine.set_present(self.rule(rule), present, now_ns);
          },
          py::arg("rule"), py::arg("present"), py::arg("now_ns"),
          "Whether all that the rule is about is there and runs.")
      .def(
          "set_in_place",
          [](PyRuleEngine& self, std::size_t rule, const std::string& act, bool in_place) {
            self.engine.set_in_place(self.rule(rule), act_of(act), in_place);
          },
          py::arg("rule"), py::arg("act"), py::arg("in_place"),
          "Whether nothing is left to be done by the act.")
      .def(
          "set_ready",
          [](PyRuleEngine& self, std::size_t rule, const std::string& act, bool ready) {
            self.engine.set_ready(self.rule(rule), act_of(act), ready);
          },
          py::arg("rule"), py::arg("act"), py::arg("ready"), "Whether the act could begin at once.")
      .def(
          "adopt",
          [](PyRuleEngine& self, std::size_t rule, bool is_active, time_ns_t now_ns) {
            self.engine.adopt(self.rule(rule), is_active, now_ns);
          },
          py::arg("rule"), py::arg("is_active"), py::arg("now_ns"),
          "The rule is active since before; or what it did is not undone yet.")
      .def(
          "reset",
          [](PyRuleEngine& self, std::size_t rule, time_ns_t now_ns) {
            return self.engine.reset(self.rule(rule), now_ns);
          },
          py::arg("rule"), py::arg("now_ns"),
          "End an active rule whose condition is false, be it latched; False: it is not so.")
      .def(
          "forget",
          [](PyRuleEngine& self, std::optional<std::size_t> rule) {
            if (rule) {
              self.engine.forget(self.rule(*rule));
            } else {
              self.engine.forget();
            }
          },
          py::arg("rule") = py::none(), "The architecture is another one.")
      .def(
          "step", [](PyRuleEngine& self, time_ns_t now_ns) { return self.engine.step(now_ns); },
          py::arg("now_ns"), "Look at all conditions; the instant at which to step again at the latest.")
      .def_property_readonly("pending", [](const PyRuleEngine& self) { return self.engine.pending(); })
      .def(
          "begun", [](PyRuleEngine& self, time_ns_t now_ns) { self.engine.begun(now_ns); }, py::arg("now_ns"),
          "The pending action is being carried out.")
      .def(
          "ended",
          [](PyRuleEngine& self, std::size_t rule, const std::string& act, const std::string& how,
             time_ns_t now_ns) { self.engine.ended(self.rule(rule), act_of(act), ended_of(how), now_ns); },
          py::arg("rule"), py::arg("act"), py::arg("how"), py::arg("now_ns"),
          "An action that was begun has ended. How: done, refused, stale, withdrawn or timed_out.")
      .def(
          "gives_way",
          [](const PyRuleEngine& self, std::size_t rule) {
            const auto act = self.engine.gives_way(self.rule(rule));
            return act ? std::optional(rules::name_of(*act)) : std::nullopt;
          },
          py::arg("rule"),
          "The action of the rule that is to be called off, for that of a rule of higher rank.")
      .def(
          "take", [](PyRuleEngine& self) { return self.engine.take(); },
          "The next decision that was not taken yet.")
      .def(
          "lost", [](const PyRuleEngine& self) { return self.engine.lost(); },
          "Decisions that found no room.")
      .def(
          "status",
          [](const PyRuleEngine& self, std::size_t rule) { return self.engine.status(self.rule(rule)); },
          py::arg("rule"))
      .def(
          "wake", [](PyRuleEngine& self) { self.engine.wake(); }, "Ends a wait.")
      .def(
          "word", [](const PyRuleEngine& self) { return self.engine.word().load(std::memory_order_acquire); },
          "Changes with all that is of interest; for wait().")
      .def(
          "wait",
          [](const PyRuleEngine& self, std::uint32_t word, time_ns_t until_ns) {
            return futex_wait_until(self.engine.word(), word, until_ns);
          },
          py::arg("word"), py::arg("until_ns"), Unlocked(),
          "Sleep until the word is another one (True) or until the instant of CLOCK_MONOTONIC (False).");
}

}  // namespace

void bind_rules(py::module_& module) {
  bind_table(module);
  bind_rules_of_an_engine(module);
  bind_answers(module);
  bind_engine(module);
}

}  // namespace mauve::bindings
