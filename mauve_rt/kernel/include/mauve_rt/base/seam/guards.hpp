// SPDX-License-Identifier: LGPL-3.0-or-later
// LockGuard and UniqueLock: guards of any lock that clang's -Wthread-safety sees.
#pragma once

#include <mutex>

#include "mauve_rt/base/thread_safety.hpp"

namespace mauve {

/// As std::lock_guard, which says nothing to clang's -Wthread-safety.
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

/// As std::unique_lock, of one that begins locked. All functions [non-rt].
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
