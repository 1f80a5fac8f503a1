// SPDX-License-Identifier: LGPL-3.0-or-later
// RingBuffer: a read removes, each element goes to one reader, loss is counted.
#include "fixtures.hpp"

namespace mauve::testing::test_ring_buffer {

struct RingFixture : ::testing::Test {
  RingFixture() {
    writer.output.connect(ring.write, "ring");
    first.input.connect(ring.read, "ring");
    first.set_context(&context);
  }
  Context context;
  TestShell writer;
  TestShell first;
  TestShell second;
  RingBuffer<Number> ring{2};
};

/// What holds with one port at each end, without a lock, holds with two, which have one.
struct Ring : RingFixture, ::testing::WithParamInterface<bool> {
  Ring() {
    if (!has_two()) return;
    second.input.connect(ring.read, "ring");
    other_writer.output.connect(ring.write, "ring");
  }
  static bool has_two() { return GetParam(); }
  TestShell other_writer;
};
INSTANTIATE_TEST_SUITE_P(Ports, Ring, ::testing::Bool(),
                         [](const auto& each) { return each.param ? "two" : "one"; });

TEST_P(Ring, HasALockWithTwoPortsAtAnEnd) {
  if (!has_process_barrier()) GTEST_SKIP() << "needs membarrier(2)";
  EXPECT_EQ(!has_two(), first.input.service()->is_wait_free());
  EXPECT_EQ(!has_two(), writer.output.service()->is_wait_free());
  second.input.disconnect();
  other_writer.output.disconnect();
  EXPECT_TRUE(first.input.service()->is_wait_free());
  EXPECT_TRUE(writer.output.service()->is_wait_free());
  ring.bind_input();
  EXPECT_FALSE(writer.output.service()->is_wait_free()) << "an incoming topic writes as well";
  EXPECT_TRUE(first.input.service()->is_wait_free());
  RingBuffer<Number> overwriting(2, WhenFull::overwrite);
  first.input.connect(overwriting.read, "overwriting");
  EXPECT_FALSE(first.input.service()->is_wait_free()) << "its writer removes elements too";
}

TEST_P(Ring, GivesElementsInOrderAndRefusesWhatFindsNoRoom) {
  for (int lap = 0; lap < 5; ++lap) {
    EXPECT_TRUE(writer.output.write({1.0 + lap}));
    EXPECT_TRUE(writer.output.write({2.0 + lap}));
    EXPECT_FALSE(writer.output.write({3.0 + lap}));
    EXPECT_EQ(lap + 1U, ring.lost());
    EXPECT_EQ(1.0 + lap, first.input.read().value.value);
    EXPECT_TRUE(writer.output.write({4.0 + lap}));
    EXPECT_EQ(2.0 + lap, first.input.read().value.value);
    EXPECT_EQ(4.0 + lap, first.input.read().value.value);
    EXPECT_EQ(DataStatus::old_data, first.input.read().status);
  }
}

TEST_F(RingFixture, EachElementGoesToOneReaderAndAFullRingRefuses) {
  second.input.connect(ring.read, "ring");
  EXPECT_TRUE(writer.output.write({1.0}));
  EXPECT_TRUE(writer.output.write({2.0}));
  EXPECT_FALSE(writer.output.write({3.0}));
  EXPECT_EQ(1U, ring.lost());
  EXPECT_EQ(1.0, first.input.read().value.value);
  EXPECT_EQ(2.0, second.input.read().value.value);
}

TEST_F(RingFixture, StatusIsPerPort) {
  second.input.connect(ring.read, "ring");
  EXPECT_EQ(DataStatus::none, first.input.read().status);
  writer.output.write({1.0});
  EXPECT_EQ(DataStatus::new_data, first.input.read().status);
  EXPECT_EQ(DataStatus::old_data, first.input.read().status) << "it has had an element";
  EXPECT_EQ(DataStatus::none, second.input.read().status) << "it has had none";
  writer.output.write({2.0});
  EXPECT_EQ(DataStatus::new_data, second.input.read().status);
  EXPECT_EQ(DataStatus::old_data, first.input.read().status);
}

TEST_P(Ring, AnEmptyRingLeavesTheLastElementsTimeAndThePlaceAlone) {
  Context clock;
  writer.set_context(&clock);
  clock.clock_ns = 10;
  writer.output.write({1.0});
  Number place;
  EXPECT_EQ(DataStatus::new_data, first.input.read(place));
  time_ns_t time_ns = 0;
  EXPECT_EQ(DataStatus::old_data, first.input.read(place, &time_ns));
  EXPECT_EQ(1.0, place.value);
  EXPECT_EQ(10, time_ns);
  const Sample<Number> sample = first.input.read();
  EXPECT_EQ(10, sample.time_ns);
  EXPECT_EQ(7.0, sample.value.value) << "an element is given once; without one, the port's default";
  context.clock_ns = 40;
  EXPECT_EQ(30, first.input.age_ns());
  first.input.disconnect();
  first.input.connect(ring.read, "ring");
  EXPECT_EQ(DataStatus::none, first.input.read().status);
}

TEST_P(Ring, ALookShowsTheElementWrittenLastAndTakesNoneAway) {
  std::vector<std::byte> message;
  time_ns_t time_ns = 0;
  std::uint64_t written = 7;
  const auto looked = [&] {
    Number number;
    EXPECT_TRUE(CdrReader(message).get(number));
    return number.value;
  };
  EXPECT_FALSE(ring.peek_sample(message, time_ns, written));
  EXPECT_EQ(0U, written);
  EXPECT_EQ(0.0, looked());
  for (int i = 1; i <= 2; ++i) ring.write.write({static_cast<double>(i)}, 10 * i);
  for (int i = 0; i < 2; ++i) {
    EXPECT_TRUE(ring.peek_sample(message, time_ns, written));
    EXPECT_EQ(2.0, looked());
    EXPECT_EQ(20, time_ns);
    EXPECT_EQ(2U, written);
  }
  std::uint64_t seen = 0;
  EXPECT_TRUE(ring.next_sample(message, time_ns, seen));
  EXPECT_EQ(1.0, looked());
  EXPECT_TRUE(ring.next_sample(message, time_ns, seen));
  EXPECT_TRUE(ring.peek_sample(message, time_ns, written)) << "readers took all";
  EXPECT_EQ(2.0, looked());
}

TEST_F(RingFixture, OverwritingKeepsTheNewestAndCountsTheLost) {
  RingBuffer<Number> overwriting(2, WhenFull::overwrite);
  writer.output.connect(overwriting.write, "ring");
  first.input.connect(overwriting.read, "ring");
  for (const double value : {1.0, 2.0, 3.0}) EXPECT_TRUE(writer.output.write({value}));
  EXPECT_EQ(1U, overwriting.lost());
  EXPECT_EQ(2.0, first.input.read().value.value);
  EXPECT_EQ(3.0, first.input.read().value.value);
  EXPECT_EQ(DataStatus::old_data, first.input.read().status) << "it is empty";
  EXPECT_TRUE(writer.output.write({4.0}));
  EXPECT_EQ(4.0, first.input.read().value.value);
  EXPECT_EQ(DataStatus::old_data, first.input.read().status);
}

/// Beside whoever looks at the newest one, and whoever takes a recording, which both come without a port.
TEST_P(Ring, NoElementIsLostOrGivenTwiceBetweenThreads) {
  constexpr int kElements = 20'000;
  std::atomic<bool> done{false};
  std::vector<double> taken[2];
  const auto take = [&](TestShell& shell, std::vector<double>& into) {
    Backoff backoff;
    for (;;) {
      const bool last_round = done;
      const Sample<Number> sample = shell.input.read();
      if (sample.is_new()) {
        into.push_back(sample.value.value);
        backoff = {};
      } else if (last_round) {
        return;
      } else {
        backoff();
      }
    }
  };
  std::thread one([&] { take(first, taken[0]); });
  std::thread two([&] {
    if (has_two()) take(second, taken[1]);
  });
  std::thread looker([&] {
    std::vector<std::byte> message;
    time_ns_t time_ns = 0;
    std::uint64_t last = 0;
    std::uint64_t written = 0;
    for (bool is_logged = false; !done; is_logged = !is_logged) {
      if (!ring.peek_sample(message, time_ns, written)) continue;
      Number number;
      EXPECT_TRUE(CdrReader(message).get(number));
      EXPECT_EQ(static_cast<double>(written - 1), number.value);
      EXPECT_GE(written, last);
      last = written;
      is_logged ? ring.end_log() : ring.begin_log(4096);
      std::this_thread::yield();
    }
  });
  for (int i = 0; i < kElements; ++i) {
    Backoff backoff;
    while (!writer.output.write({static_cast<double>(i)})) backoff();
  }
  done = true;
  one.join();
  two.join();
  looker.join();
  std::vector<int> times(kElements, 0);
  for (const auto& list : taken) {
    EXPECT_TRUE(std::is_sorted(list.begin(), list.end()));
    for (const double value : list) ++times[static_cast<std::size_t>(value)];
  }
  EXPECT_EQ(kElements, std::count(times.begin(), times.end(), 1));
}

/// A second port at either end comes and goes while both ends are in use.
TEST_F(RingFixture, NoElementIsLostOrGivenTwiceWhilePortsComeAndGo) {
  constexpr std::uint64_t kElements = 20'000;
  std::atomic<bool> done{false};
  std::atomic<std::uint64_t> given{0};
  const auto write = [&](WritePort<Number>& port) {
    Backoff backoff;
    while (!port.write({1.0})) backoff();
  };
  std::thread reader([&] {
    Backoff backoff;
    for (;;) {
      const bool last_round = done;
      if (first.input.read().is_new()) {
        ++given;
        backoff = {};
      } else if (last_round) {
        return;
      } else {
        backoff();
      }
    }
  });
  std::atomic<std::uint64_t> added{0};
  std::thread visitor([&] {
    while (!done) {
      second.input.connect(ring.read, "ring");
      second.output.connect(ring.write, "ring");
      if (second.output.write({1.0})) ++added;
      if (second.input.read().is_new()) ++given;
      second.input.disconnect();
      second.output.disconnect();
      std::this_thread::sleep_for(std::chrono::microseconds(50));
    }
  });
  for (std::uint64_t i = 0; i < kElements; ++i) write(writer.output);
  done = true;
  visitor.join();
  reader.join();
  while (first.input.read().is_new()) ++given;
  EXPECT_EQ(kElements + added, given);
}

TEST(RingBuffer, WithoutACapacityIsRefused) {
  try {
    RingBuffer<Number> ring(0);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(ErrorCode::invalid_argument, error.code());
    EXPECT_EQ("capacity", error.detail().element);
  }
  PluginRegistry registry;
  registry.type<Number>();
  EXPECT_THROW(registry.make_resource("ring_buffer", "std_msgs/msg/Float64", {}), Error);
}

}  // namespace mauve::testing::test_ring_buffer
