// SPDX-License-Identifier: LGPL-3.0-or-later
// A task's steps around its machine's: commands, events, faults. Everything between a start and a park is real-time code.
#include <algorithm>
#include <stdexcept>
#include <utility>

#include "mauve_rt/base/error.hpp"
#include "mauve_rt/base/pi_mutex.hpp"
#include "mauve_rt/base/seam/futex.hpp"
#include "mauve_rt/run/shadow.hpp"
#include "mauve_rt/run/task.hpp"

namespace mauve {

/// Steps of the component's own, whatever they throw.
template <typename Steps>
void Task::run_guarded(Steps&& steps) noexcept {
  if (in_resume_) return;  // in virtual time a state may stop its own component, or raise an event for it
  in_resume_ = true;
  const auto held_before = PiMutex::held_by_this_thread();
  PiMutex::was_misused_by_this_thread();  // what others did on a simulation's thread is not this component's
  try {
    steps();
  } catch (const OverBound& failure) {
    park_faulted(nullptr, failure.bound_ns, failure.cpu_ns);
  } catch (const std::exception& failure) {
    PiMutex::let_go_of_all_but(held_before);
    park_faulted(failure.what());
  } catch (...) {
    PiMutex::let_go_of_all_but(held_before);
    park_faulted("an exception that is no std::exception");
  }
  in_resume_ = false;
  if (simulated_) clock().due_changed(*this);
}

void Task::resume() noexcept {
  run_guarded([this] { step(); });
}

void Task::visit_simulated() noexcept {
  run_guarded([this] { visit_posted(); });
}

void Task::step() {
  if (!machine_.is_started()) return take_up_start();
  const std::uint32_t control = control_.load(std::memory_order_acquire);
  if ((control & kStop) != 0) return end_run();
  if ((control & kRevert) != 0) take_up_revert();
  if ((control & kCommit) != 0 && !visit_posted()) return;
  if ((control & kEvent) != 0) settle_event();
  const time_ns_t now = clock().now_ns();
  // Again, after the clock: this thread may have been kept from its processor, and an event that came before the timeout ends the wait.
  if (now >= due_ns()) settle_event();
  if (now < due_ns()) return;
  // relaxed: what this thread has voted for it finds; for what it has not its later vote raises the cut
  if (slot_.load(std::memory_order_relaxed) != kEmpty) {
    if (!visit_before_release() || clock().now_ns() < due_ns()) return;
  }
  release(now);
  run_to_next_wait();
}

void Task::take_up_start() {
  if (!visit_posted() || machine_.is_started()) return;  // the change has started it
  if ((control_.load(std::memory_order_acquire) & kStart) == 0) return;
  if (removed_.load(std::memory_order_acquire)) {
    withdraw_start();
    return;
  }
  parked_.store(0, std::memory_order_seq_cst);  // before the bit goes: is_parked() sees one of them
  if ((control_.fetch_and(~kStart, std::memory_order_seq_cst) & kStart) == 0) {
    parked_.store(1, std::memory_order_seq_cst);  // a stop has withdrawn it
    return;
  }
  if (!simulated_) counters_.mark();
  regain_priority();
  start_machine(start_at_ns_);
  end_wait_for_start();
}

void Task::start_machine(time_ns_t instant_ns) noexcept {
  machine_.start(instant_ns);
  // The time in which it was stopped is no time to move in: the first write may move as far as in any release.
  for (const auto& port : shell()->ports())
    port->resume_slew(later_by(machine_.clock_ns(), -grid().period_ns));
  if (shadow_.is_set()) [[unlikely]]
    start_shadow();
  parked_.store(0, std::memory_order_release);
  publish_state(ComponentState::running);
  machine_.trace_deployment();
  machine_.trace(TraceKind::start, 0, machine_.clock_ns());
}

void Task::release(time_ns_t actual_ns) noexcept {
  machine_.release(actual_ns);
  if (awaiting_release_.load(std::memory_order_relaxed) == nullptr) return;
  if (Participant* place = awaiting_release_.exchange(nullptr, std::memory_order_acq_rel)) {
    place->release_nominal_ns = machine_.clock_ns();
    place->release_actual_ns = actual_ns;
    place->released.store(Participant::kReleased, std::memory_order_release);
    futex_wake_all(place->released);
  }
}

void Task::run_to_next_wait() {
  machine_.leave_wait();
  for (;;) {
    const std::uint32_t control = control_.load(std::memory_order_acquire);
    if ((control & kStop) != 0) return end_run();
    if ((control & kGivenUp) != 0 && machine_.execution().has_timed_out()) [[unlikely]]
      return park_timed_out();
    if (shadow_.is_set() && machine_.is_at_wait()) [[unlikely]]
      blend_release();
    switch (machine_.enter_next()) {
      case Machine::Entered::execution:
        continue;
      case Machine::Entered::wait:
        if ((control_.load(std::memory_order_relaxed) & kEvent) != 0) settle_event();
        // relaxed: who posts this moment sets the bit itself
        if (slot_.load(std::memory_order_relaxed) != kEmpty)
          control_.fetch_or(kCommit, std::memory_order_acq_rel);
        if (probation_.is_set()) [[unlikely]]
          watch_probation();
        if (shadow_.is_set()) [[unlikely]]
          capture_release();
        return;
      case Machine::Entered::timed_out:
        return park_timed_out();
    }
  }
}

void Task::settle_event() noexcept {
  if (machine_.is_settled()) return;
  // The bit goes first: an event that comes after the look at its time sets it again and is not lost.
  control_.fetch_and(~kEvent, std::memory_order_acq_rel);
  machine_.take_event();
}

void Task::signal_event() noexcept {
  const std::uint32_t before = control_.fetch_or(kEvent, std::memory_order_acq_rel);
  if (simulated_) {
    if (!machine_.is_started() || machine_.is_settled()) return;
    settle_event();
    clock().due_changed(*this);
  } else if ((before & kEvent) == 0) {
    futex_wake_all(control_);
  }
}

void Task::await(const Atomic<std::uint32_t>& word, std::uint32_t number, time_ns_t until_ns) noexcept {
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

void Task::end_run() noexcept {
  end_blend(ShadowCause::stop);
  if (!ramps_down()) park_stopped();
}

/// False: the next step of outputs with a max_slew is the value of the stop itself, or they are not to be waited for. Else one step of
/// them is written at each instant of the grid, in the place of a release.
bool Task::ramps_down() noexcept {
  const time_ns_t period_ns = grid().period_ns;
  if (period_ns == 0 || (control_.load(std::memory_order_acquire) & (kExit | kAtOnce)) != 0) return false;
  const auto& ports = shell()->ports();
  const time_ns_t instant_ns = machine_.clock_ns();
  // As at a start: the time without a write before the stop is no time to move in.
  for (const auto& port : ports) port->resume_slew(later_by(instant_ns, -period_ns));
  const auto is_beyond = [&](const auto& port) { return port->ramps_down_at(instant_ns); };
  if (std::none_of(ports.begin(), ports.end(), is_beyond)) return false;
  control_.fetch_and(~kCommit, std::memory_order_acq_rel);
  const bool has_new_parts = settle_slot();  // a change does not wait for the end of the ramp
  release_withdrawn();
  if (has_new_parts) return false;
  if (!is_ramping_.exchange(true, std::memory_order_relaxed)) {
    for (const auto& port : ports) {
      if (!port->is_ramped()) port->write_stopped(instant_ns);
    }
  }
  if (clock().now_ns() < due_ns()) return true;
  for (const auto& port : ports) {
    if (port->is_ramped()) port->write_zero(instant_ns);
  }
  machine_.skip_to(later_by(instant_ns, period_ns));
  machine_.tell_wait();
  return true;
}

void Task::park_stopped() noexcept {
  settle_slot();
  if (!machine_.leave()) return park_timed_out();
  write_outputs(false);
  machine_.trace(TraceKind::stop, machine_.state_name(), machine_.clock_ns());
  park(ComponentState::stopped);
}

void Task::park_faulted(const char* what, time_ns_t bound_ns, time_ns_t cpu_ns) noexcept {
  if (!machine_.leave()) return park_timed_out();
  if (bound_ns != 0) tell_over_declared();
  FaultNote note{.what = what != nullptr ? std::make_shared<const std::string>(what) : nullptr,
                 .bound_ns = bound_ns,
                 .cpu_ns = cpu_ns,
                 .where = machine_.state_name(),
                 .when_ns = clock().now_ns()};
  swap_fault(note);
  end_in_fault();
}

void Task::tell_over_declared() noexcept {
  machine_.listening().tell(
      [&](TaskListener& listener) { listener.on_over_declared(machine_.clock().now_ns()); });
}

void Task::end_in_fault(bool has_taken_change) noexcept {
  const bool is_violation = note_fault_on_probation();
  if (!is_violation) end_blend(ShadowCause::live_fault);
  const bool has_new_parts = settle_slot() || has_taken_change;
  if (machine_.execution().has_timed_out()) return park_timed_out(has_new_parts);  // in the take of new parts
  machine_.trace(TraceKind::fault, machine_.state_name(), machine_.clock_ns());
  if (is_violation && put_back_after_fault(has_new_parts)) return;
  end_blend(ShadowCause::live_fault);
  write_outputs(false);
  const bool stays = has_new_parts || !machine_.is_started() || is_to_stop() || is_taken_over();
  is_falling_back_.store(true, std::memory_order_relaxed);  // relaxed: the exchange publishes it
  CommitAction* const fallback = stays ? nullptr : fallback_.exchange(nullptr, std::memory_order_acq_rel);
  // One that was renewed while an fsm on probation went out was made ready for that fsm.
  const bool falls_back = fallback != nullptr && fallback->adopt();
  if (!falls_back) {
    is_falling_back_.store(false, std::memory_order_release);
    return park(ComponentState::faulted);
  }
  // Not parked in between: nobody may take parts away that are put in this moment.
  publish_state(ComponentState::faulted);
  settle_slot();
  release_withdrawn();
  fall_back(*fallback);
}

void Task::fall_back(CommitAction& fallback) noexcept {
  fallback.take();
  machine_.trace(TraceKind::reconfiguration, fallback.trace_id(), kTake, 0);
  is_falling_back_.store(false, std::memory_order_release);
  for (const auto& port : shell()->ports()) port->reopen();
  regain_priority();
  start_machine(next_instant());
}

void Task::park(ComponentState state) noexcept {
  machine_.park();
  revert_in_park();
  overlong_ns_ = 0;
  is_ramping_.store(false, std::memory_order_relaxed);
  control_.fetch_and(~(kStop | kEvent | kRevert | kGivenUp | kAtOnce), std::memory_order_acq_rel);
  parked_.store(1, std::memory_order_seq_cst);  // seq_cst: a requester that has not seen it has posted before
  publish_state(state);
  ended_runs_.fetch_add(
      1, std::memory_order_release);  // release: who sees the next run has seen the end of this one
  settle_slot();                      // last: who is refused finds the state that tells why
  release_withdrawn();
}

void Task::publish_state(ComponentState state) noexcept {
  state_.store(static_cast<std::uint32_t>(state), std::memory_order_release);
  futex_wake_all(state_);
  changes_.bump();
  machine_.listening().tell(
      [&](TaskListener& listener) { listener.on_state(machine_.clock().now_ns(), state); });
}

}  // namespace mauve
