// SPDX-License-Identifier: LGPL-3.0-or-later
// Mutex and guards under the seeded scheduler.
#pragma once

#include <mutex>

#include "mauve_rt/base/thread_safety.hpp"

#include "seeds/scheduler.hpp"

namespace mauve {

template <bool is_recursive>
class MAUVE_LOCK SeededMutex {
 public:
  void lock() MAUVE_ACQUIRE() {
    if (!lock_.lock()) seeds::fail("a thread locks a mutex that it holds");
  }
  bool try_lock() MAUVE_TRY_ACQUIRE(true) { return lock_.try_lock(); }
  void unlock() MAUVE_RELEASE() { lock_.unlock(); }

 private:
  friend class ConditionVariable;

  seeds::Lock lock_{is_recursive, false};
};

using Mutex = SeededMutex<false>;
using RecursiveMutex = SeededMutex<true>;

/// As std::lock_guard.
template <typename Lock>
class MAUVE_GUARD LockGuard {
 public:
  explicit LockGuard(Lock& lock) MAUVE_ACQUIRE(lock) : lock_(lock) { lock_.lock(); }
  LockGuard(Lock& lock, std::adopt_lock_t) MAUVE_REQUIRES(lock) : lock_(lock) {}
  ~LockGuard() MAUVE_RELEASE() { lock_.unlock(); }
  LockGuard(const LockGuard&) = delete;
  LockGuard& operator=(const LockGuard&) = delete;

 private:
  Lock& lock_;
};

/// As std::unique_lock, of one that begins locked.
template <typename Lock>
class MAUVE_GUARD UniqueLock : public std::unique_lock<Lock> {
 public:
  explicit UniqueLock(Lock& lock) MAUVE_ACQUIRE(lock) : std::unique_lock<Lock>(lock) {}
  ~UniqueLock() MAUVE_RELEASE() = default;
  UniqueLock(const UniqueLock&) = delete;
  UniqueLock& operator=(const UniqueLock&) = delete;

  void lock() MAUVE_ACQUIRE() { std::unique_lock<Lock>::lock(); }
  void unlock() MAUVE_RELEASE() { std::unique_lock<Lock>::unlock(); }
};

}  // namespace mauve
