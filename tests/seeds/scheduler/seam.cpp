// SPDX-License-Identifier: LGPL-3.0-or-later
// The functions of the seam under the seeded scheduler: clocks, sleeps, the process barrier, threads.
#include <sched.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>

#include "mauve_rt/base/seam/clocks.hpp"
#include "mauve_rt/base/seam/process_barrier.hpp"
#include "mauve_rt/base/seam/sleep.hpp"
#include "mauve_rt/base/seam/thread.hpp"
#include "mauve_rt/base/time.hpp"

#include "seeds/scheduler.hpp"

namespace mauve {

using seeds::Call;

namespace {

constexpr time_ns_t kRealtimeAhead = s_to_ns(1'700'000'000);
constexpr time_ns_t kOfAYield = us_to_ns(2);

}  // namespace

time_ns_t monotonic_now_ns() noexcept {
  seeds::step(Call::clock);
  return seeds::now_ns();
}
time_ns_t realtime_now_ns() noexcept { return kRealtimeAhead + monotonic_now_ns(); }
time_ns_t thread_cpu_now_ns() noexcept {
  seeds::step(Call::clock);
  return seeds::cpu_ns();
}

void sleep_for(time_ns_t length_ns) noexcept {
  seeds::step(Call::sleep);
  const time_ns_t until_ns = later_by(seeds::now_ns(), std::max<time_ns_t>(0, length_ns));
  seeds::block(Call::sleep, nullptr, until_ns, false);
}

/// Also lets threads of lower priority run, as those on other processors do.
void yield_thread() noexcept {
  seeds::step(Call::yield);
  seeds::block(Call::yield, nullptr, seeds::now_ns() + kOfAYield, false);
}

// One thread runs at a time, so each sees all that others did.
void process_barrier() noexcept { seeds::step(Call::barrier); }
bool has_process_barrier() noexcept { return true; }

/// No signal comes: the caller waits for ever.
int await_signal(const sigset_t& /*signals*/) noexcept {
  for (;;) seeds::block(Call::signal_wait, nullptr, kForever, false);
}

int Thread::start(const ThreadSettings& settings, void* (*entry)(void*), void* argument) {
  const long processors = sysconf(_SC_NPROCESSORS_CONF);
  if (std::ranges::any_of(settings.cpus, [&](int cpu) { return cpu >= processors; })) return EINVAL;
  int error = 0;
  cpus_ = settings.cpus.empty() ? std::vector{0} : settings.cpus;
  thread_ = seeds::start({.name = settings.name.c_str(),
                          .priority = settings.priority,
                          .stack_bytes = settings.stack_bytes,
                          .entry = entry,
                          .argument = argument},
                         error);
  return error;
}

ThreadFacts Thread::facts() const {
  const int priority = seeds::priority(*thread_);
  return {.policy = priority != 0 ? "SCHED_FIFO" : "SCHED_OTHER",
          .priority = priority,
          .cpus = cpus_,
          .guard_bytes = kStackGuardBytes};
}

}  // namespace mauve
