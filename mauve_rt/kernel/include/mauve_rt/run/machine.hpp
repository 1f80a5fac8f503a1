// SPDX-License-Identifier: LGPL-3.0-or-later
// Machine: steps one component's fsm from wait to wait, on its grid. It has no thread and waits for nobody.
#pragma once

#include <algorithm>
#include <cstdint>
#include <exception>
#include <optional>
#include <span>

#include "mauve_rt/base/context.hpp"
#include "mauve_rt/base/present_state.hpp"
#include "mauve_rt/base/seam/atomic.hpp"
#include "mauve_rt/base/statistics.hpp"
#include "mauve_rt/base/time.hpp"
#include "mauve_rt/base/trace.hpp"
#include "mauve_rt/parts/fsm.hpp"
#include "mauve_rt/run/execution_word.hpp"
#include "mauve_rt/run/task_listener.hpp"
#include "mauve_rt/run/task_settings.hpp"
#include "mauve_rt/run/watchdog.hpp"

namespace mauve {

/// An execution that has ended took longer than it declared, or more CPU time than its worst case.
struct OverBound : std::exception {
  explicit OverBound(time_ns_t bound, time_ns_t cpu = 0) : bound_ns(bound), cpu_ns(cpu) {}
  time_ns_t bound_ns;
  time_ns_t cpu_ns;  // that it used, where the bound is a budget of CPU time
};

/// A wait of a new fsm that goes on for the wait of the same name of the fsm before.
struct KeptWait {
  const State* before;
  const State* now;
  time_ns_t place_ns;  // of its end within a period of the new fsm
};

/// One component's fsm and where it is in it: the logical clock, the grid, what it counts, what it traces.
///
/// Whoever runs it - a task's thread, a simulation, a test - starts it, and when the wait under way is over releases it and
/// enters one state after the other up to the next wait:
///
///     machine.start(instant);
///     if (now >= machine.due_ns()) {
///       machine.release(now);
///       machine.leave_wait();
///       while (machine.enter_next() == Machine::Entered::execution) {}
///     }
///
/// What a state or a guard throws, a bound that was passed, and an overrun whose policy is fault, come out of the last two;
/// whoever runs it parks it then.
///
/// | member                  | written by                                | read by    | order                           |
/// | ----------------------- | ----------------------------------------- | ---------- | ------------------------------- |
/// | fsm_, core_             | ordinary threads, parked; commits         | who runs it| parking; it takes commits itself|
/// | clock_, ring_, watchdog_| the same, parked                          | who runs it| parking; the thread's creation  |
/// | reference_ns_,          | the same; commits                         | anyone     | relaxed: lone numbers           |
/// | deployment_ns_,         |                                           |            |                                 |
/// | period_ns_              |                                           |            |                                 |
/// | wait_bound_ns_          | the same                                  | watchdog   | relaxed: a hint when to look    |
/// | context_, statistics_   | who runs it                               | anyone     | relaxed: lone facts             |
/// | current_, released_ns_, | who runs it                               | anyone     | relaxed: lone facts             |
/// | entered_ns_             |                                           |            |                                 |
/// | listening_              | ordinary threads                          | who runs it| its own: task_listener.hpp      |
/// | present_                | who runs it                               | anyone     | its own: present_state.hpp      |
/// | execution_              | who runs it, who times it out, who removes | all of them| its own: execution_word.hpp     |
/// | waiting_ ...            | who runs it                               | who runs it| its own                         |
class Machine {
 public:
  /// What enter_next() has entered.
  enum class Entered : std::uint8_t {
    execution,  // and left again: the next state is to be entered
    wait,       // until due_ns(), or an event
    timed_out,  // an execution, and it timed out before it began or ended
  };

  /// The settings are whoever runs it's, and may change while it is parked. [setup]
  explicit Machine(const TaskSettings& settings) noexcept
      : settings_(settings), clock_(&MonotonicClock::instance()) {}
  Machine(const Machine&) = delete;
  Machine& operator=(const Machine&) = delete;

  // ---- what it runs: parked, or in a commit

