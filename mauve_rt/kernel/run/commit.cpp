// SPDX-License-Identifier: LGPL-3.0-or-later
// The requester's side of a commit, and what participants do with its words. A task's own steps are in task_commit.cpp.
#include "mauve_rt/run/commit.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "mauve_rt/base/contract.hpp"
#include "mauve_rt/base/error.hpp"
#include "mauve_rt/base/seam/futex.hpp"
#include "mauve_rt/run/commit_gate.hpp"
#include "mauve_rt/run/task.hpp"

namespace mauve {

namespace {

/// How often a requester that sleeps looks whether a participant stopped, faulted or timed out: no thread tells it.
constexpr time_ns_t kLook = ms_to_ns(20);

}  // namespace

Commit::Commit(std::size_t participants, std::vector<CommitAction*> actions)
    : participants_(participants), actions_(std::move(actions)) {
  for (Participant& participant : participants_) participant.commit = this;
  // relaxed: no thread knows the commit yet
  to_vote_.store(static_cast<std::uint32_t>(participants), std::memory_order_relaxed);
  to_pass_.store(static_cast<std::uint32_t>(participants), std::memory_order_relaxed);
}

Commit::~Commit() {
  if (!is_made()) return;
  for (Participant& participant : participants_) {
    if (participant.has_passed() && participant.in_flight && participant.afterwards != Afterwards::stop)
      participant.task->forget_release(participant);
  }
}

void Commit::assign_actions() {
  order_.clear();
  for (Participant& participant : participants_) {
    participant.actions.clear();
    order_.push_back(&participant);
  }
  std::sort(order_.begin(), order_.end(),
            [](const Participant* a, const Participant* b) { return a->task->number() < b->task->number(); });
  // A task that takes part twice would be locked twice.
  MAUVE_EXPECTS(
      std::adjacent_find(order_.begin(), order_.end(), [](const Participant* a, const Participant* b) {
        return a->task == b->task;
      }) == order_.end());
  posted_ = order_;
  if (is_idle_) {  // the lowest votes last: then its vote finds an idle instant, as a rule
    std::sort(posted_.begin(), posted_.end(), [](const Participant* a, const Participant* b) {
      const int first = a->task->settings().priority, second = b->task->settings().priority;
      return first != second ? first > second : a->task->number() < b->task->number();
    });
  }
  for (CommitAction* action : actions_) {
    Participant* const own = action->task != nullptr ? find(*action->task) : nullptr;
    if (own != nullptr) own->actions.push_back(action);  // else a check, or of an added one that does not run
  }
}

Participant* Commit::find(const Task& task) const noexcept {
  const auto place = std::lower_bound(order_.begin(), order_.end(), task.number(),
                                      [](const Participant* participant, std::uint16_t number) {
                                        return participant->task->number() < number;
                                      });
  return place != order_.end() && (*place)->task == &task ? *place : nullptr;
}

// ---- participants

time_ns_t Participant::limit_ns() const noexcept {
  const time_ns_t declared = declared_ns();
  return declared == 0 ? kForever : later_by(declared, Commit::kPatience);
}

time_ns_t Participant::new_epoch_ns() const noexcept {
  return epoch_lead_ns != 0 ? later_by(commit->instant_ns() - 1, epoch_lead_ns) : 0;
}

bool Commit::adopt(Participant& participant) noexcept {
  const Clock& clock = participant.task->clock();
  time_ns_t began = clock.now_ns();
  const CommitAction* slowest = nullptr;
  for (CommitAction* action : participant.actions) {
    bool has_agreed = false;
    std::exception_ptr why;
    try {
      has_agreed = action->adopt();
    } catch (...) {
      why = std::current_exception();
    }
    const time_ns_t now = clock.now_ns();
    action->adopt_ns = now - began;
    began = now;
    if (slowest == nullptr || action->adopt_ns > slowest->adopt_ns) slowest = action;
    const bool is_late = action->declared_ns() != 0 && action->adopt_ns > action->declared_ns();
    if (has_agreed && !is_late) continue;
    refuse(&participant, *action, why, has_agreed);
    return false;
  }
  if (slowest != nullptr && off() == Off::timed_out) refuse(&participant, *slowest, nullptr, true);
  return cut_.look().is_open();
}

void Commit::refuse(const Participant* participant, const CommitAction& action, std::exception_ptr why,
                    bool is_late) noexcept {
  RefusalState none = RefusalState::none;
  // relaxed: who begins to write has nothing to read
  if (refusal_state_.compare_exchange_strong(none, RefusalState::writing, std::memory_order_relaxed)) {
    refused_by_ = &action;
    refusal_ = std::move(why);
    adopt_was_late_ = is_late;
    refusal_state_.store(RefusalState::complete, std::memory_order_release);
  }
  call_off(Off::withdrawn, participant != nullptr ? participant->task : nullptr);
}

bool Commit::is_ready(Participant& participant) noexcept {
  if (&participant != last_) return true;
  participant.was_asked.store(true, std::memory_order_relaxed);  // relaxed: for a message
  const bool is_last = to_vote_.load(std::memory_order_acquire) == 1;
  bool are_ready = true;
  for (CommitAction* action : participant.actions) are_ready &= action->is_ready(is_last);
  return are_ready;
}

bool Commit::vote(Participant& participant, time_ns_t entered_ns) noexcept {
  MAUVE_EXPECTS(!participant.has_voted);
  const CutWord seen = cut_.raise(entered_ns);
  participant.has_voted = true;
  participant.has_agreed.store(true, std::memory_order_relaxed);  // relaxed: for a message
  if (seen.is_off()) return false;
  const std::uint32_t to_vote = to_vote_.fetch_sub(1, std::memory_order_acq_rel);
  MAUVE_EXPECTS(to_vote != 0);
  if (to_vote != 1) return false;
  if (is_idle_) return close_if_idle(participant);
  cut_.close();
  return true;
}

/// Right because of its order: the cut is looked at first, then what each has pending, and the cut is closed only if it is still the word
/// that was seen. A participant raises the cut before it executes, and what it has pending moves on only when it waits again. So one that
/// executes an old job is seen pending, and one that began after the look has changed the word.
bool Commit::close_if_idle(const Participant& by) noexcept {
  // acquire: with the last vote all raises are seen
  if (to_vote_.load(std::memory_order_acquire) != 0) return false;
  const CutWord seen = cut_.look();
  if (!seen.is_open()) return false;
  const Participant* const pending = find_pending(seen);
  pending_.store(pending, std::memory_order_relaxed);  // relaxed: for a message
  if (pending != nullptr) return false;
  const bool is_lowest =
      is_one_cpu_ && by.in_flight && by.task->settings().priority == closer_->task->settings().priority;
  if (is_lowest || !is_one_cpu_) return cut_.close_if(seen);
  closer_->task->notify_commit();
  return false;
}

/// One that was parked at the start of the commit has none: no start comes before the decision. Neither has one that was timed out.
const Participant* Commit::find_pending(CutWord seen) const noexcept {
  for (const Participant* participant : order_) {
    if (participant->in_flight && participant->task->may_have_job_at(seen.frontier_ns())) return participant;
  }
  return nullptr;
}

time_ns_t Commit::take(Participant& participant) noexcept {
  const Clock& clock = participant.task->clock();
  MAUVE_EXPECTS(is_made() && participant.has_voted);
  time_ns_t began = clock.now_ns();
  time_ns_t overlong = 0;
  for (CommitAction* action : participant.actions) {
    const time_ns_t declared = action->declared_ns();  // of the new core; after take, that is another
    action->instant_ns = instant_ns();
    action->take();
    const time_ns_t now = clock.now_ns();
    action->take_ns = now - began;
    began = now;
    const time_ns_t took = action->adopt_ns + action->take_ns;
    if (declared != 0 && took > declared) overlong = std::max(overlong, took);
  }
  return overlong;
}

void Commit::pass(Participant& participant) noexcept {
  MAUVE_EXPECTS(is_made() &&
                !participant.passed.load(std::memory_order_relaxed));  // relaxed: who passes wrote it
  participant.passed.store(true, std::memory_order_release);
  // The commit may be freed once this was the last one: only the word's address is used after it.
  const std::uint32_t to_pass = to_pass_.fetch_sub(1, std::memory_order_acq_rel);
  MAUVE_EXPECTS(to_pass != 0);
  if (to_pass == 1) futex_wake_all(to_pass_);
}

bool Commit::call_off(Off why, const Task* by) noexcept {
  const bool is_off = call_off_quietly(why, by);
  if (is_off) wake_requester();
  return is_off;
}

bool Commit::call_off_quietly(Off why, const Task* by) noexcept {
  Off none = Off::not_yet;
  // relaxed: the cut's exchange publishes it
  if (off_.compare_exchange_strong(none, why, std::memory_order_relaxed))
    off_by_.store(by, std::memory_order_relaxed);
  cut_.call_off();
  return cut_.look().is_off();
}

void Commit::wake_requester() noexcept {
  MAUVE_EXPECTS(!cut_.look().is_open());
  decided_.store(1, std::memory_order_release);
  futex_wake_all(decided_);
}

Commit::Off Commit::off() const noexcept {
  return cut_.look().is_off() ? off_.load(std::memory_order_relaxed) : Off::not_yet;
}

// ---- the requester

bool Commit::prepare_install() noexcept {
  if (publication_ == nullptr) return true;
  if (!publication_->is_current()) return false;
  cut_.raise(publication_->since_ns());
  return true;
}

void Commit::publish() noexcept {
  MAUVE_EXPECTS(is_made());
  if (publication_ != nullptr) publication_->publish(instant_ns());
}

Commit::Outcome Commit::decide(time_ns_t until_ns, CommitGate& gate) noexcept {
  const time_ns_t now_ns = monotonic_now_ns();
  timeout_ns_ = until_ns > now_ns ? until_ns - now_ns : 0;  // a timeout below 0 has passed long ago
  if (!await_slots(until_ns, gate)) return off() == Off::timed_out ? Outcome::timed_out : Outcome::off;
  // Before it waits for a lock: an urgent commit that needs the same calls it off there, too.
  if (!gate.begin(*this)) return Outcome::stale;
  const bool has_commands = lock(until_ns);
  if (!has_commands) call_off(Off::timed_out);  // unless that is why
  if (has_commands) {
    unfit_ = find_unfit();
    if (unfit_ != nullptr) call_off(Off::withdrawn, unfit_);
    begin();
    gate.look_again(*this);
    if (cut_.look().is_open() && check()) {
      vote_for_parked();
      post_all(until_ns);
      visit_simulated();
      await_decision(until_ns);
    }
  }
  {
    const CommitGate::Look table(gate);
  }  // this one is in it, if it is made, and nobody calls it off any more
  if (!has_commands) return locked_out_ != nullptr ? Outcome::timed_out : Outcome::off;
  if (is_made())
    begin_completion();
  else
    retract_posted();
  unlock();
  if (is_made()) return Outcome::made;
  if (unfit_ != nullptr) return Outcome::changed;
  await_busy(until_ns);
  is_refused_ = refusal_state_.load(std::memory_order_acquire) == RefusalState::complete;
  if (is_refused_) return Outcome::refused;
  const bool is_late = off() == Off::timed_out || off() == Off::not_idle || off() == Off::not_ready;
  return is_late ? Outcome::timed_out : Outcome::off;
}

/// Nothing is held while a component has yet to take an earlier change. The gate does not know of this commit yet: a shutdown is
/// looked for here.
bool Commit::await_slots(time_ns_t until_ns, CommitGate& gate) noexcept {
  for (const Participant* participant : order_) {
    Task& task = *participant->task;
    while (!task.is_left_behind() && !task.wait_slot(std::min(until_ns, monotonic_now_ns() + kLook))) {
      if (is_hosted_ && !gate.is_open()) call_off(Off::shut_down);
      if (!cut_.look().is_open()) return false;
      if (!task.is_simulated() && monotonic_now_ns() < until_ns) continue;
      occupied_ = &task;
      call_off(Off::timed_out);
      return false;
    }
  }
  return true;
}

bool Commit::lock(time_ns_t until_ns) noexcept {
  const auto is_off = [this]() MAUVE_RT { return !cut_.look().is_open(); };
  for (Participant* participant : order_) {
    Task& task = *participant->task;
    // In virtual time a change that waits has it already: this one came while it lets time pass.
    if (task.is_simulated() && task.command_mutex().is_held_here()) continue;
    participant->has_command = lock_unless(task.command_mutex(), until_ns, is_off);
    if (participant->has_command) continue;
    if (!is_off()) locked_out_ = &task;
    unlock();
    return false;
  }
  return true;
}

/// Whether the requester holds the command mutex of each participant.
bool Commit::has_commands() const noexcept {
  return std::all_of(order_.begin(), order_.end(),
                     [](const Participant* each) { return each->task->command_mutex().is_held_here(); });
}

void Commit::unlock() noexcept {
  for (Participant* participant : order_) {
    if (std::exchange(participant->has_command, false)) participant->task->command_mutex().unlock();
  }
}

const Task* Commit::find_unfit() const noexcept {
  for (const Participant* participant : order_) {
    const bool may_be_faulted = participant->repairs || participant->only_epoch;
    if (participant->afterwards == Afterwards::stop || may_be_faulted) continue;
    const ComponentState state = participant->task->state();
    if (state == ComponentState::stopping || state == ComponentState::faulted) return participant->task;
  }
  return nullptr;
}

/// No start comes between this and the takes of the parked ones.
void Commit::begin() noexcept {
  MAUVE_AUDIT(has_commands());
  bool takes_epoch = false;
  bool has_own = false;
  for (Participant* participant : order_) {
    Task& task = *participant->task;
    participant->period_ns = task.grid().period_ns;
    const bool may_hang = participant->afterwards == Afterwards::stop || participant->only_epoch;
    participant->left_behind = may_hang && task.claim();
    participant->in_flight = !participant->left_behind && !task.is_parked();
    // New parts may hang in adopt: that costs the component's own thread, where there is one.
    const bool has_own_thread = task.has_thread() && participant->replaces_parts;
    participant->is_own = participant->in_flight || (!participant->left_behind && has_own_thread);
    has_own |= participant->is_own;
    takes_epoch |= participant->epoch_lead_ns != 0;
  }
  has_own_.store(has_own, std::memory_order_relaxed);
  if (is_idle_) choose_closer();
  // A new epoch counts from T, and lies ahead of all that was executed by now.
  if (takes_epoch) cut_.raise(order_.front()->task->clock().now_ns());
}

bool Commit::is_one_cpu() const noexcept {
  const std::vector<int>& cpus = closer_->task->settings().cpus;
  return cpus.size() == 1 && std::all_of(order_.begin(), order_.end(), [&cpus](const Participant* each) {
           return !each->in_flight || each->task->settings().cpus == cpus;
         });
}

void Commit::choose_closer() noexcept {
  for (const Participant* participant : posted_) {
    if (participant->in_flight) closer_ = participant;  // the last one is the lowest
  }
  is_one_cpu_ = closer_ != nullptr && is_one_cpu();
}

bool Commit::check() noexcept {
  for (CommitAction* action : actions_) {
    if (action->task != nullptr || action->adopt()) continue;
    refuse(nullptr, *action, nullptr, false);
    return false;
  }
  return true;
}

void Commit::vote_for_parked() noexcept {
  for (Participant* participant : order_) {
    if (participant->is_own) continue;
    if (!adopt(*participant)) return;
    // A claimed one executed last at its `entered`: T comes after that.
    vote(*participant, participant->task->entered_ns());
  }
  if (order_.empty()) cut_.close();
}

void Commit::post_all(time_ns_t until_ns) noexcept {
  for (Participant* participant : posted_) {
    if (!participant->is_own) continue;
    if (!cut_.look().is_open()) return;
    if (participant->task->post(*participant, until_ns)) continue;
    occupied_ = participant->task;
    call_off(Off::timed_out);
    return;
  }
}

/// In virtual time no thread comes: the requester's runs the components' steps of the change.
void Commit::visit_simulated() noexcept {
  for (Participant* participant : posted_) {
    if (participant->is_own && participant->task->is_simulated()) participant->task->visit_simulated();
  }
}

void Commit::await_decision(time_ns_t until_ns) noexcept {
  const bool is_simulated = has_own() && order_.front()->task->is_simulated();
  bool have_all_voted = false;
  if (last_ != nullptr) until_ns = later_by(monotonic_now_ns(), ready_within_ns_);
  if (is_simulated) let_time_pass();
  while (cut_.look().is_open()) {
    const time_ns_t now = monotonic_now_ns();
    if (is_idle_ && !have_all_voted && to_vote_.load(std::memory_order_acquire) == 0) {
      have_all_voted = true;
      until_ns = later_by(now, idle_within_ns_);
    }
    if (now >= until_ns || is_simulated) {
      call_off(have_all_voted ? Off::not_idle : is_last_asked() ? Off::not_ready : Off::timed_out);
    } else {
      // Two that enter their waits at one moment may each see the other pending.
      if (have_all_voted && closer_ != nullptr) closer_->task->notify_commit();
      call_off_if_one_left();
      futex_wait_until(decided_, 0, std::min(until_ns, now + kLook));
    }
  }
}

/// Whether only the last voter is missing, and knows of the change.
bool Commit::is_last_asked() const noexcept {
  return last_ != nullptr && to_vote_.load(std::memory_order_acquire) == 1 &&
         last_->was_asked.load(std::memory_order_relaxed);
}

void Commit::let_time_pass() noexcept {
  if (last_ == nullptr) return;
  const time_ns_t until_ns = later_by(last_->task->clock().now_ns(), ready_within_ns_);
  while (cut_.look().is_open() && pass_time_(until_ns)) call_off_if_one_left();
}

/// A stop, a fault or a time-out wins: what it does not get to do itself is done here.
void Commit::call_off_if_one_left() noexcept {
  for (const Participant* participant : order_) {
    if (!participant->in_flight) continue;
    const ComponentState state = participant->task->state();
    if (state != ComponentState::running) call_off(Off::withdrawn, participant->task);
  }
}

void Commit::retract_posted() noexcept {
  for (Participant* participant : order_) {
    if (participant->left_behind) participant->task->give_up_claim();
    if (participant->is_own) participant->task->retract(*participant, 0);
  }
}

/// A slot whose adopt lasts is left to its thread, after a little patience: that ends sooner or later.
void Commit::await_busy(time_ns_t until_ns) noexcept {
  const bool is_timed_out = off() == Off::timed_out;
  if (!is_timed_out) until_ns = std::min(until_ns, monotonic_now_ns() + kPatience);
  const bool gives_up =
      is_timed_out || off() == Off::shut_down || off() == Off::preempted || off() == Off::abandoned;
  for (Participant* participant : order_) {
    if (!participant->is_own) continue;
    while (!participant->task->retract(*participant, monotonic_now_ns() + kLook)) {
      if (participant->task->is_left_behind()) break;
      if (monotonic_now_ns() < until_ns) continue;
      if (!gives_up || give_up(*participant, "adopt")) break;
    }
  }
}

/// Nothing of what follows waits for a component.
void Commit::begin_completion() noexcept {
  MAUVE_EXPECTS(is_made());
  MAUVE_AUDIT(has_commands());
  for (Participant* participant : order_) {
    if (participant->is_own) {
      participant->task->notify_commit();
    } else {
      participant->task->take_parked(*participant);
      if (!participant->left_behind) continue;
      if (participant->only_epoch) {
        participant->task->give_up_claim();  // it comes back on the new epoch
      } else {
        participant->task->abandon();
      }
    }
  }
  visit_simulated();
}

void Commit::await_passes(time_ns_t until_ns) noexcept {
  MAUVE_EXPECTS(is_made());
  until_ns = std::max(until_ns, monotonic_now_ns() + kPatience);
  start_parked(until_ns);
  for (Participant* participant : order_) {
    const Task& task = *participant->task;
    while (!participant->has_passed() && !task.is_simulated() && !task.is_left_behind()) {
      const time_ns_t now = monotonic_now_ns();
      if (now >= until_ns) {
        const bool is_taking = participant->visit_ns.load(std::memory_order_relaxed) != 0;
        if (!is_taking || give_up(*participant, "take")) break;  // it is late: it takes the change by itself
      }
      const std::uint32_t to_pass = to_pass_.load(std::memory_order_acquire);
      if (to_pass != 0) futex_wait_until(to_pass_, to_pass, now + kLook);
    }
  }
  answered_.store(true, std::memory_order_relaxed);  // relaxed: a hint
}

bool Commit::is_over(const Participant& participant) noexcept {
  if (participant.has_passed()) return true;
  return participant.task->is_abandoned() && participant.task->has_ended();
}

bool Commit::is_left() const noexcept {
  if (is_made()) {
    // Whoever passes counts itself off last: its flag alone does not say that it has left.
    const auto missing =
        std::count_if(order_.begin(), order_.end(), [](auto* each) { return !each->has_passed(); });
    return to_pass_.load(std::memory_order_acquire) == static_cast<std::uint32_t>(missing) &&
           std::all_of(order_.begin(), order_.end(), [](auto* each) { return is_over(*each); });
  }
  return std::all_of(order_.begin(), order_.end(), [](const Participant* each) {
    if (!each->is_own) return true;
    Task& task = *each->task;
    return task.retract(*each, 0) || (task.is_abandoned() && task.has_ended());
  });
}

/// Those whose threads the requester has started: a thread that gets no processor is not waited for beyond the instant.
void Commit::start_parked(time_ns_t until_ns) noexcept {
  for (Participant* participant : order_) {
    if (!participant->is_own && participant->afterwards == Afterwards::restart)
      participant->task->wait_started(until_ns);
  }
}

bool Commit::wait_passed(time_ns_t until_ns) const noexcept {
  for (;;) {
    const std::uint32_t to_pass = to_pass_.load(std::memory_order_acquire);
    if (to_pass == 0) return true;
    const time_ns_t now = monotonic_now_ns();
    if (now >= until_ns) return false;
    futex_wait_until(to_pass_, to_pass, std::min(until_ns, now + kLook));  // only the last one wakes it
  }
}

/// Times out a component whose adopt or take lasts beyond all patience; false when it has ended, or has just begun.
bool Commit::give_up(const Participant& participant, const char* call) noexcept {
  const time_ns_t began = participant.visit_ns.load(std::memory_order_relaxed);
  Task& task = *participant.task;
  if (began == 0 || task.clock().now_ns() - began < kPatience) return false;
  if (!task.time_out(std::string(call) + " of its new part does not end", task.clock().now_ns()))
    return false;
  given_up_ = &task;
  return true;
}

// ---- why it was not made

void Commit::rethrow_refusal() const {
  MAUVE_EXPECTS(!is_made());
  if (given_up_ != nullptr) {
    throw Error(ErrorCode::faulted, given_up_->fault().what,
                {.component = given_up_->name(),
                 .found = std::string(to_string(given_up_->state())),
                 .remedy = "remove the component, and add it anew; nothing was changed"});
  }
  if (locked_out_ != nullptr) {
    throw Error(ErrorCode::timeout,
                "a start of the component, or the end of its thread, lasted; nothing was changed",
                {.component = locked_out_->name(), .remedy = "try again, or allow a longer commit timeout"});
  }
  if (unfit_ != nullptr) throw_unfit();
  if (!is_refused_) throw_off();
  if (refusal_) std::rethrow_exception(refusal_);
  if (!adopt_was_late_) return;
  const time_ns_t declared = refused_by_->declared_ns();
  throw std::runtime_error("it took " + std::to_string(refused_by_->adopt_ns / us_to_ns(1)) + " us, and " +
                           (declared != 0
                                ? "its declared budget is " + std::to_string(declared / us_to_ns(1)) + " us"
                                : "the commit's timeout was over"));
}

void Commit::throw_unfit() const {
  if (unfit_->state() == ComponentState::faulted) {
    throw Error(ErrorCode::faulted, "the component is FAULTED: " + unfit_->fault().what,
                {.component = unfit_->name(),
                 .remedy = unfit_->is_parked() ? Task::kRepairRemedy : Task::kLeftBehindRemedy});
  }
  unfit_->throw_state_running("the component is STOPPING", 0, "try again when it has stopped");
}

void Commit::throw_off() const {
  switch (off()) {
    case Off::shut_down:
      throw Error(ErrorCode::wrong_revision, "the architecture is being shut down; nothing was changed",
                  {.remedy = "deploy it again first"});
    case Off::preempted:
      throw Error(ErrorCode::wrong_revision, "a prepared change came before this one; nothing was changed",
                  {.remedy = "read the architecture, then ask again"});
    case Off::abandoned:
      throw Error(ErrorCode::wrong_revision,
                  "the change was abandoned by another request; nothing was changed",
                  {.component = off_by_.load(std::memory_order_relaxed)->name(),
                   .remedy = "find out why the component did not agree, then ask again"});
    case Off::withdrawn: {
      const Task* by = off_by_.load(std::memory_order_relaxed);
      ErrorDetail detail{.element = "state", .remedy = "read the architecture, then ask again"};
      if (by != nullptr) {
        detail.component = by->name();
        detail.found = std::string(to_string(by->state()));
      }
      throw Error(ErrorCode::wrong_revision,
                  "the component was started or stopped, or it faulted, before the change was made", detail);
    }
    case Off::not_idle:
      throw_not_idle();
    case Off::not_ready:
    case Off::timed_out:
    case Off::not_yet:
      throw_timeout();
  }
  throw_timeout();
}

void Commit::throw_not_idle() const {
  std::string names;
  for (const Participant& participant : participants_) {
    if (participant.in_flight) names += (names.empty() ? "" : ", ") + participant.task->name();
  }
  const std::string within = std::to_string(idle_within_ns_ / ms_to_ns(1)) + " ms";
  const Participant* const pending = pending_.load(std::memory_order_relaxed);
  ErrorDetail detail{.element = "idle",
                     .expected = "an instant at which no job of a participant is pending, within " + within,
                     .found = "none",
                     .remedy = "allow more time (idle_within_s), or make the change without `idle`"};
  if (pending != nullptr) {
    detail.component = pending->task->name();
    detail.found = "a pending job of " + pending->task->name() + " at the last try";
  }
  throw Error(
      ErrorCode::timeout,
      "no instant at which all of " + names + " are idle came within " + within + "; nothing was changed",
      detail);
}

void Commit::throw_timeout() const {
  if (occupied_ != nullptr) {
    occupied_->throw_state_running("the component has not taken an earlier change yet; nothing was changed",
                                   timeout_ns_, "try again when its state has ended, or remove it by force");
  }
  for (const Participant* participant : order_) {
    if (!participant->is_own || participant->has_agreed.load(std::memory_order_relaxed)) continue;
    if (participant->unfit_waits.load(std::memory_order_relaxed) != 0) {
      const time_ns_t declared = participant->declared_ns();
      throw Error(ErrorCode::timeout,
                  "the declared budget fits in no wait of the component; nothing was changed",
                  {.component = participant->task->name(),
                   .element = "budget_ns",
                   .expected = "less than what is left of a wait",
                   .found = std::to_string(declared / us_to_ns(1)) + " us for adopt and take",
                   .remedy = "declare a shorter budget"});
    }
    if (participant->in_flight) {
      participant->task->throw_state_running(
          "the component did not reach a wait in time; nothing was changed", timeout_ns_,
          "try again, or allow a longer commit timeout");
    }
    throw Error(ErrorCode::timeout, "the component's thread did not get to run in time; nothing was changed",
                {.component = participant->task->name(),
                 .element = "priority " + std::to_string(participant->task->settings().priority),
                 .remedy = "look for a component of equal or higher priority that does not wait"});
  }
  throw Error(ErrorCode::timeout, "the change was not decided in time; nothing was changed",
              {.remedy = "try again, or allow a longer commit timeout"});
}

}  // namespace mauve
