// SPDX-License-Identifier: LGPL-3.0-or-later
// What becomes of an execution that is over its bound: rule 11. The watchdog's side first, then the machine's.
#include <pthread.h>

#include <algorithm>

#include "mauve_rt/base/seam/futex.hpp"
#include "mauve_rt/run/task.hpp"

namespace mauve {

bool Task::time_out_if_over(time_ns_t now_ns) noexcept {
  const auto execution = machine_.execution().look();
  if (!execution) return false;
  const time_ns_t left_ns =
      execution->may_be_over_budget(now_ns) ? execution->cpu_left_ns(thread_.cpu_now_ns()) : 0;
  const bool is_over_budget = left_ns < 0;
  if (!is_over_budget && !execution->is_over(now_ns)) return false;
  if (!machine_.execution().time_out(*execution)) return false;
  time_out_note_.bound_ns = is_over_budget ? execution->budget_ns : execution->limit_ns;
  time_out_note_.cpu_ns = is_over_budget ? execution->budget_ns - left_ns : 0;
  time_out_note_.is_visit = (slot_.load(std::memory_order_acquire) & kSlot) == kBusy;
  time_out_note_.when_ns = now_ns;
  carry_out_time_out();
  return true;
}

time_ns_t Task::earliest_excess_ns(time_ns_t now_ns) const noexcept {
  const auto execution = machine_.execution().look();
  if (!execution || !execution->may_be_over_budget(now_ns)) return machine_.earliest_excess_ns();
  // Kept from its processor, or asleep, it has CPU time left: it takes as long at least to use that up.
  const time_ns_t used_up_ns = later_by(now_ns, execution->cpu_left_ns(thread_.cpu_now_ns()));
  return std::min(used_up_ns, ExecutionWord::end_ns(execution->began_ns, execution->limit_ns));
}

bool Task::time_out(std::string what, time_ns_t now_ns) {
  const auto execution = machine_.execution().look();
  return execution && time_out(*execution, std::move(what), now_ns);
}

/// A stop has been ordered by then, so that the thread finds its way out when what it does ends.
bool Task::time_out_unless_waiting() {
  // A watched execution while the slot is taken by its thread is a visit there: no state runs then.
  const auto visit = machine_.execution().look();
  if (visit && (slot_.load(std::memory_order_acquire) & kSlot) == kBusy)
    return time_out(*visit, "stopped by force while the adopt or take of its new part was executing",
                    clock().now_ns());
  const auto execution = machine_.execution().look_at_any();
  // After that look: one that began an adopt in between has another number, one that came to a wait is not harmed here.
  const std::optional<PresentState::Fact> fact = machine_.present().look();
  if (!execution || !fact || fact->is_wait || fact->since_ns == 0) return false;
  const std::string state = TraceNames::word(fact->name);
  return time_out(*execution, "stopped by force while state " + state + " was executing", clock().now_ns());
}

bool Task::time_out(const ExecutionWord::Look& execution, std::string what, time_ns_t now_ns) {
  auto text = std::make_shared<const std::string>(std::move(what));
  if (!machine_.execution().time_out(execution)) return false;
  time_out_note_.what = std::move(text);
  time_out_note_.when_ns = now_ns;
  carry_out_time_out();
  return true;
}

/// FAULTED first, so that whoever has to act can; then the processor for the others; then the outputs.
void Task::carry_out_time_out() noexcept {
  time_out_note_.where = machine_.state_name();
  if (time_out_note_.bound_ns != 0) tell_over_declared();
  swap_fault(time_out_note_);  // the fault before this one stays there: a watchdog frees nothing
  publish_state(ComponentState::faulted);
  if (has_thread_.load(std::memory_order_acquire)) {
    const sched_param ordinary{};
    MAUVE_RT_TRUSTED(pthread_setschedparam(thread_.handle(), SCHED_OTHER, &ordinary));  // what a fault costs
    demoted_ = true;
  }
  if (!make_safe(false)) {
    outputs_.store(kLeft, std::memory_order_release);
    if (watchdog_ != nullptr) watchdog_->write_what_is_left();
  }
  machine_.execution().set_demoted();
}

/// Writes the outputs of all ends that are its own: those that it has, and those that a change that is made gives it and that it
/// has yet to take. The thread stands in a state, an adopt or a take, and waits for the end of the time-out on its way back.
bool Task::make_safe(bool may_wait) noexcept {
  bool all_written = true;
  // In an adopt or a take it holds its slot. Else a change that waits there cannot go away while this thread holds it.
  const bool is_visiting = (slot_.load(std::memory_order_acquire) & kSlot) == kBusy;
  const bool has_entered = !is_visiting && enter_slot();
  Participant* const coming =
      is_visiting || has_entered ? participant_.load(std::memory_order_relaxed) : nullptr;
  const CutWord cut = coming != nullptr ? coming->commit->look() : CutWord{};
  // Of an end that a change has moved to a successor its floor drops what has an earlier time; one that it gains has its own floor.
  const time_ns_t own_ns = std::max(machine_.clock_ns(), taken_ns_.load(std::memory_order_relaxed));
  const time_ns_t new_ns = cut.is_closed() ? std::max(own_ns, cut.instant_ns()) : own_ns;
  for (const auto& port : shell()->ports()) port->close();
  for (const auto& port : shell()->ports()) all_written &= port->make_safe(may_wait, own_ns);
  if (cut.is_closed()) {
    for (CommitAction* action : coming->actions) all_written &= action->make_safe(may_wait, new_ns);
  }
  if (has_entered) leave_slot(kPosted);
  return all_written;
}

bool Task::take_outputs_left() noexcept {
  std::uint32_t left = kLeft;
  return outputs_.compare_exchange_strong(left, kWriting, std::memory_order_acq_rel);
}

bool Task::write_outputs_left() noexcept {
  // Relaxed: a hint. Where the thread holds no lock, none of its resources' locks is held for ever by it.
  const bool may_wait = locks_held_ == nullptr || locks_held_->load(std::memory_order_relaxed) == 0;
  const bool all_written = make_safe(may_wait);
  outputs_.store(all_written ? kAllWritten : kLeft, std::memory_order_release);
  futex_wake_all(outputs_);
  if (all_written) changes_.bump();  // the fault's text is another one now
  return all_written;
}

void Task::abandon() noexcept {
  control_.fetch_or(kExit, std::memory_order_acq_rel);
  std::uint32_t left = kLeft;
  outputs_.compare_exchange_strong(left, kAllWritten, std::memory_order_acq_rel);
  machine_.execution().abandon();
}

/// The thread's way out of an execution that timed out.
void Task::park_timed_out(bool has_taken_change) noexcept {
  if (machine_.execution().come_back()) {
    time_out_note_ = {};
    take_back_outputs();
    return end_in_fault(has_taken_change);
  }
  machine_.park();  // removed meanwhile: kExit is set, and nobody is to hear of it
  parked_.store(1, std::memory_order_release);
  release_withdrawn();
}

/// In an adopt or a take that timed out: who times it out, and who writes what is left, look at the change in the slot.
void Task::await_time_out() noexcept {
  machine_.execution().await_time_out();
  take_back_outputs();
}

void Task::take_back_outputs() noexcept {
  for (;;) {
    std::uint32_t left = kLeft;
    if (outputs_.compare_exchange_strong(left, kAllWritten, std::memory_order_acq_rel)) return;
    if (left == kAllWritten) return;
    futex_wait_until(outputs_, left, kForever);
  }
}

void Task::regain_priority() noexcept {
  if (!demoted_) return;
  demoted_ = false;
  if (!has_thread_ || facts_.policy != "SCHED_FIFO") return;
  const sched_param own{.sched_priority = facts_.priority};
  pthread_setschedparam(pthread_self(), SCHED_FIFO, &own);
}

}  // namespace mauve
