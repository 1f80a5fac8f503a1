// SPDX-License-Identifier: LGPL-3.0-or-later
// A second real-time thread on another CPU, which works next to the measured thread.
#pragma once

#include <atomic>
#include <functional>

#include "support/realtime_thread.hpp"

namespace bench {

/// Runs one function again and again, from begin() to rest(). Sleeps at all other times: a real-time thread that spins
/// leaves its CPU to no other thread.
///
/// | member   | written by           | order                                          |
/// |----------|----------------------|------------------------------------------------|
/// | wanted_  | the measuring thread | release/acquire: publishes the function        |
/// | current_ | the partner          | release/acquire: publishes what the turns did  |
class Partner {
 public:
  using Turn = std::function<void()>;  // some calls, none of which waits

  Partner(int priority, int cpu) : thread_(priority, cpu, [this] { run(); }) {}
  ~Partner() { request(&end_); }
  Partner(const Partner&) = delete;
  Partner& operator=(const Partner&) = delete;

  /// Returns after the first turn.
  void begin(const Turn& turn) {
    request(&turn);
    while (current_.load(std::memory_order_acquire) != &turn) {
    }
  }
  /// Returns after the last turn.
  void rest() {
    request(nullptr);
    while (current_.load(std::memory_order_acquire) != nullptr) {
    }
  }

 private:
  void request(const Turn* turn) {
    wanted_.store(turn, std::memory_order_release);
    wanted_.notify_one();
  }
  void run() {
    for (;;) {
      const Turn* turn = wanted_.load(std::memory_order_acquire);
      if (turn == &end_) return;
      if (turn != nullptr) (*turn)();
      if (current_.load(std::memory_order_relaxed) != turn) current_.store(turn, std::memory_order_release);
      if (turn == nullptr) wanted_.wait(nullptr, std::memory_order_acquire);
    }
  }

  const Turn end_;
  std::atomic<const Turn*> wanted_{nullptr};
  alignas(64) std::atomic<const Turn*> current_{nullptr};
  RealtimeThread thread_;
};

}  // namespace bench
