// SPDX-License-Identifier: LGPL-3.0-or-later
// Threads that leave signals to the process.
#pragma once

#include <pthread.h>
#include <sched.h>

#include <thread>
#include <utility>
#include <vector>

#include "mauve_rt/base/seam/thread.hpp"

namespace mauve::bridge {

/// A thread of that name, with every signal blocked. [non-rt]
template <typename Work>
std::thread start_thread(const char* name, Work work) {
  const SignalsBlocked inherited;
  std::thread thread(std::move(work));
  pthread_setname_np(thread.native_handle(), name);
  return thread;
}

/// Where and how urgently a thread runs.
struct ThreadPlace {
  int priority{1};          // SCHED_FIFO, where the system grants that; the lowest: after the components
  std::vector<int> cpus{};  // empty: any
};

/// Gives a thread its place as far as the system grants it. [non-rt]
inline void place(std::thread& thread, const ThreadPlace& where) {
  const sched_param scheduling{.sched_priority = where.priority};
  pthread_setschedparam(thread.native_handle(), SCHED_FIFO, &scheduling);
  if (where.cpus.empty()) return;
  cpu_set_t cpus;
  CPU_ZERO(&cpus);
  for (const int cpu : where.cpus) CPU_SET(static_cast<std::size_t>(cpu), &cpus);
  pthread_setaffinity_np(thread.native_handle(), sizeof(cpus), &cpus);
}

}  // namespace mauve::bridge
