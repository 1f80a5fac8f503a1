// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/data/client.hpp"

#include <algorithm>

#include "mauve_rt/base/contract.hpp"
#include "mauve_rt/base/error.hpp"
#include "mauve_rt/base/seam/futex.hpp"
#include "mauve_rt/base/seam/mutex.hpp"
#include "mauve_rt/base/trace.hpp"
#include "mauve_rt/base/waiter.hpp"

namespace mauve {

std::string_view to_string(CallOutcome outcome) noexcept {
  switch (outcome) {
    case CallOutcome::answered:
      return "answered";
    case CallOutcome::no_server:
      return "no server";
    case CallOutcome::timed_out:
      return "timed out";
    case CallOutcome::stopped:
      return "stopped";
    case CallOutcome::busy:
      return "busy";
    case CallOutcome::malformed:
      return "malformed";
  }
  return "malformed";
}

ClientBase::ClientBase(std::string type, time_ns_t timeout_ns)
    : Resource("client", std::move(type)), timeout_ns_(timeout_ns) {
  if (timeout_ns > 0) return;
  throw Error(ErrorCode::out_of_range, "a call would never wait for its answer",
              {.element = "timeout_ns",
               .expected = "more than 0",
               .found = std::to_string(timeout_ns),
               .remedy = "give the longest time that a component may wait"});
}

void ClientBase::set_name(const std::string& name) {
  Resource::set_name(name);
  mutex_.set_trace_id(TraceNames::intern(name));
}

CallCounts ClientBase::counts() const {
  const LockGuard lock(mutex_);
  return counts_;
}

CallOutcome ClientBase::call(FunctionRef<void()> put, FunctionRef<void()> get) noexcept {
  const time_ns_t began = monotonic_now_ns();
  std::uint32_t number = 0;
  Waiter* const caller = Waiter::of_this_thread();
  {
    const LockGuard lock(mutex_);
    if (is_waiting_ || !is_connected_.load(std::memory_order_relaxed)) {
      const CallOutcome refused = is_waiting_ ? CallOutcome::busy : CallOutcome::no_server;
      count(refused, 0);
      return refused;
    }
    MAUVE_RT_TRUSTED(put());  // copies a message that lives in place; so does get()
    number = ++number_;
    is_posted_ = is_waiting_ = true;
    caller_ = caller;
  }
  notify();
  await(number, began + timeout_ns_, caller);
  const LockGuard lock(mutex_);
  const bool has_ended = ended_.load(std::memory_order_relaxed) == number;  // relaxed: the mutex orders it
  is_posted_ = is_waiting_ = false;
  caller_ = nullptr;
  CallOutcome outcome = outcome_;
  if (!has_ended)
    outcome = caller != nullptr && caller->is_to_stop() ? CallOutcome::stopped : CallOutcome::timed_out;
  if (outcome == CallOutcome::answered) MAUVE_RT_TRUSTED(get());
  count(outcome, monotonic_now_ns() - began);
  return outcome;
}

void ClientBase::await(std::uint32_t number, time_ns_t until_ns, Waiter* caller) const noexcept {
  if (caller != nullptr) return caller->await(ended_, number, until_ns);
  for (std::uint32_t seen = ended_.load(std::memory_order_acquire); seen != number;
       seen = ended_.load(std::memory_order_acquire)) {
    if (!futex_wait_until(ended_, seen, until_ns)) return;
  }
}

bool ClientBase::take_request(std::uint32_t& number, FunctionRef<void()> get) {
  const LockGuard lock(mutex_);
  if (!is_posted_) return false;
  is_posted_ = false;
  number = number_;
  get();
  return true;
}

void ClientBase::refuse(std::uint32_t number, CallOutcome outcome) {
  end(number, outcome, [] {});
}

void ClientBase::end(std::uint32_t number, CallOutcome outcome, FunctionRef<void()> put) {
  const LockGuard lock(mutex_);
  const bool is_late = !is_waiting_ || number != number_ || ended_.load(std::memory_order_relaxed) == number;
  if (is_late) return;
  put();
  outcome_ = outcome;
  ended_.store(number, std::memory_order_release);
  // Under the mutex: without it the caller could be gone.
  if (caller_ != nullptr) return caller_->signal_awaited();
  futex_wake_all(ended_);
}

void ClientBase::count(CallOutcome outcome, time_ns_t lasted_ns) noexcept {
  MAUVE_AUDIT(mutex_.is_held_here());
  switch (outcome) {
    case CallOutcome::answered:
      ++counts_.answered;
      counts_.longest_ns = std::max(counts_.longest_ns, lasted_ns);
      break;
    case CallOutcome::no_server:
      ++counts_.no_server;
      break;
    case CallOutcome::timed_out:
      ++counts_.timed_out;
      break;
    default:
      ++counts_.other;
  }
}

}  // namespace mauve
