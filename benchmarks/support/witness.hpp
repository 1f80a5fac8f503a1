// SPDX-License-Identifier: LGPL-3.0-or-later
// A witness per CPU, above all else, that notices when the machine itself stands still.
#pragma once

#include <algorithm>
#include <atomic>
#include <vector>

#include "mauve_rt/time.hpp"

#include "support/realtime_thread.hpp"

namespace bench {

/// An interval in which a CPU ran nothing of ours, not even the thread of the highest priority.
struct Stall {
  mauve::time_ns_t begin_ns;
  mauve::time_ns_t end_ns;
};

/// Wakes every 250 us at priority 98 and notes where it was late.
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
  static constexpr int kPriority = 98;
  static constexpr mauve::time_ns_t kPeriod = mauve::us_to_ns(250);
  static constexpr mauve::time_ns_t kLate = mauve::us_to_ns(100);

  void watch() {
    stalls_.reserve(100'000);
    mauve::time_ns_t next = mauve::monotonic_now_ns();
    while (!ending_.load(std::memory_order_relaxed)) {
      next += kPeriod;
      sleep_until(next);
      const mauve::time_ns_t now = mauve::monotonic_now_ns();
      if (now - next > kLate && stalls_.size() < stalls_.capacity()) stalls_.push_back({next, now});
      if (now > next) next += (now - next) / kPeriod * kPeriod;
    }
    ended_.store(true, std::memory_order_release);  // release: publishes stalls_
    ended_.notify_all();
  }

  std::vector<Stall> stalls_;        // the witness's own until ended_
  std::atomic<bool> ending_{false};  // relaxed: noticed at the next wake
  std::atomic<bool> ended_{false};
  RealtimeThread thread_;
};

/// Releases that are missing between consecutive nominal instants. The machine's are those where it stood
/// still for more than 500 us, in one piece or, as hosts do, in several.
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
  mauve::time_ns_t stalled_ns = 0;
  for (const Stall& stall : stalls) {
    stalled_ns +=
        std::max<mauve::time_ns_t>(0, std::min(stall.end_ns, after_ns) - std::max(stall.begin_ns, before_ns));
  }
  return stalled_ns > mauve::us_to_ns(500) ? Missed{.machines = count} : Missed{.ours = count};
}
inline Missed count_missed(const std::vector<mauve::time_ns_t>& nominal_ns, mauve::time_ns_t period_ns,
                           const std::vector<Stall>& stalls) {
  Missed missed;
  for (std::size_t i = 1; i < nominal_ns.size(); ++i)
    missed += count_missed(nominal_ns[i - 1], nominal_ns[i], period_ns, stalls);
  return missed;
}

}  // namespace bench
