// SPDX-License-Identifier: LGPL-3.0-or-later
// Who is told, where it happens, of what befalls one component.
#pragma once

#include <cstdint>

#include "mauve_rt/base/revocable_reference.hpp"
#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/base/seam/atomic.hpp"
#include "mauve_rt/base/time.hpp"

namespace mauve {

enum class ComponentState : std::uint32_t;

/// Told on the thread to which it happens: the component's own, of its state also the watchdog's and commanders', one after
/// the other. All functions [rt]; short, they wait for nobody.
class TaskListener {
 public:
  TaskListener() = default;
  virtual ~TaskListener() = default;
  TaskListener(const TaskListener&) = delete;
  TaskListener& operator=(const TaskListener&) = delete;

  /// A release came so late after its instant, at least listen()'s `late_from_ns`.
  virtual void on_late_wakeup(time_ns_t now_ns, time_ns_t late_ns) MAUVE_RT = 0;
  /// A next wait was entered so long after the release's instant, at least listen()'s `response_from_ns`.
  virtual void on_late_response(time_ns_t now_ns, time_ns_t response_ns) MAUVE_RT = 0;
  /// `overruns`: so many by now.
  virtual void on_overrun(time_ns_t now_ns, std::uint64_t overruns) MAUVE_RT = 0;
  /// An execution lasted longer than it declared.
  virtual void on_over_declared(time_ns_t now_ns) MAUVE_RT = 0;
  virtual void on_state(time_ns_t now_ns, ComponentState state) MAUVE_RT = 0;
};

/// The listener of one component, if there is one. Without it a release costs two loads of what lies in one cache line.
///
/// | member               | written by       | read by               | order                                            |
/// | -------------------- | ---------------- | --------------------- | ------------------------------------------------ |
/// | ..._from_ns_         | ordinary threads | the component's thread | relaxed: lone numbers; the next release has them |
/// | listener_            | ordinary threads | who tells             | its own: revocable_reference.hpp                              |
class TaskListening {
 public:
  /// From now on, until unlisten(). [non-rt], one thread at a time. False: another one listens.
  bool listen(TaskListener& listener, time_ns_t late_from_ns, time_ns_t response_from_ns) noexcept {
    if (listener_.is_set()) return false;
    listener_.set(listener);
    late_from_ns_.store(late_from_ns, std::memory_order_relaxed);
    response_from_ns_.store(response_from_ns, std::memory_order_relaxed);
    return true;
  }
  /// Nobody calls the listener any more afterwards. [non-rt]
  void unlisten() noexcept {
    late_from_ns_.store(kForever, std::memory_order_relaxed);
    response_from_ns_.store(kForever, std::memory_order_relaxed);
    listener_.revoke(kForever);
  }

  /// [rt]
  bool is_late(time_ns_t late_ns) const MAUVE_RT {
    return late_ns >= late_from_ns_.load(std::memory_order_relaxed);
  }
  bool is_late_response(time_ns_t response_ns) const MAUVE_RT {
    return response_ns >= response_from_ns_.load(std::memory_order_relaxed);
  }
  bool is_heard() const MAUVE_RT { return listener_.is_set(); }
  /// Calls the function with the listener, if there is one. [rt] as far as that is
  template <typename Function>
  void tell(Function&& function) noexcept {
    if (listener_.is_set()) listener_.use(std::forward<Function>(function));
  }

 private:
  Atomic<time_ns_t> late_from_ns_{kForever};
  Atomic<time_ns_t> response_from_ns_{kForever};
  RevocableReference<TaskListener> listener_;
};

}  // namespace mauve
