// SPDX-License-Identifier: LGPL-3.0-or-later
// Signals between threads: no value beyond a bound is lost.
#include <gtest/gtest.h>

#include <random>
#include <thread>

#include "mauve_rt/rules/engine.hpp"

namespace mauve::rules::test_signal {
namespace {

constexpr double kBound = 10.0;

Engine watching(When when) { return Engine({{.name = "r", .when = std::move(when)}}); }
When above(double hysteresis = 0.0) {
  return {.kind = "value",
          .parameters = {{"topic", "t"}, {"field", "v"}, {"above", kBound}, {"hysteresis", hysteresis}}};
}
When is_true() { return {.kind = "boolean", .parameters = {{"topic", "t"}}}; }

/// Counts how often the condition has begun to hold.
int taken_pulses(Engine& engine) {
  int begun = 0;
  while (const auto decision = engine.take()) begun += decision->decided == Decided::condition_true ? 1 : 0;
  return begun;
}

TEST(Signal, CountsCrossingsOfItsBounds) {
  Signal signal(std::make_shared<EngineWord>());
  signal.count_crossings({.low = -5, .high = 5}, {.low = -10, .high = 10}, false);
  const double nothing = std::numeric_limits<double>::quiet_NaN();
  for (const double value : {1.0, 11.0, 7.0, 12.0}) signal.tell(static_cast<time_ns_t>(value), value);
  EXPECT_EQ(0U, signal.entered().count);
  EXPECT_EQ(1U, signal.left().count);
  EXPECT_EQ(11, signal.left().time_ns);
  EXPECT_EQ(4U, signal.last().count);
  signal.tell(13, 5.0);
  signal.tell(14, nothing);
  EXPECT_EQ(2U, signal.entered().count);
  EXPECT_EQ(3U, signal.left().count) << "NaN is within no bounds";
}

TEST(Signal, APulseBetweenTwoLooksIsSeenOnceAndItsEndNext) {
  for (const auto& [when, low, high] :
       {std::tuple(above(), 0.0, 11.0), std::tuple(above(2.0), 0.0, 11.0), std::tuple(is_true(), 0.0, 1.0)}) {
    Engine engine = watching(when);
    Signal& signal = *engine.signals().at(0).signal;
    engine.arm(0);
    engine.step(0);
    signal.tell(1, low);
    signal.tell(2, high);
    signal.tell(3, low);
    const time_ns_t next_ns = engine.step(5);
    EXPECT_TRUE(engine.status(0).holds());
    EXPECT_EQ(2, engine.status(0).since_ns);
    EXPECT_EQ(high, engine.status(0).measured);
    EXPECT_EQ(6, next_ns) << "its end is looked at at once";
    EXPECT_EQ(kForever, engine.step(next_ns));
    EXPECT_FALSE(engine.status(0).holds());
    EXPECT_EQ(3, engine.status(0).since_ns);
    EXPECT_EQ(1, taken_pulses(engine));
  }
}

TEST(Signal, APulseAfterAnotherOneIsSeenThoughNothingElseWas) {
  Engine engine = watching(above());
  Signal& signal = *engine.signals().at(0).signal;
  engine.arm(0);
  signal.tell(1, 11.0);
  engine.step(1);
  for (const double value : {0.0, 11.0, 0.0}) signal.tell(2, value);
  for (const time_ns_t now_ns : {3, 4, 5}) engine.step(now_ns);
  EXPECT_FALSE(engine.status(0).holds());
  EXPECT_EQ(2, taken_pulses(engine));
  for (int i = 0; i < 100; ++i) signal.tell(6, i % 2 == 0 ? 11.0 : 0.0);
  time_ns_t now_ns = 6;
  for (time_ns_t next_ns = now_ns; next_ns != kForever; next_ns = engine.step(now_ns)) now_ns = next_ns;
  EXPECT_FALSE(engine.status(0).holds());
  EXPECT_EQ(1, taken_pulses(engine)) << "one of many";
}

TEST(Signal, ADipBetweenTwoLooksEndsWhatHasHeldWithoutABreak) {
  When when = above();
  when.for_ns = 100;
  Engine engine = watching(when);
  Signal& signal = *engine.signals().at(0).signal;
  engine.arm(0);
  signal.tell(0, 11.0);
  engine.step(0);
  signal.tell(90, 0.0);
  signal.tell(91, 11.0);
  for (const time_ns_t now_ns : {95, 96, 150}) engine.step(now_ns);
  EXPECT_FALSE(engine.status(0).holds());
  engine.step(191);
  EXPECT_TRUE(engine.status(0).holds());
}

TEST(Signal, AValueWithinTheHysteresisIsNoPulse) {
  Engine engine = watching(above(2.0));
  Signal& signal = *engine.signals().at(0).signal;
  engine.arm(0);
  for (const double value : {11.0, 9.0}) signal.tell(1, value);
  engine.step(1);
  engine.step(2);
  EXPECT_TRUE(engine.status(0).holds()) << "9 is not below 8";
}

TEST(Signal, APulseBeforeArmingDoesNotCountAndAValueThatStaysDoes) {
  for (const bool stays : {false, true}) {
    Engine engine = watching(above());
    Signal& signal = *engine.signals().at(0).signal;
    signal.tell(1, 11.0);
    if (!stays) signal.tell(2, 0.0);
    engine.arm(3);
    engine.step(3);
    EXPECT_EQ(stays, engine.status(0).holds());
    EXPECT_EQ(3, engine.status(0).since_ns);
  }
}

TEST(Signal, WithinATimeCountsAPulse) {
  When when = above();
  when.within_ns = 1000;
  Engine engine = watching(when);
  Signal& signal = *engine.signals().at(0).signal;
  engine.arm(0);
  signal.tell(10, 11.0);
  signal.tell(20, 0.0);
  engine.step(engine.step(500));
  EXPECT_TRUE(engine.status(0).holds());
  EXPECT_EQ(1020, engine.step(600)) << "so long after its end";
  engine.step(1020);
  EXPECT_FALSE(engine.status(0).holds());
}

/// A writer at any phase to the thread that looks; the next pulse comes when the one before was seen.
TEST(Signal, NoPulseOfAnotherThreadIsLost) {
  constexpr int kPulses = 20'000;
  Engine engine = watching(above());
  Signal& signal = *engine.signals().at(0).signal;
  engine.arm(0);
  std::atomic<int> seen{0};
  std::atomic<bool> gives_up{false};
  std::thread writing([&] {
    std::minstd_rand random(1);
    for (int pulse = 1; pulse <= kPulses; ++pulse) {
      for (auto wait = random() % 2000; wait > 0; --wait) std::atomic_signal_fence(std::memory_order_seq_cst);
      for (const double value : {11.0, 0.0}) signal.tell(monotonic_now_ns(), value);
      while (seen.load() < pulse && !gives_up.load()) std::this_thread::yield();
    }
  });
  const time_ns_t until_ns = monotonic_now_ns() + s_to_ns(60);
  while (seen.load() < kPulses && monotonic_now_ns() < until_ns) {
    const std::uint32_t word = engine.word().load(std::memory_order_acquire);
    const time_ns_t next_ns = engine.step(monotonic_now_ns());
    seen.fetch_add(taken_pulses(engine));
    futex_wait_until(engine.word(), word, std::min(next_ns, until_ns));
  }
  gives_up.store(true);
  writing.join();
  EXPECT_EQ(kPulses, seen.load());
}

}  // namespace
}  // namespace mauve::rules::test_signal
