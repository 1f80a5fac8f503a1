// SPDX-License-Identifier: LGPL-3.0-or-later
// A task's part in commits (commit.hpp).
#include <pthread.h>

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "mauve_rt/base/futex.hpp"
#include "mauve_rt/run/task.hpp"

namespace mauve {

namespace {

constexpr int kTries = 3;
constexpr std::int64_t kInVain = 2;  // of an armed record: it went on without a change, the others missing

}  // namespace

void Task::post(Participant& place) noexcept {
  place_.lend(place);
  control_.fetch_or(kCommit, std::memory_order_seq_cst);
  futex_wake_all(control_);
  if (ended_.load(std::memory_order_seq_cst) != 0) withdraw_commit();  // nobody is left to refuse it
}

bool Task::retract(time_ns_t until_ns) noexcept {
  control_.fetch_and(~kCommit, std::memory_order_acq_rel);
  return place_.recall(until_ns);
}

void Task::withdraw_commit() noexcept {
  place_.use([this](Participant& place) { place.commit->call_off(Commit::Off::withdrawn, this); });
}

/// With less time left than the change may take it is better made after the release that is due. A budget that is only
/// reckoned puts it off some times, not for ever.
time_ns_t Task::leaves_gate_at(const Participant& place) const noexcept {
  const time_ns_t due = due_ns();
  if (due == kForever) return kForever;
  const Commit& commit = *place.commit;
  const time_ns_t needed = deferrals_ < kTries ? commit.budget_ns() : commit.declared_ns();
  return due + commit.may_miss(place) * grid().period_ns - needed;
}

bool Task::may_commit_now() noexcept {
  if (left_gate_) return false;
  const time_ns_t now = clock().now_ns();
  bool may = false;
  place_.use([&](Participant& place) { may = now < std::min(due_ns(), leaves_gate_at(place)); });
  return may;
}

/// A release while a commit is posted, in whose wait the budget did not fit.
void Task::pass_commit() noexcept {
  ++deferrals_;
  place_.use([this](Participant& place) {
    place.passed.store(static_cast<std::uint32_t>(deferrals_), std::memory_order_relaxed);
    place.commit->note_came(place);
  });
}

/// Throws when adopt and take of the new core took longer than it declared: the change is in, and its first fault.
void Task::come_to_commit() {
  place_.use([this](Participant& place) { visit(place); });
  const time_ns_t took = std::exchange(overlong_ns_, 0);
  if (took == 0 || !machine_.is_started()) return;
  throw std::runtime_error("adopt and take took " + std::to_string(took / 1000) +
                           " us, longer than the new core declares (budget_ns)");
}

/// Not by a plain store: a watchdog's FAULTED, or a STOPPING, of this moment has to stay.
void Task::exchange_state(ComponentState from, ComponentState to) noexcept {
  auto expected = static_cast<std::uint32_t>(from);
  state_.compare_exchange_strong(expected, static_cast<std::uint32_t>(to), std::memory_order_acq_rel);
}

void Task::visit(Participant& place) noexcept {
  Commit& commit = *place.commit;
  const time_ns_t due = due_ns();
  place.parked_ns = clock().now_ns();
  place.pending_ns = due;
  place.leaves_at_ns.store(leaves_gate_at(place), std::memory_order_relaxed);
  place.holds_until_ns = commit.holds_until_ns(place);
  place.arrived.store(true, std::memory_order_relaxed);
  exchange_state(ComponentState::running, ComponentState::held);
  if (!machine_.begin_execution(place.parked_ns, kForever)) {  // who conducts the commit watches it
    is_abandoned_ = true;
    return;
  }
  const Commit::Answer answer = commit.meet(place);
  if (answer == Commit::Answer::abandoned || !machine_.end_execution()) {
    is_abandoned_ = true;
    return;
  }
  exchange_state(ComponentState::held, ComponentState::running);
  if (answer == Commit::Answer::left) {
    left_gate_ = true;
    place.arrived.store(false, std::memory_order_relaxed);
    return go_on_unchanged(place);
  }
  deferrals_ = 0;
  left_gate_ = false;
  control_.fetch_and(~kCommit, std::memory_order_acq_rel);
  if (answer == Commit::Answer::off) return go_on_unchanged(place);
  overlong_ns_ = place.overlong_ns;
  continue_after(place);
  commit.gone_on(answer == Commit::Answer::made_it);
}

/// Makes a change of which all participants are parked, when this one is to.
bool Task::make_parked() noexcept {
  bool is_mine = false;
  place_.use([&](Participant& place) {
    if (!place.makes_parked) return;
    is_mine = true;
    place.leaves_at_ns.store(kForever, std::memory_order_relaxed);
    parked_.store(0, std::memory_order_release);
    machine_.begin_execution(clock().now_ns(), kForever);  // who conducts the commit watches it
    const Commit::Answer answer = place.commit->meet(place);
    is_abandoned_ = !machine_.end_execution();
    if (is_abandoned_) return;
    parked_.store(1, std::memory_order_release);
    control_.fetch_and(~kCommit, std::memory_order_acq_rel);
    place.commit->gone_on(answer == Commit::Answer::made_it);
  });
  return is_mine;
}

/// Skips the instants that passed at the gate, or in adopt and take; returns how many.
std::int64_t Task::skip_lost(const Participant& place, time_ns_t now_ns) noexcept {
  return machine_.skip_lost(place.parked_ns, place.holds_until_ns != place.pending_ns, now_ns);
}

void Task::go_on_unchanged(Participant& place) noexcept {
  const time_ns_t now = machine_.look_at_clock();
  const std::int64_t lost = skip_lost(place, now);
  if (lost == 0) return;
  place.lost += lost;
  const std::uint32_t wait_name = machine_.state_name();
  machine_.trace_at(place.parked_ns, TraceKind::parked, wait_name, place.pending_ns);
  machine_.trace_at(now, TraceKind::armed, wait_name, due_ns(), kInVain, lost);
}

/// In flight nothing is to be made ready any more: the new machine takes the pending instant, if it is one of its own.
time_ns_t Task::restart_instant(const Participant& place) noexcept {
  if (place.start_clock_ns) return start_on(place.start_clock_ns);
  const time_ns_t earliest =
      machine_.is_settled() ? place.pending_ns : clock().now_ns();  // an event may come any time
  return grid().period_ns == 0 ? earliest : grid().first_not_before(earliest);
}

void Task::continue_after(Participant& place) noexcept {
  const Commit& commit = *place.commit;
  const std::uint32_t wait_name = machine_.state_name();
  machine_.trace_at(place.parked_ns, TraceKind::parked, wait_name, place.pending_ns);
  for (const CommitAction* action : commit.actions()) {
    if (action->task != this || action->trace_id() == 0) continue;  // another component's, or a mere check
    machine_.trace(TraceKind::reconfiguration, action->trace_id(), kAdopt, action->adopt_ns);
    if (commit.committed())
      machine_.trace(TraceKind::reconfiguration, action->trace_id(), kTake, action->take_ns);
  }
  const bool committed = commit.committed();
  if (committed && place.epoch_ns != nullptr) {
    place.shift_ns = machine_.resynchronise(*place.epoch_ns);
    if (place.afterwards == Afterwards::go_on) machine_.trace_deployment();
  }
  if (committed && place.afterwards != Afterwards::stop) {
    if (place.afterwards == Afterwards::restart) start_machine(restart_instant(place));
    place.grid = grid();
    place.grid_place_ns = machine_.grid_place_ns();
    if (Participant* earlier = awaiting_release_.exchange(&place, std::memory_order_acq_rel)) {
      earlier->released.store(Participant::kSuperseded, std::memory_order_release);
      futex_wake_all(earlier->released);
    }
  }
  place.armed_ns = machine_.look_at_clock();
  const bool ends = committed && place.afterwards == Afterwards::stop;
  const std::int64_t lost = ends ? 0 : skip_lost(place, place.armed_ns);
  place.resumes_ns = due_ns();
  machine_.trace_at(place.armed_ns, TraceKind::armed, wait_name, due_ns(), committed ? 1 : 0, lost);
  if (ends) park_stopped();
}

void Task::hold_parked(Participant& place) const noexcept {
  place.parked_ns = place.armed_ns = clock().now_ns();
  if (place.in_flight) place.pending_ns = due_ns();
}

void Task::finish_parked(Participant& place, bool committed) noexcept {
  if (place.in_flight) {
    continue_after(place);
    return clock().due_changed(*this);
  }
  if (committed && place.epoch_ns != nullptr) join(*place.epoch_ns);
  const bool can_start =
      simulated_ || has_thread_;  // a shutdown may have come before the commit held the task
  if (committed && can_start && place.afterwards == Afterwards::restart) {
    post_start(start_on(place.start_clock_ns));
    wait_started();
  }
}

void Task::fault_parked(const std::string& what) {
  FaultNote note{.what = std::make_shared<const std::string>(what), .when_ns = clock().now_ns()};
  swap_fault(note);
  publish_state(ComponentState::faulted);
}

/// But for one that was posted after the park, and which this thread is to make, if it has not ended.
void Task::refuse_commit() noexcept {
  if ((control_.load(std::memory_order_seq_cst) & kCommit) == 0) return;
  const bool makes = ended_.load(std::memory_order_relaxed) == 0;  // written by this thread
  place_.use([&](Participant& place) {
    if (place.makes_parked && makes) return;
    control_.fetch_and(~kCommit, std::memory_order_acq_rel);  // in here: after it the next one may be posted
    place.commit->call_off(Commit::Off::withdrawn, this);
  });
}

void Task::leave_behind(std::shared_ptr<void> used) {
  const std::lock_guard lock(fault_mutex_);
  left_behind_.push_back(std::move(used));
}

bool Task::wait_release(const Participant& place, time_ns_t until_ns) noexcept {
  while (place.released.load(std::memory_order_acquire) == 0) {
    if (until_ns <= monotonic_now_ns() || !futex_wait_until(place.released, 0, until_ns)) break;
  }
  return place.released.load(std::memory_order_acquire) == Participant::kReleased;
}

void Task::forget_release(Participant& place) noexcept {
  Participant* mine = &place;
  // Out of the slot the machine cannot reach it any more; not in the slot, it has written it, or does this moment.
  if (awaiting_release_.compare_exchange_strong(mine, nullptr, std::memory_order_acq_rel)) return;
  wait_release(place, kForever);
}

void Task::write_outputs(bool commit) noexcept {
  for (const auto& port : shell_->ports()) {
    const OutputOptions output = port->output();
    if ((commit ? output.on_commit : output.on_stop) == OutputPolicy::set_zero) port->write_zero();
  }
}

}  // namespace mauve
