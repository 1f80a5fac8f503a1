// SPDX-License-Identifier: LGPL-3.0-or-later
// A witness per CPU that notices when the machine itself stands still.
#pragma once

#include <sched.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "mauve_rt/base/time.hpp"

#include "support/realtime_thread.hpp"

namespace bench {

/// An interval in which a CPU ran nothing of ours, not even the thread of the highest priority.
struct Stall {
  mauve::time_ns_t begin_ns;
  mauve::time_ns_t end_ns;
};

/// The CPU time of those threads of this process that a witness cannot preempt: the watchdog has its priority.
/// (SCHED_DEADLINE is above both, but the system refuses it to a thread that is bound to one CPU.)
class Rivals {
 public:
  /// Of the threads that exist by now.
  explicit Rivals(int priority) {
    for (const auto& thread : std::filesystem::directory_iterator("/proc/self/task")) {
      const pid_t id = std::stoi(thread.path().filename());
      sched_param scheduling{};
      if (id == gettid() || sched_getscheduler(id) != SCHED_FIFO || sched_getparam(id, &scheduling) != 0)
        continue;
      if (scheduling.sched_priority >= priority) clocks_.push_back(cpu_clock(id));
    }
  }
  mauve::time_ns_t used_ns() const noexcept {
    mauve::time_ns_t sum = 0;
    for (const clockid_t clock : clocks_) {
      timespec used{};
      if (clock_gettime(clock, &used) == 0) sum += mauve::s_to_ns(used.tv_sec) + used.tv_nsec;
    }
    return sum;
  }

 private:
  /// As pthread_getcpuclockid makes it, which takes no thread's id.
  static clockid_t cpu_clock(pid_t thread) {
    return static_cast<clockid_t>((~static_cast<unsigned>(thread) << 3U) | 6U);
  }
  std::vector<clockid_t> clocks_;
};

/// Wakes every 250 us at the highest priority there is and notes where it was late, unless it waited for a thread of ours:
/// what that does to components is no stall of the machine. Made when the architecture is deployed.
class Witness {
 public:
  explicit Witness(int cpu) : thread_(kPriority, cpu, [this] { watch(); }) {}
  ~Witness() { end(); }
  Witness(const Witness&) = delete;
  Witness& operator=(const Witness&) = delete;

  /// Ends the watch and returns what was noticed.
  const std::vector<Stall>& end() {
    ending_.store(true, std::memory_order_relaxed);
    if (!ended_.load(std::memory_order_acquire)) ended_.wait(false, std::memory_order_acquire);
    return stalls_;
  }

 private:
  static constexpr int kPriority = 99;
  static constexpr mauve::time_ns_t kPeriod = mauve::us_to_ns(250);
  static constexpr mauve::time_ns_t kLate = mauve::us_to_ns(100);

  void watch() {
    stalls_.reserve(100'000);
    mauve::time_ns_t rivals_used = rivals_.used_ns();
    mauve::time_ns_t next = mauve::monotonic_now_ns();
    while (!ending_.load(std::memory_order_relaxed)) {
      next += kPeriod;
      sleep_until(next);
      const mauve::time_ns_t now = mauve::monotonic_now_ns();
      const mauve::time_ns_t rivals_before = std::exchange(rivals_used, rivals_.used_ns());
      const bool is_ours = rivals_used - rivals_before > (now - next) / 2;
      if (now - next > kLate && !is_ours && stalls_.size() < stalls_.capacity())
        stalls_.push_back({next, now});
      if (now > next) next += (now - next) / kPeriod * kPeriod;
    }
    ended_.store(true, std::memory_order_release);  // release: publishes stalls_
    ended_.notify_all();
  }

  Rivals rivals_{kPriority};
  std::vector<Stall> stalls_;        // the witness's own until ended_
  std::atomic<bool> ending_{false};  // relaxed: noticed at the next wake
  std::atomic<bool> ended_{false};
  RealtimeThread thread_;
};

/// How much of an interval stalls take, none of which overlap.
inline mauve::time_ns_t stalled_ns(const std::vector<Stall>& stalls, mauve::time_ns_t from_ns,
                                   mauve::time_ns_t until_ns) {
  mauve::time_ns_t sum = 0;
  for (const Stall& stall : stalls) {
    sum +=
        std::max<mauve::time_ns_t>(0, std::min(stall.end_ns, until_ns) - std::max(stall.begin_ns, from_ns));
  }
  return sum;
}

/// Stalls of several CPUs as intervals that do not overlap.
inline std::vector<Stall> merged(std::vector<Stall> stalls) {
  std::sort(stalls.begin(), stalls.end(),
            [](const Stall& one, const Stall& other) { return one.begin_ns < other.begin_ns; });
  std::vector<Stall> apart;
  for (const Stall& stall : stalls) {
    if (!apart.empty() && stall.begin_ns <= apart.back().end_ns)
      apart.back().end_ns = std::max(apart.back().end_ns, stall.end_ns);
    else
      apart.push_back(stall);
  }
  return apart;
}

/// Releases that are missing between consecutive nominal instants. The machine's are as many as it stood still for where
/// that was more than 500 us, in one piece or, as hosts do, in several.
struct Missed {
  std::int64_t ours{0};
  std::int64_t machines{0};

  Missed& operator+=(const Missed& other) {
    ours += other.ours;
    machines += other.machines;
    return *this;
  }
};

/// Those that are missing between two instants that followed each other.
inline Missed count_missed(mauve::time_ns_t before_ns, mauve::time_ns_t after_ns, mauve::time_ns_t period_ns,
                           const std::vector<Stall>& stalls) {
  const std::int64_t count = (after_ns - before_ns) / period_ns - 1;
  if (count <= 0) return {};
  const mauve::time_ns_t stood_still_ns = stalled_ns(stalls, before_ns, after_ns);
  if (stood_still_ns <= mauve::us_to_ns(500)) return {.ours = count};
  const std::int64_t machines = std::min(count, stood_still_ns / period_ns + 1);
  return {.ours = count - machines, .machines = machines};
}
inline Missed count_missed(const std::vector<mauve::time_ns_t>& nominal_ns, mauve::time_ns_t period_ns,
                           const std::vector<Stall>& stalls) {
  Missed missed;
  for (std::size_t i = 1; i < nominal_ns.size(); ++i)
    missed += count_missed(nominal_ns[i - 1], nominal_ns[i], period_ns, stalls);
  return missed;
}

}  // namespace bench
