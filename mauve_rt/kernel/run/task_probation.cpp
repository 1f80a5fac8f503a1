// SPDX-License-Identifier: LGPL-3.0-or-later
// A task's part in the probation of its core (probation.hpp): it finds violations, and puts the old core back.
#include "mauve_rt/base/seam/futex.hpp"
#include "mauve_rt/run/probation.hpp"
#include "mauve_rt/run/task.hpp"

namespace mauve {

void Task::end_probation(ProbationCause why) noexcept {
  if (!probation_.is_set()) return;
  probation_.use([&](Probation& probation) { probation.conclude(why); });
  probation_.revoke(kForever);  // waits for no thread: who runs the machine is the only user
}

/// A release has reached its next wait.
void Task::watch_probation() noexcept {
  probation_.use([this](Probation& probation) {
    if (probation.end_release()) put_back_in_wait(probation);
  });
}

void Task::notify_revert() noexcept {
  control_.fetch_or(kRevert, std::memory_order_acq_rel);
  if (simulated_) return resume();
  futex_wake_all(control_);
}

void Task::take_up_revert() noexcept {
  control_.fetch_and(~kRevert, std::memory_order_acq_rel);  // before the look: a later request is not lost
  probation_.use([this](Probation& probation) {
    if (probation.note_request()) put_back_in_wait(probation);
  });
}

/// On the way into a park: a request that was to be carried out in the next step is not lost.
void Task::revert_in_park() noexcept {
  if ((control_.load(std::memory_order_acquire) & kRevert) == 0) return;
  probation_.use([](Probation& probation) {
    if (probation.note_request()) probation.put_back();
  });
}

/// As the take of a change within a wait: position and pending instant stay.
void Task::put_back_in_wait(Probation& probation) noexcept {
  if (leaves_core_to_change()) return;
  const time_ns_t began = clock().now_ns();
  const std::uint32_t wait_name = machine_.state_name();
  place_kept_ = true;  // unless the old fsm goes in where it has no wait for the present one
  if (!probation.put_back()) return;
  write_outputs(true, machine_.entered_ns());
  const time_ns_t now = machine_.look_at_clock();
  machine_.trace_at(began, TraceKind::parked, wait_name, due_ns());
  machine_.trace_at(now, TraceKind::reconfiguration, probation.trace_id(), kTake, now - began,
                    machine_.entered_ns() + 1);  // T: all later releases are the old core's
  if (!place_kept_) start_machine(due_ns());     // before its first release: the grid is the same
  machine_.trace_at(now, TraceKind::armed, wait_name, due_ns(), 1);
  signal_change();
}

/// Whether a change is made that replaces parts, and that is yet to be taken: it was prepared for the core on probation, and
/// ends the probation. One that is not made yet is called off.
bool Task::leaves_core_to_change() noexcept {
  if (!enter_slot()) return false;
  Participant& participant = *participant_.load(std::memory_order_relaxed);
  if (!participant.has_voted || !participant.replaces_parts) {
    leave_slot(kPosted);
    return false;
  }
  const bool is_off = participant.commit->call_off(Commit::Off::withdrawn, this);
  leave_slot(is_off ? kEmpty : kPosted);
  return !is_off;
}

/// Before a change that is made may replace the core: the fault is that of the present one.
bool Task::note_fault_on_probation() noexcept {
  bool is_violation = false;
  probation_.use([&](Probation& probation) {
    const LockGuard lock(fault_mutex_);
    is_violation = probation.note_fault(fault_);
  });
  return is_violation;
}

bool Task::give_up_on_probation(const StateAge& age) {
  // First: the thread looks at the bit when its state ends, and where it has not timed out goes on.
  control_.fetch_or(kGivenUp, std::memory_order_acq_rel);
  const auto execution = machine_.execution().look_at_any();
  const std::optional<PresentState::Fact> fact = machine_.present().look();
  const bool is_same = execution && fact && !fact->is_wait && fact->since_ns != 0 &&
                       clock().now_ns() - fact->since_ns >= age.age_ns;
  const bool is_given_up =
      is_same && time_out(*execution, "hung: state " + age.state + " of the core on probation did not end",
                          clock().now_ns());
  if (!is_given_up) control_.fetch_and(~kGivenUp, std::memory_order_acq_rel);
  return is_given_up;
}

/// The old core goes on elsewhere: nothing goes on here.
bool Task::is_taken_over() noexcept {
  bool is_it = false;
  probation_.use([&](const Probation& probation) { is_it = probation.is_taken_over(); });
  return is_it;
}

/// In place of the end in a fault. False when the core is no longer on probation.
bool Task::put_back_after_fault(bool has_taken_change) noexcept {
  bool is_back = false;
  probation_.use([&](Probation& probation) {
    is_back = probation.put_back();
    if (is_back) machine_.trace(TraceKind::reconfiguration, probation.trace_id(), kTake, 0);
  });
  if (!is_back) return false;
  const bool is_to_stop = this->is_to_stop();
  const bool was_reported = state() == ComponentState::faulted;  // by who timed it out
  if (has_taken_change || !machine_.is_started() || (is_to_stop && was_reported)) {
    write_outputs(false);
    park(ComponentState::faulted);
    return true;
  }
  control_.fetch_and(~kGivenUp, std::memory_order_acq_rel);
  release_withdrawn();
  for (const auto& port : shell()->ports()) port->reopen();
  if (is_to_stop) {
    write_outputs(false);
    machine_.trace(TraceKind::stop, machine_.state_name(), machine_.clock_ns());
    park(ComponentState::stopped);
    return true;
  }
  write_outputs(true, machine_.entered_ns());
  regain_priority();
  start_machine(next_instant());
  return true;
}

void Task::put_back_parked(Probation& probation) noexcept {
  if (!command_mutex_.try_lock()) return;
  const LockGuard lock(command_mutex_, std::adopt_lock);
  if (is_parked() && probation.note_request() && probation.put_back()) signal_change();
}

void Task::revert_here(Probation& probation) noexcept {
  probation.request_here();
  if (!is_parked()) {
    control_.fetch_or(kRevert, std::memory_order_acq_rel);  // for the next step of this thread
  } else if (probation.note_request() && probation.put_back()) {
    signal_change();
  }
}

}  // namespace mauve
