// SPDX-License-Identifier: LGPL-3.0-or-later
// The cut: its frontier only grows, it is decided once, and T lies after every clock that was let through.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <thread>
#include <vector>

#include "mauve_rt/run/cut.hpp"

namespace mauve::testing {
namespace {

TEST(Cut, RaiseNeverLowers) {
  Cut cut;
  EXPECT_TRUE(cut.look().is_open());
  EXPECT_EQ(7, cut.raise(7).frontier_ns());
  EXPECT_EQ(7, cut.raise(7).frontier_ns());
  EXPECT_EQ(7, cut.raise(3).frontier_ns()) << "what the cut is, not what was asked for";
  EXPECT_EQ(9, cut.raise(9).frontier_ns());
  EXPECT_EQ(9, cut.look().frontier_ns());
  EXPECT_TRUE(cut.look().is_open());
}

TEST(Cut, RaiseAlwaysGoesBeyondTheFrontier) {
  Cut cut;
  EXPECT_EQ(7, cut.raise_always(7).frontier_ns());
  EXPECT_EQ(8, cut.raise_always(3).frontier_ns());
  EXPECT_EQ(20, cut.raise_always(20).frontier_ns());
  const CutWord closed = cut.close();
  EXPECT_EQ(closed.bits, cut.raise_always(30).bits);
}

TEST(Cut, CloseIfClosesTheWordThatWasSeen) {
  Cut cut;
  const CutWord seen = cut.raise(7);
  cut.raise_always(3);
  EXPECT_FALSE(cut.close_if(seen)) << "it was raised since";
  EXPECT_TRUE(cut.look().is_open());
  EXPECT_TRUE(cut.close_if(cut.look()));
  EXPECT_EQ(9, cut.look().instant_ns());
  EXPECT_FALSE(cut.close_if(seen));
  Cut other;
  other.call_off();
  EXPECT_FALSE(other.close_if(CutWord{}));
  EXPECT_TRUE(other.look().is_off());
}

TEST(Cut, InstantIsTheClockAfterTheFrontier) {
  Cut cut;
  cut.raise(41);
  const CutWord closed = cut.close();
  EXPECT_TRUE(closed.is_closed());
  EXPECT_FALSE(closed.is_open());
  EXPECT_FALSE(closed.is_off());
  EXPECT_EQ(41, closed.frontier_ns());
  EXPECT_EQ(42, closed.instant_ns());
}

TEST(Cut, ClosedIsFinal) {
  Cut cut;
  cut.raise(5);
  const CutWord closed = cut.close();
  EXPECT_EQ(closed.bits, cut.raise(100).bits);
  EXPECT_FALSE(cut.call_off());
  EXPECT_EQ(closed.bits, cut.close().bits);
  EXPECT_EQ(closed.bits, cut.look().bits);
}

TEST(Cut, OffIsFinal) {
  Cut cut;
  cut.raise(5);
  EXPECT_TRUE(cut.call_off());
  const CutWord off = cut.look();
  EXPECT_TRUE(off.is_off());
  EXPECT_FALSE(off.is_open());
  EXPECT_FALSE(off.is_closed());
  EXPECT_FALSE(cut.call_off()) << "another call has done it";
  EXPECT_EQ(off.bits, cut.raise(100).bits);
  EXPECT_EQ(off.bits, cut.close().bits);
}

TEST(Cut, HoldsClocksBetweenZeroAndTheLastOne) {
  EXPECT_EQ(0, CutWord::open_at(-1).frontier_ns());
  EXPECT_EQ(0, CutWord::open_at(INT64_MIN).frontier_ns());
  EXPECT_EQ(CutWord::kLastClock, CutWord::open_at(CutWord::kLastClock).frontier_ns());
  EXPECT_EQ(CutWord::kLastClock, CutWord::open_at(kForever).frontier_ns());
  Cut cut;
  EXPECT_EQ(0, cut.raise(-5).frontier_ns());
  EXPECT_EQ(CutWord::kLastClock, cut.raise(kForever).frontier_ns());
  EXPECT_TRUE(cut.look().is_open()) << "no clock reaches the bits of the decision";
  EXPECT_EQ(CutWord::kLastClock + 1, cut.close().instant_ns());
}

/// Runs work(index) on each of several threads, which begin together.
template <std::size_t kThreads, typename Work>
void run_together(Work work) {
  std::atomic<std::size_t> ready{0};
  std::vector<std::thread> threads;
  for (std::size_t i = 0; i < kThreads; ++i) {
    threads.emplace_back([&, i] {
      ready.fetch_add(1);
      while (ready.load() < kThreads) std::this_thread::yield();
      work(i);
    });
  }
  for (std::thread& thread : threads) thread.join();
}

TEST(Cut, OneOfSeveralThreadsDecides) {
  constexpr std::size_t kThreads = 4;
  for (int round = 0; round < 300; ++round) {
    Cut cut;
    std::atomic<int> called_off{0};
    std::array<CutWord, kThreads> seen;
    run_together<kThreads>([&](std::size_t i) {
      if (i == 0) {
        seen[i] = cut.close();
      } else {
        if (cut.call_off()) ++called_off;
        seen[i] = cut.look();
      }
    });
    EXPECT_EQ(cut.look().is_closed() ? 0 : 1, called_off.load());
    for (const CutWord word : seen) EXPECT_EQ(cut.look().bits, word.bits) << "all see one decision";
  }
}

/// Participants raise by their clocks until the cut is closed; one of them closes it at some moment.
TEST(Cut, NoClockThatWasLetThroughLiesAtOrBeyondT) {
  constexpr std::size_t kThreads = 3;
  for (int round = 0; round < 300; ++round) {
    Cut cut;
    std::array<time_ns_t, kThreads> last_old{}, first_new{};
    CutWord closed;
    run_together<kThreads>([&](std::size_t i) {
      for (time_ns_t clock = 1 + static_cast<time_ns_t>(i);; clock += 2) {
        if (i == 0 && clock > round % 50) closed = cut.close();
        const CutWord seen = cut.raise(clock);
        if (seen.is_open()) {
          EXPECT_LE(clock, seen.frontier_ns());
          last_old[i] = clock;
        } else if (clock >= seen.instant_ns()) {
          first_new[i] = clock;
          return;
        } else {
          last_old[i] = clock;
        }
      }
    });
    const time_ns_t instant = closed.instant_ns();
    EXPECT_EQ(closed.bits, cut.look().bits);
    for (std::size_t i = 0; i < kThreads; ++i) {
      EXPECT_LT(last_old[i], instant);
      EXPECT_GE(first_new[i], instant);
    }
    EXPECT_EQ(closed.frontier_ns(), *std::max_element(last_old.begin(), last_old.end()));
  }
}

}  // namespace
}  // namespace mauve::testing
