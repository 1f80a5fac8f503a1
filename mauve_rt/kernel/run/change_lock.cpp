// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/run/change_lock.hpp"

#include <algorithm>
#include <vector>

#include "mauve_rt/base/error.hpp"
#include "mauve_rt/run/task.hpp"

namespace mauve {

namespace {

/// Of the changes that the thread is inside of; a hook may change another architecture.
thread_local std::vector<const ChangeLock*> entered;

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

bool ChangeLock::is_inside() const noexcept {
  return std::find(entered.begin(), entered.end(), this) != entered.end();
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
  entered.push_back(this);
}

void ChangeLock::lock_alone() {
  check_outside();
  mutex_.lock();
  while (paused_ != 0) given_back_.wait(mutex_);
  entered.push_back(this);
}

bool ChangeLock::try_lock() noexcept {
  if (Task::executing_here() != nullptr || is_inside() || !mutex_.try_lock()) return false;
  entered.push_back(this);
  return true;
}

void ChangeLock::unlock() noexcept {
  std::erase(entered, this);
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

void ChangeLock::wait_for_others() { given_back_.wait_until(mutex_, monotonic_now_ns() + ms_to_ns(1)); }

ChangeLock::Pause::Pause(ChangeLock& lock) : lock_(lock) {
  ++lock_.paused_;
  lock_.mutex_.unlock();
  lock_.given_back_.notify_all();
}

ChangeLock::Inside::Inside(const ChangeLock& lock) : lock_(lock) { entered.push_back(&lock_); }
ChangeLock::Inside::~Inside() { std::erase(entered, &lock_); }

ChangeLock::Pause::~Pause() {
  lock_.mutex_.lock();
  --lock_.paused_;
}

}  // namespace mauve