  /// [rt]
  void set_parts(const FsmBase& fsm, CoreBinding* core, time_ns_t period_ns) MAUVE_RT;
  /// The core that it runs; nullptr: none is bound. [rt]
  const CoreBase* core() const MAUVE_RT { return core_ != nullptr ? core_->core : nullptr; }
  /// Releases of another clock's time are no more. [rt]
  void set_clock(const Clock& clock) MAUVE_RT {
    clock_ = &clock;
    active_ns_ = kNever;
    entered_ns_.store(0, std::memory_order_relaxed);
  }
  /// Where it traces; nullptr: nowhere. [rt]
  void set_ring(TraceRing* ring) MAUVE_RT { ring_ = ring; }
  /// Who is told of executions that have a bound; nullptr: nobody. [rt]
  void set_watchdog(Watchdog* watchdog) MAUVE_RT { watchdog_ = watchdog; }
  /// Counts the grid from the epoch; returns its first instant. [rt]
  time_ns_t join(time_ns_t epoch_ns) MAUVE_RT;
  /// The next start falls back on this epoch; the grid stays. [rt]
  void set_deployment(time_ns_t epoch_ns) MAUVE_RT;
  /// Counts the grid from this instant until the next join(), or from the deployment's again. [rt]
  void count_from(std::optional<time_ns_t> reference_ns) MAUVE_RT;
  /// The grid now; a commit may change it any moment. [rt], anyone
  Grid grid() const MAUVE_RT {
    return {.reference_ns = reference_ns_.load(std::memory_order_relaxed),
            .period_ns = period_ns_.load(std::memory_order_relaxed)};
  }

  // ---- its steps, by who runs it

  /// Waits for the initial state from now on. That is due at the instant; where it is no wait, not sooner after the last
  /// release than the fsm's waits for events allow. [rt]
  void start(time_ns_t instant_ns) MAUVE_RT;
  /// Waits in this wait of its fsm from now on, which ends at the instant: the place of another machine of the same fsm. [rt]
  void start_in(const State& wait, time_ns_t instant_ns) MAUVE_RT;
  /// The end of the wait under way is no sooner than this; the instants in between are left out. [rt]
  void skip_to(time_ns_t instant_ns) MAUVE_RT { set_clock_ns(std::max(clock_ns(), instant_ns)); }
  /// The wait under way; nullptr: parked, or started and not released yet. [rt]
  const State* present_wait() const MAUVE_RT { return next_ == nullptr ? waiting_ : nullptr; }
  /// Gives up its place. [rt]
  void park() MAUVE_RT;
  /// Whether it was started and not parked since. [rt]
  bool is_started() const MAUVE_RT { return waiting_ != nullptr; }
  /// The instant that the wait under way ends at; kForever while parked. [rt]
  time_ns_t due_ns() const MAUVE_RT;
  /// The wait is over, at this instant. [rt]
  void release(time_ns_t actual_ns) MAUVE_RT;
  /// Asks the guards of the wait that was released where it leads. [rt] as far as the guards are
  void leave_wait();
  /// Enters the state that follows, an execution to its end. [rt] as far as the states are
  Entered enter_next();
  /// Takes an event that has come, if the wait under way is for one and has none yet. [rt]
  void take_event() MAUVE_RT;
  /// Before another fsm is put in, or the same starts again: settles for what becomes of the event that the wait under way
  /// was released for, or would be. An execution state as the initial one is released in its place; else it is put back for
  /// the waits to come. [rt]
  void leave_event_to(const State& initial) MAUVE_RT;
  /// Before another fsm with this period is put in: goes on in its wait of the same name, where it has one and the pending
  /// instant lies on its grid; else false, and nothing is changed. [rt]
  bool keep_place(std::span<const KeptWait> waits, time_ns_t period_ns) MAUVE_RT;
  /// Before another fsm without event waits is put in, whose place is not kept: waits for its initial state, and refers to no
  /// state of the fsm before. The caller starts or parks it next. [rt]
  void give_up_place_for(const State& initial) MAUVE_RT {
    if (is_started()) waiting_ = next_ = &initial;
  }
  /// Whether the wait's end is fixed: it is for no event, or one has come. [rt]
  bool is_settled() const MAUVE_RT { return event_settled_; }
  /// Started, and not woken ahead of its first release yet. [rt]
  bool is_cold() const MAUVE_RT { return is_cold_; }
  /// Fetches what its next release needs. [rt]
  void warm_up() MAUVE_RT;

