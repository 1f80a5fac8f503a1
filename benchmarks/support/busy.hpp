// SPDX-License-Identifier: LGPL-3.0-or-later
// Ordinary threads that never rest, one a CPU: what a machine that has other work looks like to real-time threads.
#pragma once

#include <sched.h>

#include <atomic>
#include <memory>
#include <thread>
#include <vector>

namespace bench {

/// Keeps CPUs 0 to n-1 busy for as long as it lives.
class BusyLoops {
 public:
  explicit BusyLoops(int cpus) {
    for (int cpu = 0; cpu < cpus; ++cpu) threads_.emplace_back([this, cpu] { spin(cpu); });
  }
  ~BusyLoops() {
    ending_.store(true, std::memory_order_relaxed);
    for (std::thread& thread : threads_) thread.join();
  }
  BusyLoops(const BusyLoops&) = delete;
  BusyLoops& operator=(const BusyLoops&) = delete;

 private:
  void spin(int cpu) {
    cpu_set_t cpus;
    CPU_ZERO(&cpus);
    CPU_SET(static_cast<std::size_t>(cpu), &cpus);
    sched_setaffinity(0, sizeof(cpus), &cpus);
    while (!ending_.load(std::memory_order_relaxed)) {
    }
  }

  std::atomic<bool> ending_{false};  // relaxed: noticed at the next turn
  std::vector<std::thread> threads_;
};

}  // namespace bench
