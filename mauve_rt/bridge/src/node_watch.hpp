// SPDX-License-Identifier: LGPL-3.0-or-later
// NodeWatch: finds out, in C++, that a node's Python side has stopped working, and reports it.
#pragma once

#include <atomic>
#include <condition_variable>
#include <mutex>
#include <string>

#include "mauve_rt/base/time.hpp"

namespace mauve::bridge {

/// Logs an ERROR once the node was silent for too long, and another line when it works again. Reports the same health to a
/// service manager that asks for it (sd_notify: NOTIFY_SOCKET, WATCHDOG_USEC). All functions [non-rt].
///
/// | member     | written by       | read by    | order                 |
/// | ---------- | ---------------- | ---------- | --------------------- |
/// | beat_ns_   | the node, thread | the thread | relaxed: a lone fact  |
/// | is_ending_ | stop()           | the thread | mutex_                |
class NodeWatch {
 public:
  /// Watches from now on. `logger`: its name.
  NodeWatch(std::string logger, time_ns_t silent_after_ns);
  ~NodeWatch() { stop(); }
  NodeWatch(const NodeWatch&) = delete;
  NodeWatch& operator=(const NodeWatch&) = delete;

  /// The node works.
  void beat() noexcept { beat_ns_.store(monotonic_now_ns(), std::memory_order_relaxed); }
  /// Reports a state to the service manager: "READY=1".
  static void notify(const std::string& state) noexcept;
  /// May be called again.
  void stop() noexcept;

 private:
  void watch();
  void look(time_ns_t now_ns);

  const std::string logger_;
  const time_ns_t silent_after_ns_;
  const time_ns_t watchdog_ns_;  // how often the service manager wants to hear; 0: not at all
  std::atomic<time_ns_t> beat_ns_;
  bool is_silent_{false};  // the thread's
  time_ns_t notified_ns_{0};
  std::mutex mutex_;
  std::condition_variable end_;
  bool is_ending_{false};
  WorkerThread thread_;
};

}  // namespace mauve::bridge
