// SPDX-License-Identifier: LGPL-3.0-or-later
// A task's part in commits (commit.hpp).
#include "mauve_rt/futex.hpp"
#include "mauve_rt/task.hpp"

namespace mauve {

namespace {

constexpr int kMaxDeferrals = 3;

}  // namespace

void Task::post(Participant& place) noexcept {
  commit_budget_ns_.store(place.commit->budget_ns(), std::memory_order_relaxed);
  place_.store(&place, std::memory_order_seq_cst);
  control_.fetch_or(kCommit, std::memory_order_acq_rel);
  futex_wake_all(control_);
}

void Task::retract() noexcept {
  control_.fetch_and(~kCommit, std::memory_order_acq_rel);
  // seq_cst, as the machine's two: either it finds the place empty, or we find it at the commit and wait.
  place_.store(nullptr, std::memory_order_seq_cst);
  while (at_commit_.load(std::memory_order_seq_cst) != 0) futex_wait_until(at_commit_, 1, kForever);
}

/// With less time left than the change may take, it is better made after the release that is due; but not put
/// off for ever.
bool Task::may_commit_now() const noexcept {
  const time_ns_t left = due_ns() - clock_->now_ns();
  return left > commit_budget_ns_.load(std::memory_order_relaxed) || deferrals_ >= kMaxDeferrals;
}

void Task::come_to_commit() noexcept {
  at_commit_.store(1, std::memory_order_seq_cst);
  if (Participant* place = place_.load(std::memory_order_seq_cst)) visit(*place);
  at_commit_.store(0, std::memory_order_seq_cst);
  futex_wake_all(at_commit_);
}

/// Not by a plain store: a watchdog's FAULTED, or a STOPPING, of this moment has to stay.
void Task::exchange_state(ComponentState from, ComponentState to) noexcept {
  auto expected = static_cast<std::uint32_t>(from);
  state_.compare_exchange_strong(expected, static_cast<std::uint32_t>(to), std::memory_order_acq_rel);
}

void Task::visit(Participant& place) noexcept {
  Commit& commit = *place.commit;
  const time_ns_t due = due_ns();
  place.parked_ns = clock_->now_ns();
  place.pending_ns = due;
  place.arrived.store(true, std::memory_order_relaxed);
  exchange_state(ComponentState::running, ComponentState::held);
  const Commit::Answer answer = commit.arrive();
  if (answer == Commit::Answer::wait) {
    const bool in_good_time = due - place.parked_ns > commit.budget_ns();
    if (!commit.wait_others(in_good_time ? due - commit.budget_ns() : due)) {
      place.arrived.store(false, std::memory_order_relaxed);
      left_gate_ = true;
      boundary_ns_ = place.parked_ns;
      exchange_state(ComponentState::held, ComponentState::running);
      return;
    }
  }
  deferrals_ = 0;
  left_gate_ = false;
  control_.fetch_and(~kCommit, std::memory_order_acq_rel);
  exchange_state(ComponentState::held, ComponentState::running);
  if (answer != Commit::Answer::closed) continue_after(place);
}

void Task::continue_after(Participant& place) noexcept {
  const Commit& commit = *place.commit;
  const std::uint32_t wait_name = current_.load(std::memory_order_relaxed);
  if (ring_ != nullptr) ring_->push_at(place.parked_ns, TraceKind::parked, wait_name, place.pending_ns);
  for (const CommitAction* action : commit.actions()) {
    if (action->task != this || action->trace_id() == 0) continue;  // another component's, or a mere check
    trace(TraceKind::reconfiguration, action->trace_id(), kAdopt, action->adopt_ns);
    if (commit.committed()) trace(TraceKind::reconfiguration, action->trace_id(), kTake, action->take_ns);
  }
  const bool committed = commit.committed();
  if (committed && place.afterwards != Afterwards::stop) {
    if (place.afterwards == Afterwards::restart) start_machine(next_instant(place.start_clock_ns));
    if (Participant* earlier = awaiting_release_.exchange(&place, std::memory_order_acq_rel)) {
      earlier->released.store(Participant::kSuperseded, std::memory_order_release);
      futex_wake_all(earlier->released);
    }
  }
  place.armed_ns = boundary_ns_ = clock_->now_ns();
  trace_at(place.armed_ns, TraceKind::armed, wait_name, due_ns(), committed ? 1 : 0);
  if (committed && place.afterwards == Afterwards::stop) park_stopped();
}

void Task::hold_parked(Participant& place) const noexcept {
  place.parked_ns = place.armed_ns = clock_->now_ns();
  if (place.in_flight) place.pending_ns = due_ns();
}

void Task::finish_parked(Participant& place, bool committed) noexcept {
  if (place.in_flight) {
    continue_after(place);
  } else if (committed && place.afterwards == Afterwards::restart) {
    post_start(next_instant(place.start_clock_ns));
    wait_started();
  }
}

void Task::refuse_commit() noexcept {
  if ((control_.load(std::memory_order_acquire) & kCommit) == 0) return;
  at_commit_.store(1, std::memory_order_seq_cst);
  if (Participant* place = place_.load(std::memory_order_seq_cst)) place->commit->refuse();
  control_.fetch_and(~kCommit, std::memory_order_acq_rel);
  at_commit_.store(0, std::memory_order_seq_cst);
  futex_wake_all(at_commit_);
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
