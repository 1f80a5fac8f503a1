// SPDX-License-Identifier: LGPL-3.0-or-later
// Periodic state machines (section II-C of the paper), built on the clock-based ones.
#pragma once

#include <string>
#include <utility>

#include "mauve_rt/base/error.hpp"
#include "mauve_rt/parts/fsm.hpp"

namespace mauve {

/// PSM: each state executes one action, exactly one of them in each period, and every transition takes one
/// period (Fig. 2 of the paper). Derive from this and declare the machine in define():
///
///   struct GuidancePsm : mauve::PeriodicFsm<GuidanceShell, GuidanceCore> {
///     void define() override {
///       period(mauve::ms_to_ns(50));
///       PeriodicState idle = periodic_state("Idle", "read_inputs", &GuidanceCore::read_inputs);
///       PeriodicState planning = periodic_state("Planning", "compute_path", &GuidanceCore::compute_path);
///       set_initial(idle);
///       transition(idle, "has_new_goal", &GuidanceCore::has_new_goal, planning);
///       next(planning, idle);
///     }
///   };
///
/// A state S becomes an execution state S and a wait "AwaitS" of one period before it. So guards are evaluated
/// right after the action, on the data that it read, and what they choose is executed one period later. g is
/// the period, whatever the cycles. The limits of PSMs are in the paper; an Fsm has neither.
template <typename ShellType, typename CoreType>
class PeriodicFsm : public Fsm<ShellType, CoreType> {
  using Base = Fsm<ShellType, CoreType>;

 protected:
  /// A state of the machine. To be had from periodic_state() only; good until the next configure.
  class PeriodicState {
    friend class PeriodicFsm;
    PeriodicState(State& action, State& release) : action_(&action), release_(&release) {}
    State* action_;
    State* release_;  // the wait before the action
  };

  /// The one period of all states. Called once, before the first state. [setup] Throws Error (bad_fsm).
  void period(Duration period) {
    if (period_.ns != 0) refuse("the period is given twice", "call period() once: a PSM has one period");
    if (period.ns <= 0) refuse("the period has no length", "give period() a time > 0 ns");
    period_ = std::move(period);
    this->declare_divisor(period_.ns);
  }

  /// A state that runs a method of the core. Where no guard holds and next() says nothing, the machine stays in
  /// the state, executing its action in each period. [setup] Throws Error: bad_fsm, duplicate_name.
  PeriodicState periodic_state(std::string name, std::string method_name, void (CoreType::*method)(),
                               time_ns_t max_execution_ns = 0) {
    if (period_.ns == 0) refuse("the period is not given", "call period() before the first state");
    State& release = Base::wait("Await" + name, period_);
    State& action = Base::execution(std::move(name), std::move(method_name), method, max_execution_ns);
    Base::next(release, action);
    Base::next(action, release);
    return {action, release};
  }

  void set_initial(const PeriodicState& state) noexcept { Base::set_initial(*state.action_); }
  /// Goes to `to` when the guard holds after the action of `from`; guards are asked in the order of
  /// declaration. [setup]
  void transition(const PeriodicState& from, std::string guard_name, bool (CoreType::*guard)(),
                  const PeriodicState& to) {
    Base::transition(*from.action_, std::move(guard_name), guard, *to.release_);
  }
  void transition(const PeriodicState& from, std::string guard_name, bool (CoreType::*guard)() const,
                  const PeriodicState& to) {
    Base::transition(*from.action_, std::move(guard_name), guard, *to.release_);
  }
  /// Where a state goes when no transition's guard holds. [setup]
  void next(const PeriodicState& from, const PeriodicState& to) noexcept {
    Base::next(*from.action_, *to.release_);
  }

  bool configure_hook() override {
    period_ = 0;
    return Base::configure_hook();
  }

 private:
  // States of other lengths than the period are what a PSM does not have.
  using Base::execution;
  using Base::wait;

  [[noreturn]] void refuse(const std::string& what, const std::string& remedy) const {
    throw Error(ErrorCode::bad_fsm, what, {.element = this->description(), .remedy = remedy});
  }

  Duration period_{0};
};

}  // namespace mauve
