// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/data/action_client.hpp"

#include "mauve_rt/base/contract.hpp"
#include "mauve_rt/base/trace.hpp"

namespace mauve {

ActionClientBase::ActionClientBase(std::string type, time_ns_t answer_ns)
    : Resource("action_client", std::move(type)), answer_ns_(answer_ns) {
  MAUVE_EXPECTS(answer_ns >= 1);  // checked with the kind's parameters
}

void ActionClientBase::set_name(const std::string& name) {
  Resource::set_name(name);
  mutex_.set_trace_id(TraceNames::intern(name));
}

void ActionClientBase::offer_all(ServiceBase& goal, ServiceBase& feedback, ServiceBase& result) {
  for (ServiceBase* const service :
       std::initializer_list<ServiceBase*>{&goal, &decide, &status, &feedback, &result})
    offer(*service);
}

ActionCounts ActionClientBase::counts() const {
  const LockGuard lock(mutex_);
  return counts_;
}

std::uint32_t ActionClientBase::open_goal() const {
  const LockGuard lock(mutex_);
  return is_open() ? number_ : 0;
}

GoalsNow ActionClientBase::goals_now() const noexcept {
  const LockGuard lock(mutex_);
  GoalsNow now{.is_aborted = is_aborted_};
  if (state_ == GoalState::executing || state_ == GoalState::canceling) {
    now.executing = number_;
    now.accepted_ns = accepted_ns_;
  }
  return now;
}

// ---- under mutex_

void ActionClientBase::begin(time_ns_t time_ns) noexcept {
  ++number_;
  is_to_send_ = true;
  is_to_cancel_ = false;
  due_ns_ = time_ns + answer_ns_;
  feedback_ = 0;
  enter(GoalState::unknown, GoalReason::none, time_ns);
}

void ActionClientBase::enter(GoalState state, GoalReason reason, time_ns_t now_ns) noexcept {
  state_ = state;
  reason_ = reason;
  is_aborted_ = failed_after(is_aborted_, state, reason);
  changed_ns_ = now_ns;
  ++sequence_;
  switch (state) {
    case GoalState::accepted:
      ++counts_.accepted;
      accepted_ns_ = now_ns;
      break;
    case GoalState::succeeded:
      ++counts_.succeeded;
      break;
    case GoalState::canceled:
      ++counts_.canceled;
      break;
    case GoalState::aborted:
      ++counts_.aborted;
      break;
    case GoalState::rejected:
      ++counts_.rejected;
      break;
    default:
      break;
  }
}

void ActionClientBase::cancel_locked(time_ns_t time_ns) noexcept {
  if (!floor_.admits(time_ns) || !is_open()) return;
  if (is_to_send_) {  // it is not sent yet
    is_to_send_ = false;
    enter(GoalState::canceled, GoalReason::none, time_ns);
    return;
  }
  is_to_cancel_ = true;
}

// ---- the carrier

bool ActionClientBase::next_goal(std::vector<std::byte>& message, std::uint32_t& number) {
  {
    const LockGuard lock(mutex_);
    if (!is_to_send_) return false;
    is_to_send_ = false;
    number = number_;
    copy_goal();
  }
  put_goal(message);
  return true;
}

bool ActionClientBase::next_cancel(std::uint32_t& number) {
  const LockGuard lock(mutex_);
  if (!is_to_cancel_ || !is_open() || state_ == GoalState::unknown) return false;
  is_to_cancel_ = false;
  number = number_;
  return true;
}

void ActionClientBase::answer(std::uint32_t number, bool is_accepted, time_ns_t now_ns) {
  {
    const LockGuard lock(mutex_);
    if (!is_present(number) || state_ != GoalState::unknown) return;
    enter(is_accepted ? GoalState::accepted : GoalState::rejected, GoalReason::none, now_ns);
  }
  written(now_ns);
}

void ActionClientBase::set_state(std::uint32_t number, GoalState state, time_ns_t now_ns) {
  {
    const LockGuard lock(mutex_);
    if (!is_present(number) || state_ == GoalState::unknown || state_ == state || is_final(state) ||
        state == GoalState::unknown || state == GoalState::accepted)
      return;
    enter(state, GoalReason::none, now_ns);
  }
  written(now_ns);
}

void ActionClientBase::feed_back(std::uint32_t number, std::span<const std::byte> feedback,
                                 time_ns_t now_ns) {
  if (!take_in_feedback(feedback)) return give_up(number, GoalReason::malformed, now_ns);
  {
    const LockGuard lock(mutex_);
    if (!is_present(number)) return;
    keep_feedback();
    feedback_ = ++fed_back_;
    feedback_ns_ = now_ns;
  }
  written(now_ns);
}

void ActionClientBase::finish(std::uint32_t number, GoalState state, std::span<const std::byte> result,
                              time_ns_t now_ns) {
  if (!take_in_result(result)) return give_up(number, GoalReason::malformed, now_ns);
  if (state < GoalState::succeeded || state > GoalState::aborted)  // it does not know the goal
    return give_up(number, GoalReason::no_server, now_ns);
  {
    const LockGuard lock(mutex_);
    if (!is_present(number)) return;
    keep_result();
    result_of_ = number;
    enter(state, GoalReason::none, now_ns);
  }
  written(now_ns);
}

void ActionClientBase::give_up(std::uint32_t number, GoalReason reason, time_ns_t now_ns) {
  GoalState state{};
  {
    const LockGuard lock(mutex_);
    if (!is_present(number)) return;
    state = state_ == GoalState::unknown ? GoalState::rejected : GoalState::aborted;
    enter(state, reason, now_ns);
  }
  report(number, state, reason);
  written(now_ns);
}

time_ns_t ActionClientBase::poll(time_ns_t now_ns) {
  std::uint32_t number = 0;
  {
    const LockGuard lock(mutex_);
    if (!is_open() || state_ != GoalState::unknown) return kForever;
    if (now_ns < due_ns_) return due_ns_;
    is_to_send_ = false;
    number = number_;
    enter(GoalState::rejected, GoalReason::no_answer, now_ns);
  }
  report(number, GoalState::rejected, GoalReason::no_answer);
  written(now_ns);
  return kForever;
}

/// Not where a component's thread or the watchdog ends a goal: such a thread waits for nothing.
void ActionClientBase::report(std::uint32_t number, GoalState state, GoalReason reason) const {
  log().warn("goal {} is {}: {}", number, to_string(state), to_string(reason));
}

// ---- the component

bool ActionClientBase::ask_to_cancel(time_ns_t time_ns) noexcept {
  {
    const LockGuard lock(mutex_);
    cancel_locked(time_ns);
  }
  decided(time_ns);
  return true;
}

TryWrite ActionClientBase::try_ask_to_cancel(time_ns_t time_ns) noexcept {
  {
    if (!mutex_.try_lock()) return TryWrite::busy;
    const LockGuard lock(mutex_, std::adopt_lock);
    cancel_locked(time_ns);
  }
  decided(time_ns);
  return TryWrite::done;
}

DataStatus ActionClientBase::read_status(ActionGoal& value, time_ns_t& time_ns,
                                         ReaderState& reader) noexcept {
  const LockGuard lock(mutex_);
  if (number_ == 0) return DataStatus::none;
  value = {.number = number_,
           .state = static_cast<std::uint8_t>(state_),
           .reason = static_cast<std::uint8_t>(reason_)};
  time_ns = changed_ns_;
  return reader.look(sequence_);
}

ResourceKind ActionClientKind::describe() {
  return {.name = "action_client",
          .parameters = {{.name = "answer_ns",
                          .initial = s_to_ns(1),
                          .description = "a goal that the server has not answered by then is rejected",
                          .unit = "ns",
                          .minimum = 1,
                          .file_key = "action.answer_ms"},
                         max_bytes_parameter()},
          .type = TypeNeed::action,
          .values = 6};  // a goal, a result and feedback, each here and on its way
}

}  // namespace mauve
