// SPDX-License-Identifier: LGPL-3.0-or-later
// Overlays: what each element of an architecture should be, and who wants it so.
#include "mauve_rt/architecture/overlays.hpp"

#include "mauve_rt/architecture/state_file.hpp"
#include "mauve_rt/architecture/state_keeper.hpp"
#include "mauve_rt/rules/action.hpp"

#include "translate.hpp"

namespace mauve::bindings {

namespace {

using Unlocked = py::call_guard<InterpreterUnlocked>;

Assigned assigned(const Assignment& step) { return rules::assigned({step}).front(); }

std::string words_of(Wanted::By by) {
  switch (by) {
    case Wanted::By::rule:
      return "rule";
    case Wanted::By::over:
      return "over";
    case Wanted::By::stop:
      return "stop";
    case Wanted::By::none:
      return "none";
    case Wanted::By::base:
      break;
  }
  return "base";
}

void bind_values(py::module_& module) {
  py::class_<Assignment>(module, "ActionStep",
                         "One step in names and plain values: its kind, and what it takes.")
      .def(py::init([](std::string kind, std::string target, std::string name,
                       std::optional<PropertyValue> value) {
             return Assignment{std::move(kind), std::move(target), std::move(name), std::move(value)};
           }),
           py::arg("kind"), py::arg("target") = "", py::arg("name") = "", py::arg("value") = std::nullopt)
      .def(
          "is_equal", [](const Assignment& self, const Assignment& other) { return self == other; },
          py::arg("other"))
      .def_readonly("kind", &Assignment::kind)
      .def_readonly("target", &Assignment::target)
      .def_readonly("name", &Assignment::name)
      .def_readonly("value", &Assignment::value);
  py::class_<Wanted>(module, "Wanted", "What one element should be.")
      .def_readonly("step", &Wanted::step, "The step that makes it so; None: as it is.")
      .def_property_readonly(
          "by", [](const Wanted& self) { return words_of(self.by); },
          "base, rule, over (what a person put over rules), stop (by a person), none (all was rejected).")
      .def_readonly("rule", &Wanted::rule, "Of `rule`: which one.");
  py::class_<HeldElement>(module, "HeldElement", "One element that rules or persons have their hand on.")
      .def_property_readonly("target", [](const HeldElement& self) { return self.element.target; })
      .def_property_readonly(
          "element", [](const HeldElement& self) { return self.element.name; },
          "core, fsm, shell, state, 'property NAME', 'port NAME'; '': whether the target is there.")
      .def_readonly("base", &HeldElement::base, "What it is without them; None: unknown.")
      .def_readonly("wanted", &HeldElement::wanted)
      .def_readonly("rules", &HeldElement::rules, "Active ones that set it, the highest first.");
  py::class_<OverlaySpec>(module, "OverlaySpec", "What one rule wants while it is active.")
      .def(py::init([](std::string rule, const rules::ActionSteps& assigns, const rules::ActionSteps& leaves,
                       std::int64_t priority, bool safety, bool whole, bool ends_with_source, bool latch,
                       bool leaves_over_persons) {
             return OverlaySpec{.rule = std::move(rule),
                                .source = {},
                                .priority = priority,
                                .safety = safety,
                                .whole = whole,
                                .ends_with_source = ends_with_source,
                                .latch = latch,
                                .assigns = rules::assigned(assigns),
                                .leaves = rules::assigned(leaves),
                                .leaves_over_persons = leaves_over_persons};
           }),
           py::arg("rule"), py::arg("assigns"), py::kw_only(), py::arg("leaves") = rules::ActionSteps{},
           py::arg("priority") = 0, py::arg("safety") = false, py::arg("whole") = false,
           py::arg("ends_with_source") = false, py::arg("latch") = false,
           py::arg("leaves_over_persons") = false,
           "`leaves`: what becomes the base at its end; else what was there before comes back.");
  py::class_<KeptBase>(module, "KeptBase", "A base that a person chose.")
      .def_property_readonly("step", [](const KeptBase& self) { return self.assigned.step; })
      .def_readonly("author", &KeptBase::author);
  py::class_<KeptState>(module, "KeptState", "What rules and persons decided, and what outlasts the process.")
      .def(py::init<>())
      .def_property_readonly("rules",
                             [](const KeptState& self) {
                               std::vector<std::string> names;
                               names.reserve(self.active.size());
                               for (const OverlaySpec& each : self.active) names.push_back(each.rule);
                               return names;
                             })
      .def_property_readonly("rejected", [](const KeptState& self) { return steps_of(self.rejected); })
      .def_readonly("bases", &KeptState::bases);
  py::class_<Overlay, std::shared_ptr<Overlay>>(module, "Overlay", "One rule's overlay.")
      .def_property_readonly("rule", [](const Overlay& self) { return self.spec().rule; })
      .def_property_readonly("source", [](const Overlay& self) { return self.spec().source; })
      .def_property_readonly("priority", [](const Overlay& self) { return self.spec().priority; })
      .def_property_readonly("assigns", [](const Overlay& self) { return steps_of(self.spec().assigns); })
      .def_property_readonly("ends_with_source",
                             [](const Overlay& self) { return self.spec().ends_with_source; })
      .def_property_readonly("safety", [](const Overlay& self) { return self.spec().safety; })
      .def_property_readonly("is_active", &Overlay::is_active);
}

}  // namespace

void bind_overlays(py::module_& module) {
  bind_values(module);
  module.attr("KEPT") = std::string(kKept);
  module.attr("HELD_STOPPED") = std::string(kHeldStopped);
  module.def(
      "read_state_file", [](const std::string& path) { return read_state_file(path); }, py::arg("path"),
      "What an executor kept; None: there is no file. Raises MauveError: it is damaged.");
  py::class_<Overlays>(
      module, "Overlays",
      R"(What is wanted of each element: of the highest active rule that sets it, else its base.

Elements are named by a step that sets them. Raises MauveError (invalid_argument): there is no such kind of step.)")
      .def(py::init<>())
      .def("load", &Overlays::load, py::arg("source"), py::arg("specs"),
           "The rules of a source take the place of those that it had: one of the same name stays active.")
      .def("put", &Overlays::put, py::arg("source"), py::arg("spec"), "The same of one rule.")
      .def("at_work", &Overlays::at_work, py::arg("source"),
           "Those of the source that are active, or not undone yet.")
      .def("active", &Overlays::active, "All that are active, the highest first.")
      .def("find", &Overlays::find, py::arg("rule"))
      .def("set_active", &Overlays::set_active, py::arg("overlay"), py::arg("is_active"), Unlocked(),
           "For rules that no RuleRunner runs.")
      .def("set_engaged", &Overlays::set_engaged, py::arg("overlay"), py::arg("is_engaged"),
           "The same: whether what it wants is on its way or in force.")
      .def("steps_if", &Overlays::steps_if, py::arg("overlay"), py::arg("is_active"),
           py::arg("description").none(true) = nullptr, Unlocked(),
           "What is to be done once the rule is active, or no longer is; without what is so already.")
      .def("settle_ended", &Overlays::settle_ended)
      .def(
          "note",
          [](Overlays& self, const Assignment& step, const std::string& author) {
            self.note(assigned(step), author);
          },
          py::arg("step"), py::arg("author"), "A change that is in force, of somebody who is no rule.")
      .def(
          "wanted",
          [](const Overlays& self, const Assignment& step) { return self.wanted(assigned(step).element); },
          py::arg("step"))
      .def(
          "holder_against",
          [](const Overlays& self, const Assignment& step) { return self.holder_against(assigned(step)); },
          py::arg("step"), "The rule that keeps a person from this step; '': none.")
      .def(
          "put_over",
          [](Overlays& self, const Assignment& step, const std::string& safety_rule) {
            self.put_over(assigned(step), safety_rule);
          },
          py::arg("step"), py::arg("safety_rule") = "",
          "A person's value above all rules but safety rules, but for the one that is named.")
      .def(
          "take_off",
          [](Overlays& self, const std::string& rule) {
            std::vector<std::pair<std::string, std::string>> found;
            for (const Element& one : self.take_off(rule)) found.emplace_back(one.target, one.name);
            return found;
          },
          py::arg("rule") = "", "End what a person put over the rule; '': all. The elements: (target, name).")
      .def(
          "take_off_element",
          [](Overlays& self, const Assignment& step) { self.take_off(assigned(step).element); },
          py::arg("step"), "The same of one element.")
      .def("lift_stop", &Overlays::lift_stop, py::arg("component"), "End a person's stop.")
      .def(
          "set_base",
          [](Overlays& self, const Assignment& step, const std::string& author) {
            self.set_base(assigned(step), author);
          },
          py::arg("step"), py::arg("author"))
      .def(
          "reject", [](Overlays& self, const Assignment& step) { self.reject(assigned(step)); },
          py::arg("step"), "The value was rejected: it is not put in again, but by a person.")
      .def(
          "forgive", [](Overlays& self, const Assignment& step) { self.forgive(assigned(step).element); },
          py::arg("step"), "End the quarantine of all values of the element.")
      .def("rejected", [](const Overlays& self) { return steps_of(self.rejected()); })
      .def("move", &Overlays::move, py::arg("rule"), py::arg("source"), py::arg("to"),
           "The rule is of another source from now on; False: the source has no such rule.")
      .def("start_all", &Overlays::start_all, "An activation, at which persons' stops end.")
      .def("table", &Overlays::table, "What rules or persons have their hand on, sorted.");
}

void bind_state_keeper(py::module_& module) {
  py::class_<StateKeeper>(module, "StateKeeper",
                          "Writes what rules and persons decided to a file, as soon as it changes.")
      .def(py::init([](PyArchitecture& architecture, const std::string& path) {
             return std::make_unique<StateKeeper>(architecture.architecture, path);
           }),
           py::arg("architecture"), py::arg("path"), py::keep_alive<1, 2>(),
           "Bases are compared with what the architecture is now, as its file made it.")
      .def("start", &StateKeeper::start, Unlocked(), "Write the present state, then follow it.")
      .def("stop", &StateKeeper::stop, Unlocked())
      .def("problem", &StateKeeper::problem, "Why the present state is not in the file; empty: it is.");
}

}  // namespace mauve::bindings
