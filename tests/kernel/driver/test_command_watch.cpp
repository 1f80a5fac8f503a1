// SPDX-License-Identifier: LGPL-3.0-or-later
#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <stdexcept>
#include <thread>
#include <vector>

#include "mauve_rt/driver/command_watch.hpp"

namespace {

using mauve::driver::CommandWatch;
using namespace std::chrono_literals;

/// Set by the test.
struct HandClock {
  using duration = std::chrono::nanoseconds;
  using rep = duration::rep;
  using period = duration::period;
  using time_point = std::chrono::time_point<HandClock>;
  static constexpr bool is_steady = true;
  static inline duration now_since_epoch{5s};
  static time_point now() noexcept { return time_point(now_since_epoch); }
};

TEST(CommandWatchOfADriver, TakesACommandUntilItIsOld) {
  CommandWatch<double, HandClock> watch(300ms, 0.0);
  EXPECT_EQ(0.0, watch.value());
  EXPECT_TRUE(watch.is_safe());
  EXPECT_EQ(std::chrono::nanoseconds::max(), watch.age());
  watch.received(1.5);
  EXPECT_EQ(1.5, watch.value());
  EXPECT_FALSE(watch.is_safe());
  HandClock::now_since_epoch += 300ms - 1ns;
  EXPECT_EQ(1.5, watch.value());
  HandClock::now_since_epoch += 1ns;
  EXPECT_EQ(0.0, watch.value());
  EXPECT_TRUE(watch.is_safe());
  EXPECT_EQ(300ms, watch.age());
  watch.received(2.5);
  EXPECT_EQ(2.5, watch.value());
}

TEST(CommandWatchOfADriver, RefusesATimeoutThatIsNoTime) {
  EXPECT_THROW(CommandWatch<int>(0ns, 0), std::invalid_argument);
  EXPECT_THROW(CommandWatch<int>(-1ns, 0), std::invalid_argument);
}

struct Wide {
  std::array<std::uint64_t, 9> words;
  std::uint8_t last;
};

TEST(CommandWatchOfADriver, GivesWholeCommandsBesideAReceiver) {
  CommandWatch<Wide> watch(60s, {});
  std::atomic<bool> is_ending{false};
  std::atomic<int> torn{0};
  const auto read = [&] {
    std::uint64_t newest = 0;
    while (!is_ending.load()) {
      const Wide value = watch.value();
      const std::uint64_t first = value.words.front();
      bool is_whole = value.last == static_cast<std::uint8_t>(first) && first >= newest;
      for (const std::uint64_t word : value.words) is_whole = is_whole && word == first;
      if (!is_whole) ++torn;
      newest = first;
    }
  };
  std::vector<std::thread> readers;
  for (int i = 0; i < 2; ++i) readers.emplace_back(read);
  for (std::uint64_t number = 1; number <= 200'000; ++number) {
    Wide value{.words = {}, .last = static_cast<std::uint8_t>(number)};
    value.words.fill(number);
    watch.received(value);
  }
  is_ending.store(true);
  for (std::thread& reader : readers) reader.join();
  EXPECT_EQ(0, torn.load());
}

}  // namespace
