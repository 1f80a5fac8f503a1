// SPDX-License-Identifier: LGPL-3.0-or-later
// The state machine of a task. Everything between a start and a park is real-time code.
#include <stdexcept>
#include <utility>

#include "mauve_rt/base/error.hpp"
#include "mauve_rt/base/futex.hpp"
#include "mauve_rt/base/pi_mutex.hpp"
#include "mauve_rt/run/task.hpp"

namespace mauve {

namespace {

/// An execution that has ended took longer than it declared.
struct OverBound : std::exception {
  explicit OverBound(time_ns_t bound) : bound_ns(bound) {}
  time_ns_t bound_ns;
};

}  // namespace

void Task::resume() noexcept {
  if (in_resume_) return;  // in virtual time a state may stop its own component, or raise an event for it
  in_resume_ = true;
  const auto held_before = PiMutex::held_by_this_thread();
  PiMutex::was_misused_by_this_thread();  // what others did on a simulation's thread is not this component's
  try {
    step();
  } catch (const OverBound& failure) {
    park_faulted(nullptr, failure.bound_ns);
  } catch (const std::exception& failure) {
    PiMutex::let_go_of_all_but(held_before);
    park_faulted(failure.what());
  } catch (...) {
    PiMutex::let_go_of_all_but(held_before);
    park_faulted("an exception that is no std::exception");
  }
  in_resume_ = false;
  if (simulated_) clock_->due_changed(*this);
}

void Task::step() {
  if (waiting_ == nullptr) return take_up_start();
  const std::uint32_t control = control_.load(std::memory_order_acquire);
  if ((control & kStop) != 0) return park_stopped();
  if ((control & kCommit) != 0 && may_commit_now()) {
    come_to_commit();
    if (std::exchange(is_abandoned_, false)) return park_condemned();
    if (waiting_ == nullptr) return;
    tell_wait();
  }
  if (!event_settled_ && (control & kEvent) != 0) settle_event();
  const time_ns_t now = clock_->now_ns();
  if (now < due_ns()) return;
  release(now);
  run_to_next_wait();
}

time_ns_t Task::due_ns() const noexcept {
  if (waiting_ == nullptr) return kForever;
  return event_settled_ ? clock_ns() : later_by(wait_from_ns_, waiting_->duration_ns);
}

void Task::take_up_start() noexcept {
  const std::uint32_t control = control_.load(std::memory_order_acquire);
  if ((control & kCommit) != 0) refuse_commit();  // posted just before the park, too late for park() to see
  if ((control & kStart) == 0) return;
  control_.fetch_and(~kStart, std::memory_order_acq_rel);
  if (!simulated_) counters_.mark();
  regain_priority();
  start_machine(start_at_ns_);
  started_.store(1, std::memory_order_release);
  futex_wake_all(started_);
}

void Task::start_machine(time_ns_t instant_ns) noexcept {
  waiting_ = next_ = &fsm_->initial();
  is_cold_ = true;
  event_settled_ = true;
  set_clock_ns(instant_ns);
  grid_place_ns_ = 0;
  current_.store(waiting_->trace_id, std::memory_order_relaxed);
  tell_wait();
  parked_.store(0, std::memory_order_release);
  publish_state(ComponentState::running);
  trace_deployment();
  trace(TraceKind::start, 0, instant_ns);
}

void Task::trace_deployment() noexcept {
  const Grid now = grid();
  trace(TraceKind::deployment, 0, now.reference_ns - settings_.offset_ns, settings_.offset_ns, now.period_ns);
}

void Task::release(time_ns_t actual_ns) noexcept {
  if (!event_settled_) set_clock_ns(due_ns());  // the time is up, and no event has come
  event_settled_ = true;
  statistics_.releases.fetch_add(1, std::memory_order_relaxed);
  statistics_.wakeup.record(actual_ns - clock_ns());
  boundary_ns_ = actual_ns;
  trace_at(actual_ns, TraceKind::release, waiting_->trace_id, clock_ns(), actual_ns, grid_place_ns_);
  if ((control_.load(std::memory_order_relaxed) & kCommit) != 0 && !left_gate_) pass_commit();
  left_gate_ = false;
  if (awaiting_release_.load(std::memory_order_relaxed) == nullptr) return;
  if (Participant* place = awaiting_release_.exchange(nullptr, std::memory_order_acq_rel)) {
    place->release_nominal_ns = clock_ns();
    place->release_actual_ns = actual_ns;
    place->released.store(Participant::kReleased, std::memory_order_release);
    futex_wake_all(place->released);
  }
}

void Task::run_to_next_wait() {
  const State* const initial = &fsm_->initial();
  const State* state = next_ != nullptr ? next_ : leave_wait();
  for (;;) {
    if ((control_.load(std::memory_order_acquire) & kStop) != 0) return park_stopped();
    if (state == initial) context_.instant_ns.store(clock_ns(), std::memory_order_relaxed);
    current_.store(state->trace_id, std::memory_order_relaxed);
    if (state->is_wait) return enter_wait(*state);
    state = execute(*state);
    if (state == nullptr) return park_condemned();
  }
}

const State* Task::execute(const State& state) {
  const time_ns_t began = boundary_ns_;
  present_.tell({.since_ns = began, .bound_ns = state.max_execution_ns, .name = state.trace_id});
  trace_at(began, TraceKind::state_begin, state.trace_id);
  if (state.max_execution_ns != 0) begin_execution(began, state.max_execution_ns);
  const auto& methods = fsm_->methods();
  const auto held_before = PiMutex::held_by_this_thread();  // not 0 where a simulated neighbour kept a lock
  methods[state.action].run(*core_);
  const State* next = successor(state);
  clock_->spend(state.simulated_ns());
  boundary_ns_ = clock_->now_ns();
  const bool was_condemned = state.max_execution_ns != 0 && !end_execution();
  trace_at(boundary_ns_, TraceKind::state_end, state.trace_id);
  state.execution_time->record(boundary_ns_ - began);
  check_locks(held_before);
  if (was_condemned) return nullptr;
  if (state.max_execution_ns != 0 && boundary_ns_ - began > state.max_execution_ns)
    throw OverBound(state.max_execution_ns);
  return next;
}

/// Where the state leads: where its first transition does whose guard holds.
const State* Task::successor(const State& state) const {
  const auto& methods = fsm_->methods();
  for (const Transition& transition : state.transitions) {
    if (methods[transition.guard].test(*core_)) return transition.to;
  }
  return state.next;
}

/// The wait is over: now its guards are asked.
const State* Task::leave_wait() {
  if (waiting_->transitions.empty()) return waiting_->next;
  present_.tell({.since_ns = boundary_ns_, .name = waiting_->trace_id});
  const auto held_before = PiMutex::held_by_this_thread();
  const State* next = successor(*waiting_);
  check_locks(held_before);
  boundary_ns_ = clock_->now_ns();
  return next;
}

/// A component that waits holds no lock, and none was taken twice on the way. Lets go of the lock first: others may wait.
void Task::check_locks(int held_before) {
  if (PiMutex::was_misused_by_this_thread())
    throw std::logic_error("a lock was taken twice by its holder, or let go by who did not hold it");
  if (PiMutex::held_by_this_thread() <= held_before) return;
  PiMutex::let_go_of_all_but(held_before);
  throw std::logic_error("a lock is still held at the end of the state");
}

void Task::enter_wait(const State& state) {
  waiting_ = &state;
  next_ = nullptr;
  if (state.event == nullptr) {
    set_clock_ns(later_by(clock_ns(), state.duration_ns));
    if (const time_ns_t period = grid().period_ns; period != 0) {
      grid_place_ns_ += state.duration_ns % period;
      if (grid_place_ns_ >= period) grid_place_ns_ -= period;
    }
    trace_at(boundary_ns_, TraceKind::wait, state.trace_id, clock_ns());
    if (boundary_ns_ > clock_ns()) handle_overrun(state, boundary_ns_);
    return tell_wait();
  }
  wait_from_ns_ = clock_ns();
  event_settled_ = false;
  trace_at(boundary_ns_, TraceKind::wait, state.trace_id, due_ns());
  settle_event();  // one may have come meanwhile
  if (!event_settled_ && boundary_ns_ > due_ns()) {
    set_clock_ns(due_ns());
    event_settled_ = true;
    handle_overrun(state, boundary_ns_);
  }
  tell_wait();
}

void Task::tell_wait() noexcept {
  present_.tell({.since_ns = due_ns(), .name = waiting_->trace_id, .is_wait = true});
}

/// An event fixes the end of the wait: not before min_interarrival has passed since the last release.
void Task::settle_event() noexcept {
  // The bit goes first: an event that comes after the look at its time sets it again and is not lost.
  control_.fetch_and(~kEvent, std::memory_order_acq_rel);
  const std::optional<time_ns_t> came = waiting_->event->consume();
  if (!came) return;
  set_clock_ns(std::max(wait_from_ns_ + waiting_->min_interarrival_ns, *came));
  event_settled_ = true;
  tell_wait();
}

void Task::signal_event() noexcept {
  const std::uint32_t before = control_.fetch_or(kEvent, std::memory_order_acq_rel);
  if (simulated_) {
    if (waiting_ == nullptr || event_settled_) return;
    settle_event();
    clock_->due_changed(*this);
  } else if ((before & kEvent) == 0) {
    futex_wake_all(control_);
    if (place_.is_lent()) place_.use([](Participant& place) { place.commit->poke(); });
  }
}

void Task::await(const std::atomic<std::uint32_t>& word, std::uint32_t number, time_ns_t until_ns) noexcept {
  for (;;) {
    const std::uint32_t control = control_.load(std::memory_order_acquire);
    if (word.load(std::memory_order_acquire) == number || (control & (kStop | kExit)) != 0) return;
    if ((control & kAwaited) != 0) {
      // Of an earlier wait, or the word was set since the look at it; cleared, the next signal changes control_.
      control_.fetch_and(~kAwaited, std::memory_order_acq_rel);
    } else if (!futex_wait_until(control_, control, until_ns)) {
      return;
    }
  }
}

void Task::signal_awaited() noexcept {
  control_.fetch_or(kAwaited, std::memory_order_acq_rel);
  futex_wake_all(control_);
}

void Task::handle_overrun(const State& state, time_ns_t now_ns) {
  const time_ns_t missed = clock_ns();
  const time_ns_t period = grid().period_ns;
  statistics_.overruns.fetch_add(1, std::memory_order_relaxed);
  std::int64_t skipped = 0;
  if (settings_.overrun == OverrunPolicy::skip) {
    if (period == 0) {
      set_clock_ns(now_ns);  // a sporadic component has no grid to keep
    } else {
      skipped = (now_ns - missed + period - 1) / period;
      set_clock_ns(missed + skipped * period);
    }
    statistics_.skipped.fetch_add(static_cast<std::uint64_t>(skipped), std::memory_order_relaxed);
  }
  trace(TraceKind::overrun, state.trace_id, missed, now_ns, skipped);
  if (settings_.overrun == OverrunPolicy::fault) throw std::runtime_error("overrun, and its policy is fault");
  if (settings_.overrun == OverrunPolicy::catch_up && period != 0 &&
      (now_ns - missed) / period + 1 > settings_.max_backlog) {
    throw std::runtime_error("overrun: more instants are owed than max_backlog allows");
  }
}

void Task::park_stopped() noexcept {
  write_outputs(false);
  trace(TraceKind::stop, current_.load(std::memory_order_relaxed), clock_ns());
  park(ComponentState::stopped);
}

void Task::park_faulted(const char* what, time_ns_t bound_ns) noexcept {
  if (!end_execution()) return park_condemned();
  FaultNote note{.what = what != nullptr ? std::make_shared<const std::string>(what) : nullptr,
                 .bound_ns = bound_ns,
                 .where = current_.load(std::memory_order_relaxed),
                 .when_ns = clock_->now_ns()};
  swap_fault(note);
  end_in_fault();
}

void Task::end_in_fault() noexcept {
  trace(TraceKind::fault, current_.load(std::memory_order_relaxed), clock_ns());
  write_outputs(false);
  const bool stays = (control_.load(std::memory_order_acquire) & (kStop | kExit)) != 0;
  CommitAction* const fallback = stays ? nullptr : fallback_.exchange(nullptr, std::memory_order_acq_rel);
  if (fallback == nullptr) return park(ComponentState::faulted);
  // Not parked in between: nobody may take parts away that are put in this moment.
  publish_state(ComponentState::faulted);
  refuse_commit();
  fall_back(*fallback);
}

void Task::fall_back(CommitAction& fallback) noexcept {
  fallback.take();
  trace(TraceKind::reconfiguration, fallback.trace_id(), kTake, 0);
  for (const auto& port : shell_->ports()) port->reopen();
  regain_priority();
  start_machine(next_instant(std::nullopt));
}

void Task::park(ComponentState state) noexcept {
  waiting_ = next_ = nullptr;
  present_.tell({.name = current_.load(std::memory_order_relaxed)});
  deferrals_ = 0;
  left_gate_ = false;
  overlong_ns_ = 0;
  control_.fetch_and(~(kStop | kEvent), std::memory_order_acq_rel);
  parked_.store(1, std::memory_order_release);
  publish_state(state);
  refuse_commit();  // last: who is refused finds the state that tells why
}

void Task::publish_state(ComponentState state) noexcept {
  state_.store(static_cast<std::uint32_t>(state), std::memory_order_release);
  futex_wake_all(state_);
  changes_.bump();
}

}  // namespace mauve
