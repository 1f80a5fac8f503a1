// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/data/action_server.hpp"

#include <algorithm>

#include "mauve_rt/base/error.hpp"
#include "mauve_rt/base/trace.hpp"

namespace mauve {

namespace {

constexpr time_ns_t kServedEvery = ms_to_ns(100);  // so often it is checked whether a component still serves
constexpr std::size_t kEndedGoals = 2;  // slots for goals that have ended, and are not reported yet
constexpr std::size_t kSlotsPerGoal = 2;
constexpr std::size_t kValuesPerPlace = 2;  // a goal and its result
constexpr std::size_t kValuesBesides =
    5;  // the result and the feedback that are written, and what goes in and out

/// Whether a component may take a goal from one state to the other.
bool fits(GoalState from, GoalState to) noexcept {
  switch (to) {
    case GoalState::accepted:
    case GoalState::rejected:
      return from == GoalState::unknown;
    case GoalState::succeeded:
      return from == GoalState::executing || from == GoalState::canceling;
    case GoalState::canceled:
      return from == GoalState::canceling;
    case GoalState::aborted:
      return from == GoalState::accepted || from == GoalState::executing || from == GoalState::canceling;
    default:
      return false;
  }
}

}  // namespace

std::string_view to_string(GoalState state) noexcept {
  constexpr std::array<std::string_view, 8> kNames{"unknown",   "accepted", "executing", "canceling",
                                                   "succeeded", "canceled", "aborted",   "rejected"};
  const auto index = static_cast<std::size_t>(state);
  return index < kNames.size() ? kNames[index] : "unknown";
}

std::string_view to_string(GoalReason reason) noexcept {
  switch (reason) {
    case GoalReason::none:
      return "";
    case GoalReason::stopped:
      return "the component was stopped";
    case GoalReason::removed:
      return "the component or the action was removed";
    case GoalReason::no_answer:
      return "no answer came in time";
    case GoalReason::full:
      return "there are as many goals as allowed";
    case GoalReason::no_server:
      return "no server of the action is there";
    case GoalReason::malformed:
      return "the message does not fit the type";
  }
  return "";
}

ActionServerBase::ActionServerBase(std::string type, std::int64_t goals, time_ns_t answer_ns)
    : Resource("action_server", std::move(type)),
      goals_(static_cast<std::size_t>(goals)),
      answer_ns_(answer_ns),
      slots_(kSlotsPerGoal * goals_ + kEndedGoals) {
  MAUVE_EXPECTS(goals >= 1 && goals <= kMostGoals && answer_ns >= 1);  // checked with the kind's parameters
}

void ActionServerBase::set_name(const std::string& name) {
  Resource::set_name(name);
  mutex_.set_trace_id(TraceNames::intern(name));
}

void ActionServerBase::offer_all(ServiceBase& goal, ServiceBase& asked, ServiceBase& feedback,
                                 ServiceBase& result) {
  asked_ = &asked;
  for (ServiceBase* const service :
       std::initializer_list<ServiceBase*>{&status, &goal, &asked, &decide, &feedback, &result})
    offer(*service);
}

ActionCounts ActionServerBase::counts() const {
  const LockGuard lock(mutex_);
  return counts_;
}

GoalsNow ActionServerBase::goals_now() const noexcept {
  const LockGuard lock(mutex_);
  GoalsNow now{.is_aborted = is_aborted_};
  if (current_ != kNone) {
    now.executing = slots_[current_].number;
    now.accepted_ns = slots_[current_].accepted_ns;
  }
  return now;
}

// ---- slots, under mutex_

std::size_t ActionServerBase::oldest(GoalState state) const noexcept {
  std::size_t found = kNone;
  for (std::size_t i = 0; i < slots_.size(); ++i) {
    const Slot& slot = slots_[i];
    if (slot.is_used && slot.state == state && (found == kNone || slot.number < slots_[found].number))
      found = i;
  }
  return found;
}

std::size_t ActionServerBase::find(const GoalId& id) const noexcept {
  const auto found = std::find_if(slots_.begin(), slots_.end(),
                                  [&](const Slot& slot) { return slot.is_used && slot.id == id; });
  return found == slots_.end() ? kNone : static_cast<std::size_t>(found - slots_.begin());
}

std::size_t ActionServerBase::find(std::uint32_t number) const noexcept {
  const auto found = std::find_if(slots_.begin(), slots_.end(),
                                  [&](const Slot& slot) { return slot.is_used && slot.number == number; });
  return found == slots_.end() ? kNone : static_cast<std::size_t>(found - slots_.begin());
}

std::size_t ActionServerBase::open_goals() const noexcept {
  return static_cast<std::size_t>(std::count_if(
      slots_.begin(), slots_.end(), [](const Slot& slot) { return slot.is_used && !is_final(slot.state); }));
}

void ActionServerBase::accept(std::size_t slot, time_ns_t now_ns) noexcept {
  slots_[slot].state = GoalState::accepted;
  slots_[slot].accepted_ns = now_ns;
  is_aborted_ = false;
  ++counts_.accepted;
  changed(now_ns);
  if (current_ == kNone) begin_next(now_ns);
}

void ActionServerBase::begin_next(time_ns_t now_ns) noexcept {
  current_ = oldest(GoalState::accepted);
  if (current_ == kNone) return;
  slots_[current_].state = GoalState::executing;
  slots_[current_].since_ns = now_ns;
}

void ActionServerBase::end(std::size_t slot, GoalState state, GoalReason reason, time_ns_t now_ns) noexcept {
  Slot& goal = slots_[slot];
  goal.state = state;
  goal.reason = reason;
  std::uint64_t& count = state == GoalState::succeeded  ? counts_.succeeded
                         : state == GoalState::canceled ? counts_.canceled
                         : state == GoalState::aborted  ? counts_.aborted
                                                        : counts_.rejected;
  ++count;
  is_aborted_ = failed_after(is_aborted_, state, reason);
  changed(now_ns);
  if (slot != current_) return;
  keep_result(slot);
  has_feedback_ = false;
  current_ = kNone;
}

void ActionServerBase::end_all(GoalReason reason, time_ns_t now_ns) noexcept {
  for (std::size_t i = 0; i < slots_.size(); ++i) {
    const Slot& slot = slots_[i];
    if (!slot.is_used || is_final(slot.state)) continue;
    end(i, slot.state == GoalState::unknown ? GoalState::rejected : GoalState::aborted, reason, now_ns);
  }
}

void ActionServerBase::changed(time_ns_t now_ns) noexcept {
  ++sequence_;
  changed_ns_ = now_ns;
}

// ---- the carrier

GoalReason ActionServerBase::ask(const GoalId& id, std::span<const std::byte> message, time_ns_t now_ns) {
  if (!take_in(message)) return GoalReason::malformed;
  GoalReason refused = GoalReason::none;
  {
    const LockGuard lock(mutex_);
    const auto room =
        std::find_if(slots_.begin(), slots_.end(), [](const Slot& slot) { return !slot.is_used; });
    if (!is_served()) {
      refused = GoalReason::no_server;
    } else if (open_goals() >= goals_ || room == slots_.end() || find(id) != kNone) {
      refused = GoalReason::full;
    }
    if (refused != GoalReason::none) {
      ++counts_.rejected;
      if (refused == GoalReason::full) return refused;  // as declared: no failure
      is_aborted_ = true;
    } else {
      *room = {.is_used = true,
               .id = id,
               .number = next_number_++,
               .due_ns = now_ns + answer_ns_,
               .since_ns = now_ns};
      keep_goal(static_cast<std::size_t>(room - slots_.begin()));
      changed(now_ns);
    }
  }
  written(now_ns);
  return refused;
}

bool ActionServerBase::cancel(const GoalId& id, time_ns_t now_ns) {
  {
    const LockGuard lock(mutex_);
    const std::size_t slot = find(id);
    if (slot == kNone || slots_[slot].state == GoalState::unknown || is_final(slots_[slot].state))
      return false;
    if (slot == current_) {
      slots_[slot].state = GoalState::canceling;
      changed(now_ns);
    } else {
      end(slot, GoalState::canceled, GoalReason::none, now_ns);
    }
  }
  written(now_ns);
  return true;
}

bool ActionServerBase::next_event(GoalEvent& event, std::vector<std::byte>& message) {
  {
    const LockGuard lock(mutex_);
    std::size_t found = kNone;
    for (std::size_t i = 0; i < slots_.size(); ++i) {
      const Slot& slot = slots_[i];
      const bool is_event = slot.is_used && (slot.state != slot.reported || (i == current_ && has_feedback_));
      if (is_event && (found == kNone || slot.number < slots_[found].number)) found = i;
    }
    if (found == kNone) return false;
    Slot& slot = slots_[found];
    const bool is_other = slot.state != slot.reported;
    event = {.id = slot.id,
             .number = slot.number,
             .state = slot.state,
             .reason = slot.reason,
             .has_feedback = !is_other,
             .has_result = is_other && is_final(slot.state)};
    slot.reported = slot.state;
    if (event.has_feedback) {
      has_feedback_ = false;
      copy_feedback();
    }
    if (event.has_result) {
      copy_result(found);
      slot.is_used = false;
    }
  }
  // Here, as what ends a goal may run on a thread that must not wait, the watchdog's for one.
  if (event.reason != GoalReason::none)
    log().warn("goal {} is {}: {}", event.number, to_string(event.state), to_string(event.reason));
  if (event.has_feedback) put_feedback(message);
  if (event.has_result) put_result(message);
  return true;
}

time_ns_t ActionServerBase::poll(time_ns_t now_ns) {
  time_ns_t next_ns = kForever;
  bool has_ended = false;
  {
    const LockGuard lock(mutex_);
    if (open_goals() == 0) return kForever;
    if (!is_served()) {
      end_all(GoalReason::removed, now_ns);
      has_ended = true;
    }
    for (std::size_t i = 0; i < slots_.size(); ++i) {
      const Slot& slot = slots_[i];
      if (!slot.is_used || slot.state != GoalState::unknown) continue;
      if (slot.due_ns <= now_ns) {
        end(i, GoalState::rejected, GoalReason::no_answer, now_ns);
        has_ended = true;
      } else {
        next_ns = std::min(next_ns, slot.due_ns);
      }
    }
    if (open_goals() != 0) next_ns = std::min(next_ns, now_ns + kServedEvery);
  }
  if (has_ended) written(now_ns);
  return next_ns;
}

void ActionServerBase::close(time_ns_t now_ns) {
  {
    const LockGuard lock(mutex_);
    end_all(GoalReason::removed, now_ns);
  }
  written(now_ns);
}

// ---- the component

DataStatus ActionServerBase::read_status(ActionGoal& value, time_ns_t& time_ns,
                                         ReaderState& reader) noexcept {
  bool has_accepted = false;
  DataStatus found{};
  {
    const LockGuard lock(mutex_);
    if (!has_judge()) {
      for (std::size_t next = oldest(GoalState::unknown); next != kNone; next = oldest(GoalState::unknown)) {
        accept(next, slots_[next].since_ns);
        has_accepted = true;
      }
    }
    const std::size_t asked = oldest(GoalState::unknown);
    value = {.asked = asked == kNone ? 0 : slots_[asked].number};
    if (current_ != kNone) {
      value.number = slots_[current_].number;
      value.state = static_cast<std::uint8_t>(slots_[current_].state);
    }
    for (const Slot& slot : slots_)
      value.waiting += slot.is_used && slot.state == GoalState::accepted ? 1U : 0U;
    time_ns = changed_ns_;
    found = reader.look(sequence_);
  }
  if (has_accepted) decided(time_ns);
  return found;
}

bool ActionServerBase::take_decision(const ActionGoal& decision, time_ns_t time_ns) noexcept {
  bool fits = true;
  {
    const LockGuard lock(mutex_);
    fits = decide_locked(decision, time_ns);
  }
  decided(time_ns);
  return fits;
}

TryWrite ActionServerBase::try_decision(const ActionGoal& decision, time_ns_t time_ns) noexcept {
  {
    if (!mutex_.try_lock()) return TryWrite::busy;
    const LockGuard lock(mutex_, std::adopt_lock);
    decide_locked(decision, time_ns);
  }
  decided(time_ns);
  return TryWrite::done;
}

bool ActionServerBase::decide_locked(const ActionGoal& decision, time_ns_t time_ns) noexcept {
  if (!floor_.admits(time_ns)) return true;
  const GoalState state = decision.its_state();
  if (state == GoalState::unknown) {
    end_all(GoalReason::stopped, time_ns);
    return true;
  }
  const bool is_answer = state == GoalState::accepted || state == GoalState::rejected;
  const std::size_t meant = is_answer ? oldest(GoalState::unknown) : current_;
  const std::size_t slot = decision.number == 0 ? meant : find(decision.number);
  if (slot == kNone || !fits(slots_[slot].state, state)) {
    ++counts_.refused;
    return false;
  }
  if (state == GoalState::accepted) {
    accept(slot, time_ns);
  } else {
    end(slot, state, GoalReason::none, time_ns);
    if (current_ == kNone) begin_next(time_ns);
  }
  return true;
}

ResourceKind ActionServerKind::describe() {
  return {
      .name = "action_server",
      .parameters = {{.name = "goals",
                      .initial = std::int64_t{1},
                      .description = "so many goals at once, the executed one among them; more are rejected",
                      .minimum = 1,
                      .maximum = static_cast<double>(kMostGoals),
                      .values_each = kSlotsPerGoal * kValuesPerPlace},
                     {.name = "answer_ns",
                      .initial = kDefaultAnswerTime,
                      .description = "a goal that the component has not answered by then is rejected",
                      .unit = "ns",
                      .minimum = 1,
                      .file_key = "action.answer_ms"},
                     max_bytes_parameter()},
      .type = TypeNeed::action,
      .values = kEndedGoals * kValuesPerPlace + kValuesBesides};
}

}  // namespace mauve
