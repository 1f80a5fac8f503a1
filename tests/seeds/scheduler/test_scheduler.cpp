// SPDX-License-Identifier: LGPL-3.0-or-later
// The seeded scheduler itself: where threads switch, what a wait for an atomic leads to, how time passes.
#include <gtest/gtest.h>

#include "mauve_rt/base/seam/atomic.hpp"
#include "mauve_rt/base/seam/clocks.hpp"
#include "mauve_rt/base/seam/guards.hpp"
#include "mauve_rt/base/seam/mutex.hpp"
#include "mauve_rt/base/seam/ordinary_thread.hpp"
#include "mauve_rt/base/seam/shared_mutex.hpp"
#include "mauve_rt/base/time.hpp"

#include "forked_run.hpp"

namespace mauve::testing::test_scheduler {

using seeds::Findings;

/// How many of the seeds find something wrong.
template <typename Scenario>
int failures(const Scenario& scenario, std::uint64_t seeds) {
  int failed = 0;
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) failed += run_forked(scenario, seed).is_good() ? 0 : 1;
  return failed;
}

/// Two threads count without a read-modify-write, and without a call of the seam between.
void lose_an_update(std::uint64_t /*seed*/, Findings& findings) {
  constexpr int kTimes = 20;
  Atomic<int> count{0};
  const auto add = [&count] {
    for (int i = 0; i < kTimes; ++i) count.store(count.load() + 1);
  };
  OrdinaryThread other(add);
  add();
  other.join();
  findings.expect(count.load() == 2 * kTimes, "lost an update");
}

/// As lose_an_update(), as it is right.
void count_together(std::uint64_t /*seed*/, Findings& findings) {
  constexpr int kTimes = 20;
  Atomic<int> count{0};
  const auto add = [&count] {
    for (int i = 0; i < kTimes; ++i) ++count;
  };
  OrdinaryThread other(add);
  add();
  other.join();
  findings.expect(count.load() == 2 * kTimes, "lost an update");
}

/// What a thread does without atomics behind an atomic operation is not one step with that operation.
void write_behind_a_store(std::uint64_t /*seed*/, Findings& findings) {
  Atomic<bool> is_written{false};
  Atomic<bool> is_done{false};
  int value = 0;
  OrdinaryThread writer([&] {
    is_written.store(true);
    value = 1;
    is_done.store(true);
  });
  while (!is_written.load()) {
  }
  findings.expect(value == 1, "the value is not there");
  while (!is_done.load()) {
  }
  writer.join();
}

/// A thread spins until another one has set a flag.
void spin(std::uint64_t /*seed*/, Findings& findings) {
  Atomic<bool> is_set{false};
  OrdinaryThread setter([&] { is_set.store(true); });
  while (!is_set.load()) {
  }
  setter.join();
  findings.expect(is_set.load(), "not set");
}

void compute_alone(std::uint64_t /*seed*/, Findings& findings) {
  const time_ns_t before_ns = thread_cpu_now_ns();
  seeds::compute(us_to_ns(500));
  const time_ns_t took_ns = thread_cpu_now_ns() - before_ns;
  findings.expect(took_ns >= us_to_ns(500), "too short: " + std::to_string(took_ns) + " ns");
}

TEST(AtomicsOfTheSeededScheduler, SwitchThreadsInSomeSeeds) { EXPECT_GT(failures(lose_an_update, 40), 0); }
TEST(AtomicsOfTheSeededScheduler, AreAtomic) { EXPECT_EQ(0, failures(count_together, 40)); }
TEST(AtomicsOfTheSeededScheduler, ShowWhatComesBehindThemLater) {
  EXPECT_GT(failures(write_behind_a_store, 200), 0);
}
TEST(AtomicsOfTheSeededScheduler, LetASpinningThreadEnd) { EXPECT_EQ(0, failures(spin, 40)); }
TEST(AtomicsOfTheSeededScheduler, SwitchAtTheSameOnesAgain) {
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    const seeds::Run one = run_forked(lose_an_update, seed);
    const seeds::Run other = run_forked(lose_an_update, seed);
    EXPECT_EQ(one.outcome, other.outcome) << "seed " << seed;
    EXPECT_EQ(one.text, other.text) << "seed " << seed;
  }
}

#if defined(MAUVE_SEES_RACES)
/// One thread hands a value to another one, by an atomic with that order.
template <std::memory_order Order>
void hand_over(std::uint64_t /*seed*/, Findings& findings) {
  Atomic<bool> is_there{false};
  int value = 0;
  OrdinaryThread giver([&] {
    value = 1;
    is_there.store(true, Order);
  });
  while (!is_there.load(std::memory_order_acquire)) {
  }
  findings.expect(value == 1, "the value is not there");
  giver.join();
}

template <typename Lock>
void hand_over_under_lock(std::uint64_t /*seed*/, Findings& findings) {
  Lock lock;
  int value = 0;
  const auto add = [&] {
    const LockGuard guard(lock);
    ++value;
  };
  OrdinaryThread other(add);
  add();
  other.join();
  findings.expect(value == 2, "lost an update");
}

TEST(RacesUnderTheSeededScheduler, AreSeenAsTheMemoryOrdersSay) {
  EXPECT_EQ(20, failures(hand_over<std::memory_order_relaxed>, 20));
  EXPECT_EQ(0, failures(hand_over<std::memory_order_release>, 20));
}
TEST(RacesUnderTheSeededScheduler, AreNoneUnderALock) {
  EXPECT_EQ(0, failures(hand_over_under_lock<Mutex>, 20));
  EXPECT_EQ(0, failures(hand_over_under_lock<SharedMutex>, 20));
}
#endif

TEST(ComputingUnderTheSeededScheduler, TakesTimeOfTheProcessor) { EXPECT_EQ(0, failures(compute_alone, 20)); }

}  // namespace mauve::testing::test_scheduler