  // ---- its part in a change that is made in its wait

  /// What begins now is to last no longer than this, nor to use more CPU time than the budget (0: any); false when who runs it
  /// has timed out. [rt]
  bool begin_execution(time_ns_t began_ns, time_ns_t limit_ns, time_ns_t budget_ns = 0) MAUVE_RT;
  /// It has ended; false when it timed out before. [rt]
  bool end_execution() MAUVE_RT { return execution_.end(); }
  /// It is about to park, and nothing is under way any more; false when it timed out before. [rt]
  bool leave() MAUVE_RT { return execution_.leave(); }
  /// Whether a wait is to be entered next. [rt]
  bool is_at_wait() const MAUVE_RT { return next_ != nullptr && next_->is_wait; }
  /// Whether that would be an overrun. [rt]
  bool is_late() const MAUVE_RT {
    return is_at_wait() && next_->event == nullptr && boundary_ns_ > later_by(clock_ns(), next_->duration_ns);
  }
  /// Reads the clock for what follows. [rt]
  time_ns_t look_at_clock() MAUVE_RT { return boundary_ns_ = clock_->now_ns(); }
  /// Instants that passed since then are skipped whatever the overrun policy; returns how many. One that has passed by less
  /// than a period is released late, as after any wait. One that was over a period late by then is the component's own overrun.
  /// In a wait for an event an event that has come ends the wait. Of a sporadic component the timeout counts as the period, and
  /// its wait, or its wait for the start, ends now. [rt]
  std::int64_t skip_lost(time_ns_t since_ns, time_ns_t now_ns) MAUVE_RT;
  /// Executes at no clock before this one any more: T of a change that it has taken. [rt]
  void change_at(time_ns_t instant_ns) MAUVE_RT;
  /// An event that has ended the wait under way counts as one of this instant at the earliest. [rt]
  void delay_event_to(time_ns_t instant_ns) MAUVE_RT;
  /// Whether the wait under way is for an event. [rt]
  bool waits_for_event() const MAUVE_RT {
    const State* const wait = present_wait();
    return wait != nullptr && wait->event != nullptr;
  }
  /// Whether a job may be pending, or executing, whose clock is this one or an earlier one. What is told of a wait, its pending instant,
  /// moves on only when the next wait is entered, as the last step of that. [rt], anyone, of one that is started
  bool may_have_job_at(time_ns_t clock_ns) const MAUVE_RT {
    const std::optional<PresentState::Fact> fact = present_.look();
    return !fact || !fact->is_wait || fact->since_ns <= clock_ns;
  }
  /// The last clock at which it began to execute, or T - 1 of its last change if that is later. [rt]; other threads once it
  /// is parked or timed out.
  time_ns_t entered_ns() const MAUVE_RT { return entered_ns_.load(std::memory_order_relaxed); }
  /// All instants to come are later by the same, so that the initial state is entered on the new epoch's grid and no two
  /// instants come closer together. Returns by how much: less than a period. A start falls back on set_deployment() still. [rt]
  time_ns_t resynchronise(time_ns_t epoch_ns) MAUVE_RT;
  /// Where the instant pending belongs: the waits since the initial state, modulo g. [rt]
  time_ns_t grid_place_ns() const MAUVE_RT { return grid_place_ns_; }
  /// The present state's name in the trace; 0: none yet. [rt], anyone
  std::uint32_t state_name() const MAUVE_RT { return current_.load(std::memory_order_relaxed); }
  /// Tells the present wait anew. [rt]
  void tell_wait() MAUVE_RT;

  // ---- its trace

