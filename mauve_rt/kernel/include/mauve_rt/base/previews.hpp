// SPDX-License-Identifier: LGPL-3.0-or-later
// Previews: in place of a value, a value for the calling thread alone.
#pragma once

#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/base/seam/atomic.hpp"
#include "mauve_rt/base/seam/mutex.hpp"
#include "mauve_rt/base/this_thread.hpp"

namespace mauve {

/// Several threads can have a preview of the same value at once, each its own: one prepares a change of a component, another one
/// makes its fallback core ready. Places are kept for later previews and end with the object, so that readers never lose one.
///
/// | member       | written by                | read by                   | order                                          |
/// | ------------ | ------------------------- | ------------------------- | ---------------------------------------------- |
/// | first_, next | begin(), under mutex_     | anyone                    | release/acquire: the place                     |
/// | thread       | begin(), end(), under mutex_ | anyone                 | relaxed: only the thread that it names relies on it |
/// | value        | the thread that the place is taken by | the same      | mutex_, from one such thread to the next       |
template <typename T>
class Previews {
 public:
  Previews() = default;
  ~Previews() {
    for (Place* place = first_.load(std::memory_order_relaxed);
         place != nullptr;) {  // relaxed: the last user
      Place* const next = place->next;
      delete place;
      place = next;
    }
  }
  Previews(const Previews&) = delete;
  Previews& operator=(const Previews&) = delete;

  /// The preview of the calling thread; nullptr: it has none. [rt]
  T* find() const MAUVE_RT {
    for (Place* place = first_.load(std::memory_order_acquire); place != nullptr; place = place->next) {
      // Relaxed: only the thread that stored its own id here finds it, and that one has written the value itself.
      const pthread_t thread = place->thread.load(std::memory_order_relaxed);
      if (thread != kNobody && is_this_thread(thread)) return &place->value;
    }
    return nullptr;
  }
  /// Where the calling thread puts its preview; as it left it, where it has one. [non-rt]
  T& begin() {
    if (T* const own = find()) return *own;
    const LockGuard lock(mutex_);
    for (Place* place = first_.load(std::memory_order_relaxed); place != nullptr; place = place->next) {
      if (place->thread.load(std::memory_order_relaxed) != kNobody) continue;  // both relaxed: under mutex_
      place->thread.store(pthread_self(), std::memory_order_relaxed);
      return place->value;
    }
    auto* const place = new Place{.next = first_.load(std::memory_order_relaxed)};  // relaxed: under mutex_
    place->thread.store(pthread_self(), std::memory_order_relaxed);
    first_.store(place, std::memory_order_release);
    return place->value;
  }
  /// The calling thread has none any more. [non-rt]
  void end() noexcept {
    const LockGuard lock(mutex_);
    for (Place* place = first_.load(std::memory_order_relaxed); place != nullptr; place = place->next) {
      const pthread_t thread = place->thread.load(std::memory_order_relaxed);  // both relaxed: under mutex_
      if (thread == kNobody || !is_this_thread(thread)) continue;
      place->value = T{};
      place->thread.store(kNobody, std::memory_order_relaxed);
    }
  }
  /// Whether any thread has one. [non-rt]
  bool is_any() const noexcept {
    const LockGuard lock(mutex_);
    for (Place* place = first_.load(std::memory_order_relaxed); place != nullptr; place = place->next) {
      if (place->thread.load(std::memory_order_relaxed) != kNobody)
        return true;  // both relaxed: under mutex_
    }
    return false;
  }

 private:
  static constexpr pthread_t kNobody{};  // as glibc never calls a thread
  struct Place {
    Atomic<pthread_t> thread{kNobody};
    T value{};
    Place* next{nullptr};
  };

  mutable Mutex mutex_;  // for a moment: no hook, and no thread of a component
  Atomic<Place*> first_{nullptr};
};

}  // namespace mauve
