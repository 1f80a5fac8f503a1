// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/run/change_lock.hpp"

#include "mauve_rt/base/error.hpp"
#include "mauve_rt/run/task.hpp"

namespace mauve {

void ChangeLock::check_caller() {
  const Task* task = Task::executing_here();
  if (task == nullptr) return;
  throw Error(ErrorCode::would_deadlock, "a component cannot change the architecture that it runs in",
              {.component = task->name(),
               .expected = "an ordinary thread",
               .found = "the component's own",
               .remedy = "let another thread ask for the change, at the component's word"});
}

void ChangeLock::lock() {
  check_caller();
  if (is_held_here()) {
    throw Error(ErrorCode::would_deadlock, "a change cannot ask for another one",
                {.expected = "a call from outside of the change under way",
                 .found = "one from inside of it, by a hook",
                 .remedy = "put both changes into one transaction, or ask when the first has returned"});
  }
  mutex_.lock();
  holder_.store(std::this_thread::get_id(), std::memory_order_relaxed);
}

bool ChangeLock::try_lock() noexcept {
  if (Task::executing_here() != nullptr || is_held_here() || !mutex_.try_lock()) return false;
  holder_.store(std::this_thread::get_id(), std::memory_order_relaxed);
  return true;
}

void ChangeLock::unlock() noexcept {
  holder_.store({}, std::memory_order_relaxed);
  mutex_.unlock();
}

std::unique_lock<ChangeLock> ChangeLock::join() {
  return is_held_here() ? std::unique_lock<ChangeLock>() : std::unique_lock(*this);
}

}  // namespace mauve
