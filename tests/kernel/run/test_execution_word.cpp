// SPDX-License-Identifier: LGPL-3.0-or-later
// One word decides each execution: it has ended, or it times out, never both and never neither.
#include <random>

#include "mauve_rt/run/execution_word.hpp"

#include "fixtures.hpp"

namespace mauve::testing::test_execution_word {

TEST(ExecutionWord, TimesOutOnlyTheExecutionThatWasLookedAt) {
  ExecutionWord word;
  EXPECT_FALSE(word.look());
  word.begin(100, 10);
  const auto first = word.look();
  ASSERT_TRUE(first);
  EXPECT_EQ(110, first->end_ns());
  EXPECT_FALSE(first->is_over(110)) << "equality is on time";
  EXPECT_TRUE(first->is_over(111));
  EXPECT_TRUE(word.end());
  word.begin(200, 10);
  EXPECT_FALSE(word.time_out(*first)) << "it had ended";
  EXPECT_TRUE(word.time_out(*word.look()));
  EXPECT_FALSE(word.end());
  EXPECT_FALSE(word.look()) << "nothing is left to time out";
}

TEST(ExecutionWord, ABudgetIsUsedUpByCpuTimeAlone) {
  ExecutionWord word;
  word.begin(100, 50, 10);
  const auto begun = word.look();
  ASSERT_TRUE(begun);
  EXPECT_EQ(110, begun->end_ns()) << "before that it cannot be over it";
  EXPECT_FALSE(begun->may_be_over_budget(110));
  EXPECT_TRUE(begun->may_be_over_budget(111));
  EXPECT_EQ(10, begun->cpu_left_ns(7'000)) << "its thread has yet to read its CPU clock";
  word.set_cpu_end(7'010);
  EXPECT_EQ(3, word.look()->cpu_left_ns(7'007));
  EXPECT_EQ(-1, word.look()->cpu_left_ns(7'011));
  EXPECT_TRUE(word.end());
  word.begin(200, 50);
  EXPECT_EQ(250, word.look()->end_ns());
  EXPECT_FALSE(word.look()->may_be_over_budget(s_to_ns(1))) << "it has none";
}

TEST(ExecutionWord, WhoRemovesAndWhoComesBackDecideByTheSameWord) {
  ExecutionWord word;
  word.begin(100, 10);
  EXPECT_FALSE(word.claim()) << "it has not timed out";
  EXPECT_TRUE(word.time_out(*word.look()));
  word.set_demoted();
  EXPECT_TRUE(word.claim());
  word.give_up_claim();
  EXPECT_TRUE(word.come_back());
  EXPECT_FALSE(word.claim()) << "it has come back";
  word.begin(200, 10);
  EXPECT_TRUE(word.time_out(*word.look()));
  word.set_demoted();
  EXPECT_TRUE(word.claim());
  word.abandon();
  EXPECT_FALSE(word.come_back());
}

/// A thread executes, another one times it out, a third one removes now and then; each at random phases.
TEST(ExecutionWord, EachExecutionHasOneEndWhateverThePhases) {
  constexpr int kExecutions = 20'000;
  ExecutionWord word;
  std::atomic<int> timed_out{0};
  std::atomic<bool> over{false};
  std::thread watchdog([&] {
    std::minstd_rand random(1);
    while (!over) {
      const auto execution = word.look();
      for (std::uint_fast32_t spins = random() % 50; spins > 0; --spins)
        std::atomic_signal_fence(std::memory_order_seq_cst);
      if (!execution || execution->began_ns % 7 != 0 || !word.time_out(*execution)) continue;
      EXPECT_EQ(2 * execution->began_ns, execution->limit_ns) << "of one and the same execution";
      timed_out.fetch_add(1);
      word.set_demoted();
    }
  });
  std::thread remover([&] {
    while (!over) {
      if (word.claim()) word.give_up_claim();
    }
  });
  std::minstd_rand random(2);
  int found_out = 0;
  for (int i = 1; i <= kExecutions; ++i) {
    word.begin(i, 2 * i);
    for (std::uint_fast32_t spins = random() % 200; spins > 0; --spins)
      std::atomic_signal_fence(std::memory_order_seq_cst);
    if (word.end()) continue;
    ++found_out;
    EXPECT_EQ(0, i % 7) << "timed out though nobody looked at this one";
    EXPECT_TRUE(word.come_back());
  }
  over = true;
  watchdog.join();
  remover.join();
  EXPECT_EQ(timed_out, found_out) << "every time-out is found by the thread, and nothing else";
}

TEST(ExecutionWord, ForceTimesOutWhateverIsBetweenEnteringAndLeaving) {
  ExecutionWord word;
  EXPECT_FALSE(word.look_at_any()) << "it is parked";
  word.enter();
  EXPECT_FALSE(word.look()) << "nothing is watched";
  const auto first = word.look_at_any();
  ASSERT_TRUE(first);
  EXPECT_TRUE(word.leave());
  EXPECT_FALSE(word.time_out(*first)) << "it has left";
  word.enter();
  EXPECT_FALSE(word.time_out(*first)) << "and has started anew";
  const auto before = word.look_at_any();
  word.begin(100, 10);
  EXPECT_FALSE(word.time_out(*before)) << "a watched one has begun";
  EXPECT_TRUE(word.end());
  EXPECT_TRUE(word.time_out(*word.look_at_any()));
  EXPECT_FALSE(word.begin(200, 10)) << "the thread finds out at the next one's begin";
  EXPECT_FALSE(word.leave()) << "or where it leaves";
  word.set_demoted();
  EXPECT_TRUE(word.come_back());
  EXPECT_FALSE(word.look_at_any()) << "it has left by then";
  word.enter();
  word.begin(300, 10);
  EXPECT_TRUE(word.leave()) << "which ends what is under way";
  EXPECT_FALSE(word.look());
}

/// A thread enters, now and then begins and ends, and leaves; another one times it out by force at random phases.
TEST(ExecutionWord, AThreadLeavesOrTimesOutWhateverThePhases) {
  constexpr int kRounds = 20'000;
  ExecutionWord word;
  std::atomic<int> timed_out{0};
  std::atomic<bool> over{false};
  const auto spin = [](std::uint_fast32_t spins) {
    for (; spins > 0; --spins) std::atomic_signal_fence(std::memory_order_seq_cst);
  };
  std::thread forcer([&] {
    std::minstd_rand random(3);
    while (!over) {
      const auto execution = word.look_at_any();
      spin(random() % 300);
      if (random() % 4 != 0 || !execution || !word.time_out(*execution)) continue;
      timed_out.fetch_add(1);
      word.set_demoted();
    }
  });
  std::minstd_rand random(4);
  int found_out = 0;
  for (int i = 1; i <= kRounds; ++i) {
    word.enter();
    spin(random() % 100);
    bool goes_on = true;
    if (random() % 2 == 0) goes_on = word.begin(i, 2 * i);
    spin(random() % 100);
    goes_on = goes_on && (random() % 2 == 0 || word.end()) && word.leave();
    if (goes_on) continue;
    ++found_out;
    EXPECT_TRUE(word.come_back());
  }
  over = true;
  forcer.join();
  EXPECT_EQ(timed_out, found_out) << "every time-out is found by the thread, and nothing else";
}

}  // namespace mauve::testing::test_execution_word
