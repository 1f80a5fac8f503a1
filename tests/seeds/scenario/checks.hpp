// SPDX-License-Identifier: LGPL-3.0-or-later
// Checks: invariants that must hold while a scenario runs, and after it.
#pragma once

#include <algorithm>
#include <map>
#include <string>

#include "scene.hpp"

namespace mauve::testing {

class Checks : protected Scene {
 protected:
  using Scene::Scene;

  // ---- outputs

  void expect_safe(std::size_t index, const std::string& why) {
    expect_zero(index, output_value(index), why);
  }
  void expect_zero(std::size_t index, double found, const std::string& why) {
    expect(found == 0.0, parts_[index].name + " has output " + std::to_string(found) + " " + why);
    findings_.count("safe outputs");
  }

  /// The outputs of each FAULTED component are safe. A locked resource delays that, but not for long.
  void expect_safe_faulted() {
    const Intervention here(*this);
    const std::map<std::size_t, time_ns_t> before = faults();
    if (before.empty()) return;
    const time_ns_t excused_ns = excuses_ns();
    sleep_for(ms_to_ns(8));
    for (const auto& [index, when_ns] : before) {
      const double found = output_value(index);
      const std::map<std::size_t, time_ns_t> after = faults();
      if (!here.is_sole() || excuses_ns() != excused_ns) return;
      const auto same = after.find(index);
      if (same != after.end() && same->second == when_ns) expect_zero(index, found, "although it is FAULTED");
    }
  }

  /// Nothing runs any more.
  void expect_safe_all() {
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      const auto component = architecture_->find_component(parts_[i].name);
      if (component != nullptr) expect_safe(i, "after the shutdown");
    }
  }

  // ---- states

  /// A wait is never given up, and a fault names the state that it was in. A guard is of the wait's name.
  void expect_just_faults() {
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      const auto component = architecture_->find_component(parts_[i].name);
      if (component == nullptr || shared_->bad_guards.contains(static_cast<int>(i))) continue;
      const Fault fault = component->task().fault();
      // From its end on the thread leaves the wait, and may be kept from its CPU there.
      const bool was_in_wait = component->task().state() == ComponentState::faulted &&
                               fault.when_ns < component->task().context().clock_ns.load();
      expect(!was_in_wait || fault.what.find("state Pause") == std::string::npos,
             component->name() + " was given up in its wait: " + fault.what);
      expect(!fault.what.starts_with("stopped by force while state") ||
                 fault.what.find("state " + fault.where + " ") != std::string::npos,
             component->name() + " has a fault in " + fault.where + ": " + fault.what);
    }
  }

  /// Each component that runs is released; no wake-up is lost.
  void expect_alive() {
    constexpr time_ns_t kLongest = ms_to_ns(250);
    std::map<std::string, ComponentState> states;
    for (const auto& component : architecture_->components())
      states[component->name()] = component->task().state();
    const time_ns_t began_ns = seeds::now_ns();
    sleep_for(kLongest + (seeds::outcome().stalled_ns > 0 ? ms_to_ns(60) : 0));
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      const auto component = architecture_->find_component(parts_[i].name);
      const bool has_hung = std::ranges::any_of(shared_->hung_cores, [&](const auto& each) {
        return each.second.component == static_cast<int>(i) && each.second.until_ns > began_ns;
      });
      if (component == nullptr || states[parts_[i].name] != ComponentState::running ||
          component->task().state() != ComponentState::running || has_hung)
        continue;
      const bool has_run = std::ranges::any_of(shared_->executions, [&](const Execution& execution) {
        return execution.component == static_cast<int>(i) && execution.at_ns > began_ns;
      });
      findings_.count("components alive");
      expect(has_run, parts_[i].name + " is running, and has not executed for " +
                          std::to_string(kLongest / 1'000'000) + " ms");
    }
  }

  // ---- probations

  /// No verdict is "passed" before the time, or for a core that hangs; each probation whose time is over has a verdict.
  void expect_right_verdicts() {
    for (const ProbationRecord& record : deployer_->probations()) {
      if (record.verdict == ProbationVerdict::running) continue;
      const int core = core_of(record.to_core);
      const time_ns_t end_ns = record.begin_ns + trials_.at(core);
      if (record.verdict == ProbationVerdict::passed) {
        const auto hung = shared_->hung_cores.find(core);
        expect(hung == shared_->hung_cores.end() || hung->second.is_in_cleanup ||
                   hung->second.clock_ns >= end_ns || hung->second.until_ns <= record.end_ns,
               "core " + std::to_string(core) + " hangs in a release of its probation, and has passed it");
        expect(record.end_ns >= end_ns, "core " + std::to_string(core) + " has passed its probation at " +
                                            std::to_string(record.end_ns) + ", expected not before " +
                                            std::to_string(end_ns));
      }
      history_.note_verdict(core, record.verdict);
      findings_.note(record.component + ": core " + std::to_string(core) + " " + to_string(record.verdict) +
                     ": " + record.reason);
      findings_.count(std::string("probations ") + to_string(record.verdict));
    }
  }

  // ---- changes

  /// By the description each component is as the changes made it. One that is late to a change that was made, or was given up there,
  /// may show what was before.
  void expect_described(const std::string& after_what, Owner owner) {
    for (const ComponentFacts& facts : deployer_->describe().components) {
      const auto part = std::ranges::find(parts_, facts.name, &Part::name);
      if (part == parts_.end()) continue;
      const auto index = static_cast<std::size_t>(part - parts_.begin());
      if (!owns(owner, index)) continue;
      const auto component = architecture_->find_component(facts.name);
      const bool was_given_up =
          component != nullptr && component->task().fault().what.find("of its new part") != std::string::npos;
      if (component == nullptr || architecture_->find_awaited(facts.name) != nullptr || was_given_up)
        continue;
      for (const ShownProperty& property : facts.parts.properties) {
        if (property.name != "gain") continue;
        const double found = std::get<double>(property.value);
        expect(found == part->gain, after_what + ": found gain " + std::to_string(found) + " of " +
                                        facts.name + ", expected " + std::to_string(part->gain));
      }
      for (const ShownPort& port : facts.parts.ports) {
        if (port.name != "input") continue;
        const std::string expected = part->input == kUnconnected
                                         ? ""
                                         : output_of(static_cast<std::size_t>(part->input - written_by(0)));
        expect(port.resource == expected, after_what + ": the input of " + facts.name + " is connected to '" +
                                              port.resource + "', expected '" + expected + "'");
      }
    }
  }

  // ---- the end

  /// No thread and no part is left.
  void settle(bool leaves_nothing) {
    seeds::expect_threads_end(findings_, s_to_ns(1));
    if (!leaves_nothing && !shared_->hung_cores.empty()) return;
    for (const auto& [number, core] : shared_->cores) expect(false, "is left: " + core);
  }

 private:
  std::map<std::size_t, time_ns_t> faults() const {
    std::map<std::size_t, time_ns_t> found;
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      const auto component = architecture_->find_component(parts_[i].name);
      if (component != nullptr && component->task().state() == ComponentState::faulted)
        found[i] = component->task().fault().when_ns;
    }
    return found;
  }
};

}  // namespace mauve::testing
