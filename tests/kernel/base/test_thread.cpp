// SPDX-License-Identifier: LGPL-3.0-or-later
// How threads are made: what they are told, and what they are found to be.
#include <csignal>
#include <cstring>

#include "mauve_rt/base/seam/thread.hpp"

#include "fixtures.hpp"

namespace mauve::testing::test_thread {

struct Seen {
  char name[16]{};
  bool blocks_signals{false};
  std::atomic<bool> go_on{false};
};

void* look(void* argument) {
  auto& seen = *static_cast<Seen*>(argument);
  while (!seen.go_on) std::this_thread::sleep_for(std::chrono::microseconds(100));
  pthread_getname_np(pthread_self(), seen.name, sizeof(seen.name));
  sigset_t blocked;
  pthread_sigmask(SIG_SETMASK, nullptr, &blocked);
  seen.blocks_signals = sigismember(&blocked, SIGINT) == 1 && sigismember(&blocked, SIGTERM) == 1;
  return nullptr;
}

TEST(Threads, AreAsToldAndSayWhatTheyAre) {
  Seen seen;
  Thread thread;
  ASSERT_EQ(0, thread.start({.name = "a name that is too long",
                             .priority = 7,
                             .cpus = {kComponentsCpu},
                             .stack_bytes = std::size_t{256} * 1024},
                            look, &seen));
  thread.prefault_stack();
  const ThreadFacts facts = thread.facts();
  seen.go_on = true;
  thread.join();
  EXPECT_STREQ("a name that is ", seen.name);
  EXPECT_TRUE(seen.blocks_signals);
  EXPECT_EQ(std::vector<int>{kComponentsCpu}, facts.cpus);
  EXPECT_GE(facts.guard_bytes, kStackGuardBytes);
  EXPECT_EQ(may_use_fifo() ? "SCHED_FIFO" : "SCHED_OTHER", facts.policy)
      << "an ordinary one where it is refused";
  EXPECT_EQ(may_use_fifo() ? 7 : 0, facts.priority);
}

TEST(Threads, LeaveTheirMakersSignalsAsTheyWere) {
  sigset_t before;
  sigset_t after;
  pthread_sigmask(SIG_SETMASK, nullptr, &before);
  Seen seen;
  seen.go_on = true;
  Thread thread;
  ASSERT_EQ(0, thread.start({.name = "short"}, look, &seen));
  pthread_sigmask(SIG_SETMASK, nullptr, &after);
  thread.join();
  EXPECT_EQ(sigismember(&before, SIGINT), sigismember(&after, SIGINT));
}

TEST(Threads, ThatMustBeRealTimeAreRefusedWhereTheyCannotBe) {
  if (may_use_fifo()) GTEST_SKIP() << "needs a process without the right to SCHED_FIFO";
  Seen seen;
  Thread thread;
  EXPECT_EQ(EPERM, thread.start({.name = "c", .priority = 7, .require_realtime = true}, look, &seen));
}

}  // namespace mauve::testing::test_thread
