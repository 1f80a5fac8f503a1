// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/base/seam/thread.hpp"

#include <sched.h>

#include <cerrno>

#include "base/prefault.hpp"
#include "base/seam/timespec.hpp"

namespace mauve {

namespace {

class Attributes {
 public:
  explicit Attributes(const ThreadSettings& settings) {
    pthread_attr_init(&value);
    pthread_attr_setguardsize(&value, kStackGuardBytes);
    if (settings.stack_bytes != 0) pthread_attr_setstacksize(&value, settings.stack_bytes);
    pthread_attr_setinheritsched(&value, PTHREAD_EXPLICIT_SCHED);
    set_priority(settings.priority);
    if (settings.cpus.empty()) return;
    cpu_set_t cpus;
    CPU_ZERO(&cpus);
    for (const int cpu : settings.cpus) CPU_SET(static_cast<std::size_t>(cpu), &cpus);
    pthread_attr_setaffinity_np(&value, sizeof(cpus), &cpus);
  }
  ~Attributes() { pthread_attr_destroy(&value); }
  Attributes(const Attributes&) = delete;
  Attributes& operator=(const Attributes&) = delete;

  void set_priority(int priority) noexcept {
    const sched_param scheduling{.sched_priority = priority};
    pthread_attr_setschedpolicy(&value, priority != 0 ? SCHED_FIFO : SCHED_OTHER);
    pthread_attr_setschedparam(&value, &scheduling);
  }

  pthread_attr_t value;
};

}  // namespace

int await_signal(const sigset_t& signals) noexcept {
  int signal = 0;
  while (sigwait(&signals, &signal) != 0) {
  }
  return signal;
}

int Thread::start(const ThreadSettings& settings, void* (*entry)(void*), void* argument) {
  Attributes attributes(settings);
  const std::string name = settings.name.substr(0, 15);
  const SignalsBlocked inherited;
  int result = pthread_create(&handle_, &attributes.value, entry, argument);
  if (result == EPERM && !settings.require_realtime) {
    attributes.set_priority(0);
    result = pthread_create(&handle_, &attributes.value, entry, argument);
  }
  if (result != 0) return result;
  pthread_setname_np(handle_, name.c_str());
  pthread_getcpuclockid(handle_, &cpu_clock_);
  return 0;
}

time_ns_t Thread::cpu_now_ns() const noexcept {
  timespec now{};
  MAUVE_RT_TRUSTED(clock_gettime(cpu_clock_, &now));  // a call of the system that waits for nothing
  return to_ns(now);
}

ThreadFacts Thread::facts() const {
  int policy = 0;
  sched_param scheduling{};
  pthread_getschedparam(handle_, &policy, &scheduling);
  ThreadFacts facts{.policy = policy == SCHED_FIFO ? "SCHED_FIFO" : "SCHED_OTHER",
                    .priority = scheduling.sched_priority,
                    .cpus = {},
                    .guard_bytes = 0};
  pthread_attr_t attributes;
  if (pthread_getattr_np(handle_, &attributes) == 0) {
    pthread_attr_getguardsize(&attributes, &facts.guard_bytes);
    pthread_attr_destroy(&attributes);
  }
  cpu_set_t cpus;
  CPU_ZERO(&cpus);
  pthread_getaffinity_np(handle_, sizeof(cpus), &cpus);
  for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu) {
    if (CPU_ISSET(static_cast<std::size_t>(cpu), &cpus)) facts.cpus.push_back(cpu);
  }
  return facts;
}

void Thread::prefault_stack() const noexcept {
  pthread_attr_t attributes;
  if (pthread_getattr_np(handle_, &attributes) != 0) return;
  void* stack = nullptr;
  std::size_t stack_bytes = 0;
  if (pthread_attr_getstack(&attributes, &stack, &stack_bytes) == 0) prefault(stack, stack_bytes);
  pthread_attr_destroy(&attributes);
}

}  // namespace mauve
