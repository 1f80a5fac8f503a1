// SPDX-License-Identifier: LGPL-3.0-or-later
// A task's part in commits (commit.hpp): its slot, its votes, its takes.
#include <algorithm>
#include <stdexcept>
#include <utility>

#include "mauve_rt/base/contract.hpp"
#include "mauve_rt/base/seam/futex.hpp"
#include "mauve_rt/run/task.hpp"

namespace mauve {

namespace {

constexpr std::int64_t kInVain = 2;  // of an armed record: it went on without the change

}  // namespace

// ---- the slot: the requester's side

bool Task::wait_slot(time_ns_t until_ns) noexcept {
  std::uint32_t seen = slot_.load(std::memory_order_acquire);
  while ((seen & kSlot) != kEmpty) {
    if (simulated_) {
      // A change that lets time pass may have been called off meanwhile: it retracts nothing before it comes back.
      Participant& posted = *participant_.load(std::memory_order_relaxed);
      return posted.commit->look().is_off() && retract(posted, until_ns);
    }
    if (slot_.compare_exchange_weak(seen, seen | kWaited, std::memory_order_acq_rel) &&
        !futex_wait_until(slot_, seen | kWaited, until_ns))
      return (slot_.load(std::memory_order_acquire) & kSlot) == kEmpty;
    seen = slot_.load(std::memory_order_acquire);
  }
  return true;
}

bool Task::post(Participant& participant, time_ns_t until_ns) noexcept {
  MAUVE_AUDIT(command_mutex_.is_held_here());
  if (!wait_slot(until_ns)) return false;
  participant_.store(&participant, std::memory_order_relaxed);  // slot_ hands it over
  // seq_cst: the thread, on its way into a park or its end, sees this, or this thread sees that it has parked or ended
  slot_.store(kPosted, std::memory_order_seq_cst);
  notify_commit();
  if (!simulated_ && ended_.load(std::memory_order_seq_cst) != 0)
    participant.commit->call_off(Commit::Off::withdrawn, this);
  return true;
}

void Task::notify_commit() noexcept {
  control_.fetch_or(kCommit, std::memory_order_acq_rel);
  futex_wake_all(control_);
}

bool Task::retract(const Participant& participant, time_ns_t until_ns) noexcept {
  std::uint32_t seen = slot_.load(std::memory_order_acquire);
  for (;;) {
    // relaxed: nobody else stores this one, and it is not stored again
    if ((seen & kSlot) == kEmpty || participant_.load(std::memory_order_relaxed) != &participant) return true;
    if ((seen & kSlot) == kPosted) {
      if (!slot_.compare_exchange_weak(seen, kEmpty, std::memory_order_acq_rel)) continue;
      control_.fetch_and(~kCommit, std::memory_order_acq_rel);
      return true;
    }
    if (simulated_) return true;
    if (slot_.compare_exchange_weak(seen, seen | kWaited, std::memory_order_acq_rel) &&
        !futex_wait_until(slot_, seen | kWaited, until_ns))
      return false;
    seen = slot_.load(std::memory_order_acquire);
  }
}

// ---- the slot: the machine's side

bool Task::enter_slot() noexcept {
  std::uint32_t seen = slot_.load(std::memory_order_seq_cst);
  while ((seen & kSlot) == kPosted) {
    if (slot_.compare_exchange_weak(seen, (seen & kWaited) | kBusy, std::memory_order_acq_rel)) return true;
  }
  return false;
}

void Task::leave_slot(std::uint32_t to) noexcept {
  const std::uint32_t before = slot_.exchange(to, std::memory_order_acq_rel);
  MAUVE_EXPECTS((before & kSlot) == kBusy);
  if ((before & kWaited) != 0) futex_wake_all(slot_);
}

/// Votes, and takes a change that is made. False when the component has parked.
/// Throws when adopt and take of the new core took longer than it declared: the change is in, and its first fault.
bool Task::visit_posted() {
  control_.fetch_and(~kCommit, std::memory_order_acq_rel);  // before the look: a later notice is not lost
  if (slot_.load(std::memory_order_acquire) == kEmpty) return true;
  return settle_visit(visit_slot());
}

bool Task::settle_visit(Visit visit) {
  if (visit == Visit::timed_out) park_timed_out();
  if (visit != Visit::goes_on) return false;
  const time_ns_t took = std::exchange(overlong_ns_, 0);
  if (!machine_.is_started()) return true;
  if (took != 0)
    throw std::runtime_error("adopt and take took " + std::to_string(took / us_to_ns(1)) +
                             " us, longer than the new core declares (budget_ns)");
  machine_.tell_wait();
  return true;
}

Task::Visit Task::visit_slot() noexcept {
  if (!enter_slot()) return Visit::goes_on;
  Participant& participant = *participant_.load(std::memory_order_relaxed);
  if (participant.in_flight && !machine_.is_started()) {  // posted just before the park
    end_slot(participant);
    release_withdrawn();
    return Visit::goes_on;
  }
  const time_ns_t began = clock().now_ns();
  if (!participant.has_voted) {
    if (!fits_in_wait(participant) || !participant.commit->is_ready(participant)) {
      leave_slot(kPosted);
      return Visit::goes_on;
    }
    if (!vote(participant, began)) return Visit::timed_out;
  } else if (participant.commit->is_idle()) {
    has_decided_ = participant.commit->close_if_idle(participant);
  }
  return look_at_cut(participant, began);
}

/// In a wait, after its vote.
Task::Visit Task::look_at_cut(Participant& participant, time_ns_t began_ns) noexcept {
  const CutWord seen = participant.commit->look();
  const bool has_no_clock = due_ns() == kForever || !machine_.is_settled();
  if (seen.is_closed() && (has_no_clock || participant.commit->is_new_at(due_ns())))
    return take(participant, began_ns);
  if (!participant.has_voted) {
    trace_refusal(participant, began_ns);
  } else {
    skip_lost(participant, began_ns);
  }
  wake_if_decided(*participant.commit);
  leave_slot(seen.is_off() ? kEmpty : kPosted);
  return Visit::goes_on;
}

/// Its own adopt has refused, or the commit was called off while that lasted.
void Task::trace_refusal(Participant& participant, time_ns_t began_ns) noexcept {
  if (!machine_.is_started()) return;
  const time_ns_t pending = due_ns();
  machine_.trace_at(began_ns, TraceKind::parked, machine_.state_name(), pending);
  for (const CommitAction* action : participant.actions) {
    if (action->trace_id() != 0 && action->adopt_ns != 0)
      machine_.trace(TraceKind::reconfiguration, action->trace_id(), kAdopt, action->adopt_ns);
  }
  const time_ns_t now = machine_.look_at_clock();
  const std::int64_t lost = machine_.skip_lost(began_ns, now);
  participant.lost += lost;
  machine_.trace_at(now, TraceKind::armed, machine_.state_name(), due_ns(), 0, lost);
}

/// Before the release that is due: the cut says in one step whether its clock belongs to the old parts.
bool Task::visit_before_release() {
  if (!enter_slot()) return true;
  Participant& participant = *participant_.load(std::memory_order_relaxed);
  if (!participant.has_voted) {
    leave_slot(kPosted);
    return true;
  }
  const CutWord seen = participant.commit->raise(due_ns(), machine_.waits_for_event());
  if (seen.is_closed() && participant.commit->is_new_at(due_ns()))
    return settle_visit(take(participant, clock().now_ns())) && machine_.is_started();
  leave_slot(seen.is_off() ? kEmpty : kPosted);
  return true;
}

/// With less time left than adopt and take declare, the change is made after the release that is due.
bool Task::fits_in_wait(Participant& participant) const noexcept {
  const time_ns_t due = due_ns();
  if (simulated_ || due == kForever) return true;
  const time_ns_t declared = participant.declared_ns();
  if (declared == 0 || clock().now_ns() + declared <= due) return true;
  participant.unfit_waits.fetch_add(1, std::memory_order_relaxed);
  return false;
}

/// False when the thread timed out meanwhile; the slot is left then.
bool Task::vote(Participant& participant, time_ns_t began_ns) noexcept {
  Commit& commit = *participant.commit;
  if (!machine_.begin_execution(began_ns, participant.limit_ns())) {
    leave_slot(kPosted);
    return false;
  }
  participant.visit_ns.store(began_ns, std::memory_order_relaxed);
  const bool was_parked = parked_.exchange(0, std::memory_order_acq_rel) != 0;
  const bool has_agreed = commit.adopt(participant);
  participant.visit_ns.store(0, std::memory_order_relaxed);
  if (!machine_.end_execution()) {
    await_time_out();
    commit.call_off(Commit::Off::withdrawn, this);
    leave_slot(kEmpty);
    return false;
  }
  if (was_parked) parked_.store(1, std::memory_order_seq_cst);
  if (has_agreed) has_decided_ = commit.vote(participant, machine_.entered_ns());
  return true;
}

Task::Visit Task::take(Participant& participant, time_ns_t began_ns) noexcept {
  Commit& commit = *participant.commit;
  if (!machine_.begin_execution(clock().now_ns(), participant.limit_ns())) {
    wake_if_decided(commit);
    leave_slot(kPosted);
    return Visit::timed_out;
  }
  const bool was_started = machine_.is_started();
  if (was_started && commit.is_idle()) machine_.delay_event_to(commit.instant_ns());
  const bool was_parked = parked_.exchange(0, std::memory_order_acq_rel) != 0;
  const std::uint32_t wait_name = machine_.state_name();
  participant.visit_ns.store(clock().now_ns(), std::memory_order_relaxed);
  participant.parked_ns = began_ns;
  participant.pending_ns = was_started ? due_ns() : 0;
  // Of the time before T: where an end of these moves, what its new owner has written since stays.
  if (was_started && participant.replaces_parts) write_outputs(true, commit.instant_ns() - 1);
  place_kept_ = false;
  overlong_ns_ = commit.take(participant);
  note_taken(commit);
  participant.visit_ns.store(0, std::memory_order_relaxed);
  const bool has_timed_out = !machine_.end_execution();
  if (has_timed_out) await_time_out();
  const bool stops = was_started && participant.afterwards == Afterwards::stop;
  if (stops || has_timed_out || !was_started) join_new_epoch(participant);
  if (was_parked && !has_timed_out) parked_.store(1, std::memory_order_seq_cst);
  if (was_started && !participant.is_silent) trace_take(participant);
  if (has_timed_out) {
    participant.released.store(Participant::kSuperseded, std::memory_order_release);
  } else if (!stops) {
    go_on_with(participant, was_started);
  }
  participant.armed_ns = machine_.look_at_clock();
  const bool goes_on = !has_timed_out && !stops && machine_.is_started();
  // In adopt and take: they are no overrun of the component. Counted by what lies between the pending instant and the release.
  const std::int64_t lost = goes_on ? machine_.skip_lost(began_ns, participant.armed_ns) : 0;
  if (participant.period_ns == 0) participant.lost += lost;  // a sporadic one has no instants to count there
  participant.resumes_ns = due_ns();
  if (was_started && (!participant.is_silent || lost != 0))
    machine_.trace_at(participant.armed_ns, TraceKind::armed, wait_name, due_ns(), 1, lost);
  if (stops && !has_timed_out) park_stopped();
  wake_if_decided(commit);
  pass(participant);
  if (has_timed_out) return Visit::timed_out;
  return stops ? Visit::parks : Visit::goes_on;
}

/// Of a component that does not go on: it starts on the new epoch.
void Task::join_new_epoch(const Participant& participant) noexcept {
  if (const time_ns_t epoch_ns = participant.new_epoch_ns(); epoch_ns != 0) join_newer(epoch_ns);
}

/// A take that hung may end after a later epoch was given. Each writer looks afterwards whether a later epoch has come, so that the last
/// one to write writes the latest epoch.
void Task::note_newer(time_ns_t epoch_ns, bool moves_grid) noexcept {
  time_ns_t latest = epoch_ns_.load(std::memory_order_relaxed);  // relaxed: the exchange has the last word
  // acq_rel: who finds the later epoch here writes the grid after who has written the earlier one
  while (latest < epoch_ns && !epoch_ns_.compare_exchange_weak(latest, epoch_ns, std::memory_order_acq_rel)) {
  }
  latest = std::max(latest, epoch_ns);
  do {
    if (moves_grid)
      machine_.join(latest);
    else
      machine_.set_deployment(latest);
  } while (!epoch_ns_.compare_exchange_strong(latest, latest, std::memory_order_acq_rel));
}

/// The start itself looks for the latest epoch: a visit of the component's thread may make a repaired component STOPPED at any moment.
void Task::join_when_it_starts(time_ns_t epoch_ns) noexcept {
  note_newer(epoch_ns, false);
  // At rest it has the grid at once. Under the lock no start and no change is posted: only a visit could start it, and there is none.
  if (!command_mutex_.try_lock()) return;
  const LockGuard lock(command_mutex_, std::adopt_lock);
  if (claim()) {
    join_newer(epoch_ns);  // its fallback counts from there
    give_up_claim();
  } else if (is_parked() && (slot_.load(std::memory_order_acquire) & kSlot) == kEmpty) {
    join_newer(epoch_ns);
  }
}

void Task::note_taken(const Commit& commit) noexcept {
  machine_.change_at(commit.instant_ns());
  taken_ns_.store(commit.instant_ns(), std::memory_order_relaxed);
  if (shadow_.is_set()) [[unlikely]]
    note_swap(commit.instant_ns());
}

/// After its own take: the wake-up of an ordinary thread is no part of a component's blackout.
void Task::wake_if_decided(Commit& commit) noexcept {
  if (std::exchange(has_decided_, false)) commit.wake_requester();
}

void Task::pass(Participant& participant) noexcept {
  const bool is_late = participant.commit->is_answered();
  participant.commit->pass(participant);
  leave_slot(kEmpty);
  if (is_late) signal_change();  // it can be completed
}

void Task::go_on_with(Participant& participant, bool was_started) noexcept {
  const time_ns_t epoch_ns = participant.new_epoch_ns();
  const bool restarts = participant.afterwards == Afterwards::restart && !place_kept_;
  if (!was_started) {
    if (!restarts) return;
    if (!simulated_) counters_.mark();
    regain_priority();
    return start_machine(start_on(participant.start_clock_ns));
  }
  if (epoch_ns != 0) {
    note_newer(epoch_ns, false);  // a later one may have come for the next start
    participant.shift_ns = machine_.resynchronise(epoch_ns);
  }
  if (!restarts && (epoch_ns != 0 || place_kept_)) machine_.trace_deployment();
  if (restarts) start_machine(restart_instant(participant));
  participant.grid = grid();
  participant.grid_place_ns = machine_.grid_place_ns();
  if (Participant* earlier = awaiting_release_.exchange(&participant, std::memory_order_acq_rel)) {
    earlier->released.store(Participant::kSuperseded, std::memory_order_release);
    futex_wake_all(earlier->released);
  }
}

/// In flight nothing is to be made ready any more: the new machine takes the pending instant, if it is one of its own.
time_ns_t Task::restart_instant(const Participant& participant) noexcept {
  if (participant.start_clock_ns) return start_on(participant.start_clock_ns);
  const bool is_pending =
      machine_.is_settled() && participant.pending_ns != kForever;  // else an event may come any time
  const time_ns_t earliest =
      std::max(participant.commit->instant_ns(), is_pending ? participant.pending_ns : clock().now_ns());
  return grid().period_ns == 0 ? earliest : grid().first_not_before(earliest);
}

void Task::trace_take(const Participant& participant) noexcept {
  machine_.trace_at(participant.parked_ns, TraceKind::parked, machine_.state_name(), participant.pending_ns);
  for (const CommitAction* action : participant.actions) {
    if (action->trace_id() == 0) continue;  // a mere check
    machine_.trace(TraceKind::reconfiguration, action->trace_id(), kAdopt, action->adopt_ns);
    machine_.trace(TraceKind::reconfiguration, action->trace_id(), kTake, action->take_ns,
                   participant.commit->instant_ns());
  }
}

/// Skips the instants that passed in an adopt without a take: they are no overrun of the component.
void Task::skip_lost(Participant& participant, time_ns_t began_ns) noexcept {
  if (!machine_.is_started()) return;
  const time_ns_t now = machine_.look_at_clock();
  const time_ns_t pending = due_ns();
  const std::int64_t lost = machine_.skip_lost(began_ns, now);
  if (lost == 0) return;
  participant.lost += lost;
  machine_.trace_at(began_ns, TraceKind::parked, machine_.state_name(), pending);
  machine_.trace_at(now, TraceKind::armed, machine_.state_name(), due_ns(), kInVain, lost);
}

/// On the way into a park, and to the thread's end: calls off a commit that is open, takes one that is made. One that was
/// posted for a parked component stays, unless the thread ends. Whether it has taken one. The slot of one that was called off
/// stays busy until release_withdrawn().
bool Task::settle_slot(bool ends) noexcept {
  if (is_abandoned() || !enter_slot()) return false;  // a removed one that hung touches nothing any more
  Participant& participant = *participant_.load(std::memory_order_relaxed);
  if (participant.in_flight || ends) return end_slot(participant);
  leave_slot(kPosted);
  return false;
}

bool Task::end_slot(Participant& participant) noexcept {
  Commit& commit = *participant.commit;
  if (commit.call_off_quietly(Commit::Off::withdrawn, this)) {
    MAUVE_EXPECTS(withdrawn_ == nullptr);
    withdrawn_ = &participant;
    return false;
  }
  const bool was_started = machine_.is_started();
  if (was_started && commit.is_idle()) machine_.delay_event_to(commit.instant_ns());
  participant.parked_ns = clock().now_ns();
  participant.pending_ns = was_started ? due_ns() : 0;
  // Its outputs are not written yet: where a take hangs, a stop by force or the watchdog writes them.
  const bool is_watched =
      was_started && machine_.begin_execution(participant.parked_ns, participant.limit_ns());
  commit.take(participant);
  note_taken(commit);
  if (is_watched && !machine_.end_execution()) await_time_out();
  join_new_epoch(participant);
  participant.armed_ns = participant.resumes_ns = machine_.look_at_clock();
  participant.released.store(Participant::kSuperseded,
                             std::memory_order_release);  // it parks, so none follows
  if (was_started) {
    trace_take(participant);
    machine_.trace_at(participant.armed_ns, TraceKind::armed, machine_.state_name(), participant.pending_ns,
                      1);
  }
  pass(participant);
  return true;
}

/// Once the state is published: a stop does not wait for the requester of the change that it calls off.
void Task::release_withdrawn() noexcept {
  if (withdrawn_ == nullptr) return;
  std::exchange(withdrawn_, nullptr)->commit->wake_requester();
  leave_slot(kEmpty);
}

void Task::take_parked(Participant& participant) noexcept {
  MAUVE_AUDIT(command_mutex_.is_held_here());
  MAUVE_AUDIT(participant.left_behind || is_parked());
  Commit& commit = *participant.commit;
  participant.parked_ns = clock().now_ns();
  commit.take(participant);
  if (!participant.left_behind || !participant.only_epoch)
    note_taken(commit);  // else its thread uses its machine still
  join_new_epoch(participant);
  // A shutdown may have come before the commit held the task.
  if (can_take_up_start() && participant.afterwards == Afterwards::restart) {
    post_start(start_on(participant.start_clock_ns));
  } else {
    end_wait_for_start();
  }
  participant.armed_ns = clock().now_ns();
  commit.pass(participant);
}

// ---- after a commit

bool Task::wait_release(const Participant& participant, time_ns_t until_ns) noexcept {
  while (participant.released.load(std::memory_order_acquire) == 0) {
    if (until_ns <= monotonic_now_ns() || !futex_wait_until(participant.released, 0, until_ns)) break;
  }
  return participant.released.load(std::memory_order_acquire) == Participant::kReleased;
}

void Task::forget_release(Participant& participant) noexcept {
  Participant* mine = &participant;
  // Out of the slot the machine cannot reach it any more; not in the slot, it has written it, or does this moment.
  if (awaiting_release_.compare_exchange_strong(mine, nullptr, std::memory_order_acq_rel)) return;
  wait_release(participant, kForever);
}

void Task::write_outputs(bool commit, time_ns_t time_ns) noexcept {
  for (const auto& port : shell()->ports()) {
    if (!commit) {
      port->write_stopped(time_ns);
    } else if (port->output().on_commit == OutputPolicy::set_zero) {
      port->write_zero(time_ns);
    }
  }
}

}  // namespace mauve
