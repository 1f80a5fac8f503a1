// SPDX-License-Identifier: LGPL-3.0-or-later
// A pinned SCHED_FIFO thread as one would write it without this project, for the references.
#pragma once

#include <pthread.h>
#include <sys/prctl.h>

#include <cerrno>
#include <functional>
#include <stdexcept>
#include <string>

#include "mauve_rt/base/time.hpp"

namespace bench {

/// Runs the function on one CPU at that priority; SCHED_OTHER where the system refuses, as components do.
/// Joined by the destructor.
class RealtimeThread {
 public:
  RealtimeThread(int priority, int cpu, std::function<void()> body) : body_(std::move(body)) {
    pthread_attr_t attributes;
    pthread_attr_init(&attributes);
    cpu_set_t cpus;
    CPU_ZERO(&cpus);
    CPU_SET(static_cast<std::size_t>(cpu), &cpus);
    pthread_attr_setaffinity_np(&attributes, sizeof(cpus), &cpus);
    pthread_attr_setinheritsched(&attributes, PTHREAD_EXPLICIT_SCHED);
    int result = create(attributes, SCHED_FIFO, priority);
    if (result == EPERM) result = create(attributes, SCHED_OTHER, 0);
    pthread_attr_destroy(&attributes);
    if (result != 0) throw std::runtime_error("the system refuses a thread on CPU " + std::to_string(cpu));
  }
  ~RealtimeThread() { pthread_join(thread_, nullptr); }
  RealtimeThread(const RealtimeThread&) = delete;
  RealtimeThread& operator=(const RealtimeThread&) = delete;

 private:
  int create(pthread_attr_t& attributes, int policy, int priority) {
    const sched_param scheduling{.sched_priority = priority};
    pthread_attr_setschedpolicy(&attributes, policy);
    pthread_attr_setschedparam(&attributes, &scheduling);
    return pthread_create(&thread_, &attributes, &RealtimeThread::entry, this);
  }
  static void* entry(void* self) {
    prctl(PR_SET_TIMERSLACK, 1UL);  // without effect under SCHED_FIFO
    static_cast<RealtimeThread*>(self)->body_();
    return nullptr;
  }

  std::function<void()> body_;
  pthread_t thread_{};
};

/// clock_nanosleep until the instant of CLOCK_MONOTONIC.
inline void sleep_until(mauve::time_ns_t instant_ns) {
  const timespec instant{.tv_sec = instant_ns / mauve::s_to_ns(1), .tv_nsec = instant_ns % mauve::s_to_ns(1)};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &instant, nullptr) == EINTR) {
  }
}

/// Keeps the CPU busy.
inline void spin_until(mauve::time_ns_t instant_ns) {
  while (mauve::monotonic_now_ns() < instant_ns) {
  }
}
inline void spin_for(mauve::time_ns_t duration_ns) { spin_until(mauve::monotonic_now_ns() + duration_ns); }

/// Keeps the CPU busy for so much time of this very thread, whoever else gets some meanwhile.
inline void burn(mauve::time_ns_t duration_ns) {
  const auto used_ns = [] {
    timespec used{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &used);
    return mauve::s_to_ns(used.tv_sec) + used.tv_nsec;
  };
  const mauve::time_ns_t until = used_ns() + duration_ns;
  while (used_ns() < until) {
  }
}

}  // namespace bench