  /// [rt]
  void trace(TraceKind kind, std::uint32_t name = 0, std::int64_t a = 0, std::int64_t b = 0,
             std::int64_t c = 0) MAUVE_RT {
    if (ring_ != nullptr) ring_->push(kind, name, a, b, c);
  }
  void trace_at(time_ns_t time_ns, TraceKind kind, std::uint32_t name, std::int64_t a = 0, std::int64_t b = 0,
                std::int64_t c = 0) MAUVE_RT {
    if (ring_ != nullptr) ring_->push_at(time_ns, kind, name, a, b, c);
  }
  void trace_deployment() MAUVE_RT;

  // ---- what anyone may ask

  /// [rt]
  const Clock& clock() const MAUVE_RT { return *clock_; }
  Context& context() MAUVE_RT { return context_; }
  const Context& context() const MAUVE_RT { return context_; }
  /// The logical clock. [rt]
  time_ns_t clock_ns() const MAUVE_RT { return context_.clock_ns.load(std::memory_order_relaxed); }
  const TaskStatistics& statistics() const MAUVE_RT { return statistics_; }
  /// When the last release was; 0: there was none. [rt], anyone
  time_ns_t released_ns() const MAUVE_RT { return released_ns_.load(std::memory_order_relaxed); }
  /// Who is told of what befalls it. [rt]
  TaskListening& listening() MAUVE_RT { return listening_; }
  const PresentState& present() const MAUVE_RT { return present_; }
  /// The earliest instant at which a bounded execution, under way or foreseen, can be over its bound; kForever: it wakes
  /// the watchdog itself. [rt]
  time_ns_t earliest_excess_ns() const MAUVE_RT;
  /// For who times it out. [rt]
  ExecutionWord& execution() MAUVE_RT { return execution_; }
  const ExecutionWord& execution() const MAUVE_RT { return execution_; }

 private:
  static constexpr time_ns_t kNever = INT64_MIN;

  bool execute(const State& state);
  time_ns_t begin_budget(time_ns_t budget_ns) MAUVE_RT;
  const State* successor(const State& state) const;
  void enter_wait(const State& state);
  void handle_overrun(const State& state, time_ns_t now_ns);
  time_ns_t timeout_ns() const MAUVE_RT;
  void tell_late_wakeup(time_ns_t now_ns) MAUVE_RT;
  void tell_late_response() MAUVE_RT;
  void set_clock_ns(time_ns_t instant) noexcept {
    context_.clock_ns.store(instant, std::memory_order_relaxed);
  }

  const TaskSettings& settings_;
  const Clock* clock_;
  Watchdog* watchdog_{nullptr};
  TraceRing* ring_{nullptr};
  const FsmBase* fsm_{nullptr};
  CoreBinding* core_{nullptr};
  Atomic<time_ns_t> reference_ns_{0};
  Atomic<time_ns_t> deployment_ns_{0};  // the reference of the deployment's grid
  Atomic<time_ns_t> period_ns_{0};
  Atomic<time_ns_t> wait_bound_ns_{0};  // or budget of what follows a wait; 0: none, or it cannot be foreseen

  Context context_;
  TaskStatistics statistics_;
  TaskListening listening_;
  Atomic<std::uint32_t> current_{0};
  Atomic<time_ns_t> released_ns_{0};
  Atomic<time_ns_t> entered_ns_{0};
  ExecutionWord execution_;
  PresentState present_;

  // The state it waits in; the initial one before its first release; nullptr: parked.
  const State* waiting_{nullptr};
  const State* next_{nullptr};   // the one to be entered; nullptr: the wait's guards tell when it has ended
  time_ns_t wait_from_ns_{0};    // the logical clock on entering an event wait
  time_ns_t earliest_ns_{0};     // before which that wait does not end: T of a change that was taken in it
  time_ns_t event_ns_{kNever};   // of the event that fixed the end of the wait under way
  time_ns_t active_ns_{kNever};  // the logical clock of the last release that was no mere start into a wait
  bool event_settled_{true};
  bool is_cold_{false};
  time_ns_t boundary_ns_{0};  // when the last state, commit or wait ended, read once
  time_ns_t grid_place_ns_{0};
};

}  // namespace mauve
