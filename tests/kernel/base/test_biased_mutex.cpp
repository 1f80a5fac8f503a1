// SPDX-License-Identifier: LGPL-3.0-or-later
// BiasedMutex: one user enters without a lock, and all others come in all the same.
#include "mauve_rt/base/biased_mutex.hpp"

#include "fixtures.hpp"

namespace mauve::testing::test_biased_mutex {

using Hold = BiasedMutex::Hold;
using Seat = BiasedMutex::Seat;

TEST(BiasedMutex, OnlyASeatThatIsAloneHasTheBias) {
  if (!has_process_barrier()) GTEST_SKIP() << "needs membarrier(2)";
  BiasedMutex mutex;
  Seat first;
  Seat second;
  EXPECT_FALSE(mutex.is_biased());
  mutex.add(first);
  EXPECT_TRUE(mutex.is_biased());
  mutex.add(second);
  EXPECT_FALSE(mutex.is_biased());
  mutex.remove(first);
  EXPECT_TRUE(mutex.is_biased()) << "of the other one";
  mutex.add(first);
  mutex.remove(first);
  EXPECT_TRUE(mutex.is_biased());
  mutex.share();
  EXPECT_FALSE(mutex.is_biased());
  mutex.remove(second);
  mutex.add(first);
  EXPECT_FALSE(mutex.is_biased());
}

TEST(BiasedMutex, NobodyEntersBesideTheUserOfTheSeat) {
  BiasedMutex mutex;
  Seat seat;
  mutex.add(seat);
  std::atomic<bool> is_inside{false};
  std::atomic<bool> leaves{false};
  std::atomic<bool> has_left{false};
  std::thread user([&] {
    const Hold hold(mutex, &seat);
    is_inside = true;
    while (!leaves) std::this_thread::yield();
    has_left = true;
  });
  while (!is_inside) std::this_thread::yield();
  EXPECT_FALSE(mutex.try_lock());
  EXPECT_FALSE(mutex.try_lock()) << "the first try has given the bias back";
  std::thread other([&] {
    const std::lock_guard lock(mutex);
    EXPECT_TRUE(has_left);
  });
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  leaves = true;
  user.join();
  other.join();
  EXPECT_TRUE(mutex.try_lock());
  mutex.unlock();
  EXPECT_EQ(0, PiMutex::held_by_this_thread());
}

TEST(BiasedMutex, AThreadHoldsNoLockWhileItHasTheBias) {
  if (!has_process_barrier()) GTEST_SKIP() << "needs membarrier(2)";
  BiasedMutex mutex;
  Seat seat;
  mutex.add(seat);
  const Hold hold(mutex, &seat);
  EXPECT_EQ(0, PiMutex::held_by_this_thread());
}

/// Users of a seat, users without, one that only tries, and seats that come and go: no two are inside at once.
TEST(BiasedMutex, KeepsAllApartWhateverTheyDo) {
  constexpr int kTurns = 20'000;
  BiasedMutex mutex;
  Seat seat;
  mutex.add(seat);
  std::int64_t count = 0;  // plain: ThreadSanitizer would see two inside
  std::atomic<bool> done{false};
  std::int64_t others = 0;
  std::int64_t tries = 0;
  std::int64_t visits = 0;
  std::thread other([&] {
    while (!done) {
      const std::lock_guard lock(mutex);
      ++count;
      ++others;
    }
  });
  std::thread trier([&] {
    while (!done) {
      if (!mutex.try_lock()) continue;
      ++count;
      ++tries;
      mutex.unlock();
    }
  });
  std::thread visitor([&] {
    while (!done) {
      Seat passing;
      mutex.add(passing);
      for (int i = 0; i < 10; ++i) {
        const Hold hold(mutex, &passing);
        ++count;
        ++visits;
      }
      mutex.remove(passing);
      std::this_thread::sleep_for(std::chrono::microseconds(50));
    }
  });
  for (int i = 0; i < kTurns; ++i) {
    const Hold hold(mutex, &seat);
    ++count;
  }
  done = true;
  other.join();
  trier.join();
  visitor.join();
  EXPECT_EQ(kTurns + others + tries + visits, count);
}

}  // namespace mauve::testing::test_biased_mutex
