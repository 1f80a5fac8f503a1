// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/run/change_lock.hpp"

#include <algorithm>
#include <vector>

#include "mauve_rt/base/contract.hpp"
#include "mauve_rt/base/error.hpp"
#include "mauve_rt/run/task.hpp"

namespace mauve {

namespace {

/// A change that the thread is inside of; a hook may change another architecture.
struct Entered {
  const ChangeLock* lock;
  bool is_held;  // by this thread: not in a Pause, and not inside the change of another thread
};
thread_local std::vector<Entered> entered;

Entered* find_entered(const ChangeLock& lock) noexcept {
  const auto found =
      std::find_if(entered.begin(), entered.end(), [&](const Entered& each) { return each.lock == &lock; });
  return found != entered.end() ? &*found : nullptr;
}

void forget_entered(const ChangeLock& lock) noexcept {
  std::erase_if(entered, [&](const Entered& each) { return each.lock == &lock; });
}

}  // namespace

void ChangeLock::check_caller() {
  const Task* task = Task::executing_here();
  if (task == nullptr) return;
  throw Error(ErrorCode::would_deadlock, "a component cannot change the architecture that it runs in",
              {.component = task->name(),
               .expected = "an ordinary thread",
               .found = "the component's own",
               .remedy = "let another thread ask for the change, at the component's word"});
}

bool ChangeLock::is_inside() const noexcept { return find_entered(*this) != nullptr; }

bool ChangeLock::is_held_here() const noexcept {
  const Entered* const found = find_entered(*this);
  return found != nullptr && found->is_held;
}

void ChangeLock::check_outside() const {
  check_caller();
  if (!is_inside()) return;
  throw Error(ErrorCode::would_deadlock, "a change cannot ask for another one",
              {.expected = "a call from outside of the change under way",
               .found = "one from inside of it, by a hook",
               .remedy = "put both changes into one transaction, or ask when the first has returned"});
}

void ChangeLock::lock() {
  check_outside();
  mutex_.lock();
  entered.push_back({.lock = this, .is_held = true});
}

void ChangeLock::lock_alone() {
  check_outside();
  mutex_.lock();
  while (paused_ != 0) given_back_.wait(mutex_);
  entered.push_back({.lock = this, .is_held = true});
}

bool ChangeLock::try_lock() noexcept {
  if (Task::executing_here() != nullptr || is_inside() || !mutex_.try_lock()) return false;
  entered.push_back({.lock = this, .is_held = true});
  return true;
}

void ChangeLock::unlock() noexcept {
  MAUVE_EXPECTS(is_held_here());
  forget_entered(*this);
  mutex_.unlock();
  given_back_.notify_all();
}

std::unique_lock<ChangeLock> ChangeLock::join() {
  return is_inside() ? std::unique_lock<ChangeLock>() : std::unique_lock(*this);
}

std::unique_lock<ChangeLock> ChangeLock::join_alone() {
  if (is_inside()) return {};
  lock_alone();
  return {*this, std::adopt_lock};
}

void ChangeLock::wait_for_others() {
  MAUVE_EXPECTS(is_held_here());
  given_back_.wait_until(mutex_, monotonic_now_ns() + ms_to_ns(1));
}

ChangeLock::Pause::Pause(ChangeLock& lock) : lock_(lock) {
  Entered* const own = find_entered(lock_);
  MAUVE_EXPECTS(own != nullptr && own->is_held);
  own->is_held = false;
  ++lock_.paused_;
  lock_.mutex_.unlock();
  lock_.given_back_.notify_all();
}

ChangeLock::Inside::Inside(const ChangeLock& lock) : lock_(lock) {
  MAUVE_EXPECTS(!lock_.is_inside());
  entered.push_back({.lock = &lock_, .is_held = false});
}
ChangeLock::Inside::~Inside() { forget_entered(lock_); }

ChangeLock::Pause::~Pause() {
  lock_.mutex_.lock();
  MAUVE_EXPECTS(lock_.paused_ > 0);
  --lock_.paused_;
  find_entered(lock_)->is_held = true;
}

}  // namespace mauve
