// SPDX-License-Identifier: LGPL-3.0-or-later
// A machine whose definition the test gives.
#pragma once

#include "simulated.hpp"

namespace mauve::testing {

using Define = std::function<void(class FreeFsm&)>;

class FreeFsm : public Fsm<TestShell, TestCore> {
 public:
  explicit FreeFsm(Define how) : how_(std::move(how)) {}
  void define() override { how_(*this); }
  /// In virtual time it takes as long as its bound says.
  State& run(const std::string& name, time_ns_t max_execution_ns = 0) {
    State& state = execution(name, "act", &TestCore::act, max_execution_ns);
    state.simulated_execution_ns = max_execution_ns;
    return state;
  }
  void when_set(State& from, State& to) { transition(from, "is_set", &TestCore::is_set, to); }
  TestShell& ports() const { return shell(); }
  using FsmBase::next;
  using FsmBase::set_initial;
  using FsmBase::wait;
  using FsmBase::wait_event;

 private:
  Define how_;
};

/// Adds a component of test parts with a machine of its own.
inline Component& add_free(Architecture& architecture, const std::string& name, const Define& how,
                           const TaskSettings& settings = {}) {
  Component& component =
      architecture.add_component(name, std::make_unique<TestShell>(), std::make_unique<TestCore>(),
                                 new_part<FsmBase, FreeFsm>(how), settings);
  component.core_as<TestCore>().instants.reserve(20'000);
  return component;
}

inline time_ns_t period_of(Define how) {
  FreeFsm fsm(std::move(how));
  fsm.configure();
  return fsm.period_ns();
}

inline ErrorCode error_of(Define how, std::string* text = nullptr) {
  try {
    period_of(std::move(how));
  } catch (const Error& error) {
    if (text != nullptr) *text = error.what();
    return error.code();
  }
  return ErrorCode::internal;
}

/// Runs for `lengths[k]` at its k-th activation, as far as there are any, then waits; each length is a declared one.
inline Define varying(const std::vector<time_ns_t>& lengths, time_ns_t wait_ns) {
  return [=](FreeFsm& fsm) {
    State& pause = fsm.wait("Pause", wait_ns);
    State* before = nullptr;
    for (std::size_t i = 0; i < lengths.size(); ++i) {
      State& run = fsm.run("Run" + std::to_string(i), lengths[i]);
      State& rest = i + 1 < lengths.size() ? fsm.wait("Pause" + std::to_string(i), wait_ns) : pause;
      if (before == nullptr) fsm.set_initial(run);
      if (before != nullptr) fsm.next(*before, run);
      fsm.next(run, rest);
      before = &rest;
    }
    State& again = fsm.run("Again");
    fsm.next(pause, again);
    fsm.next(again, pause);
  };
}

}  // namespace mauve::testing
