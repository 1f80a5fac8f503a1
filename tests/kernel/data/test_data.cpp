// SPDX-License-Identifier: LGPL-3.0-or-later
// Serialization, names in errors, trace rings, histograms, the notifier.
#include "fixtures.hpp"

namespace mauve::testing::test_data {

struct Inner {
  std::uint8_t flag{};
  double value{};
};
struct Outer {
  BoundedString<8> name;
  std::uint16_t number{};
  BoundedVector<Inner, 3> items;
  std::array<std::int8_t, 3> bytes{};
  bool last{};
};

}  // namespace mauve::testing::test_data

MAUVE_TYPE(mauve::testing::test_data::Inner, "test_msgs/msg/Inner", flag, value)
MAUVE_TYPE(mauve::testing::test_data::Outer, "test_msgs/msg/Outer", name, number, items, bytes, last)

namespace mauve::testing::test_data {

TEST(Bounded, TextIsTakenAsStandardStringsTakeIt) {
  BoundedVector<BoundedString<8>, 2> names;
  EXPECT_TRUE(names.push_back("x"));
  EXPECT_TRUE(names.push_back(std::string_view("y")));
  EXPECT_EQ("x", names[0]);
  EXPECT_EQ("y", names[1]);
}

TEST(Cdr, MatchesTheWireFormatByteForByte) {
  Outer outer;
  outer.name.assign("ab");
  outer.number = 0x0102;
  outer.items.push_back({1, 2.0});
  outer.bytes = {7, 8, 9};
  outer.last = true;
  std::vector<std::byte> message;
  CdrWriter(message).put(outer);
  std::vector<int> bytes;
  for (const std::byte each : message) bytes.push_back(std::to_integer<int>(each));
  EXPECT_THAT(bytes, ::testing::ElementsAre(0, 1, 0, 0,                 // header
                                            3, 0, 0, 0, 'a', 'b', 0,    // string, 7 bytes
                                            0, 2, 1,                    // aligned to 2
                                            0, 0, 1, 0, 0, 0,           // length, aligned to 4
                                            1, 0, 0, 0, 0, 0, 0, 0,     // flag, then aligned to 8
                                            0, 0, 0, 0, 0, 0, 0, 0x40,  // 2.0
                                            7, 8, 9, 1));
  Outer back;
  ASSERT_TRUE(CdrReader(message).get(back));
  EXPECT_EQ("ab", back.name.view());
  EXPECT_EQ(2.0, back.items[0].value);
  EXPECT_TRUE(back.last);
}

TEST(Cdr, WritesUnitsOfUtf16InFourBytesEach) {
  std::vector<std::byte> message;
  CdrWriter(message).put(BoundedWString<3>(u"a\u20AC"));
  std::vector<int> bytes;
  for (const std::byte each : message) bytes.push_back(std::to_integer<int>(each));
  EXPECT_THAT(bytes, ::testing::ElementsAre(0, 1, 0, 0, 2, 0, 0, 0, 'a', 0, 0, 0, 0xAC, 0x20, 0, 0));
  BoundedWString<2> back;
  EXPECT_TRUE(CdrReader(message).get(back));
  EXPECT_EQ(u"a\u20AC", back);
  BoundedWString<1> small;
  EXPECT_FALSE(CdrReader(message).get(small));
  message[10] = std::byte{1};  // no unit of UTF-16
  EXPECT_FALSE(CdrReader(message).get(back));
  EXPECT_FALSE(CdrReader(std::span(message).first(12)).get(back));
}

TEST(Cdr, RefusesWhatIsShortOrTooLong) {
  Outer outer;
  outer.items.push_back({1, 2.0});
  std::vector<std::byte> message;
  CdrWriter(message).put(outer);
  for (std::size_t size = 0; size < message.size(); ++size) {
    Outer back;
    EXPECT_FALSE(CdrReader(std::span(message).first(size)).get(back)) << size;
  }
  struct Wide {
    BoundedVector<std::uint32_t, 9> items;
  };
  std::vector<std::byte> excessive;
  CdrWriter writer(excessive);
  writer.put(std::uint32_t{1'000'000});
  BoundedVector<std::uint32_t, 9> items;
  EXPECT_FALSE(CdrReader(excessive).get(items));
}

TEST(ArchitectureErrors, NameWhatIsThere) {
  Architecture architecture;
  architecture.add_component<TestShell, TestCore, TestFsm>("c");
  architecture.add_resource<SharedData<Number>>("r");
  const auto code = [&](const char* component, const char* port, const char* resource, const char* service) {
    try {
      architecture.connect(component, port, resource, service);
    } catch (const Error& error) {
      return error.code();
    }
    return ErrorCode::internal;
  };
  EXPECT_EQ(ErrorCode::unknown_component, code("x", "input", "r", "read"));
  EXPECT_EQ(ErrorCode::unknown_port, code("c", "inptu", "r", "read"));
  EXPECT_EQ(ErrorCode::unknown_resource, code("c", "input", "x", "read"));
  EXPECT_EQ(ErrorCode::unknown_service, code("c", "input", "r", "get"));
  EXPECT_EQ(ErrorCode::type_mismatch, code("c", "input", "r", "write"));
  EXPECT_EQ(ErrorCode::internal, code("c", "input", "r", "read"));
  EXPECT_EQ(ErrorCode::duplicate_name, code("c", "input", "r", "read"));
  EXPECT_THROW((architecture.add_component<TestShell, TestCore, TestFsm>("c")), Error);
  EXPECT_THROW((architecture.add_component<TestShell, TestCore, TestFsm>("d", {.priority = 99})), Error);
  EXPECT_THROW((architecture.add_component<TestShell, TestCore, TestFsm>("d", {.priority = 0})), Error);
}

TEST(TraceRing, CountsWhatItCannotKeep) {
  TraceRing ring(3, 4);
  for (int i = 0; i < 6; ++i) ring.push(TraceKind::mark, 0, i);
  EXPECT_EQ(6U, ring.offered());
  EXPECT_EQ(2U, ring.dropped());
  std::vector<TraceRecord> records;
  ring.drain(records);
  ASSERT_EQ(4U, records.size());
  ring.push(TraceKind::mark, 0, 6);
  ring.drain(records);
  EXPECT_EQ(6U, records.back().sequence) << "the gap in the sequence shows the loss";
  EXPECT_EQ(3, records.back().component);
}

TEST(TraceRing, LosesNothingBetweenTwoThreads) {
  TraceRing ring(0, 256);
  std::atomic<bool> done{false};
  std::thread producer([&] {
    for (int i = 0; i < 100'000; ++i) ring.push_at(i, TraceKind::mark, 0, i);
    done = true;
  });
  std::vector<TraceRecord> records;
  while (!done) ring.drain(records);
  producer.join();
  ring.drain(records);
  EXPECT_EQ(100'000U, records.size() + ring.dropped());
  for (std::size_t i = 1; i < records.size(); ++i) ASSERT_LT(records[i - 1].sequence, records[i].sequence);
  for (const TraceRecord& record : records) ASSERT_EQ(record.time_ns, record.a);
}

TEST(LatencyHistogram, QuantilesAreWithinAnEighth) {
  LatencyHistogram histogram;
  for (time_ns_t latency = 1; latency <= 10'000; ++latency) histogram.record(latency);
  EXPECT_NEAR(5000.0, static_cast<double>(histogram.quantile_ns(0.5)), 5000.0 / 8);
  EXPECT_NEAR(9900.0, static_cast<double>(histogram.quantile_ns(0.99)), 9900.0 / 8);
  EXPECT_EQ(10'000, histogram.max_ns());
}

TEST(Maximum, IsKeptSinceTheStartAndSinceItWasTaken) {
  Maximum maximum;
  EXPECT_EQ(0, maximum.take_recent_ns());
  maximum.record(30);
  maximum.record(10);
  EXPECT_EQ(30, maximum.take_recent_ns());
  maximum.record(20);
  EXPECT_EQ(20, maximum.take_recent_ns());
  EXPECT_EQ(0, maximum.take_recent_ns());
  EXPECT_EQ(30, maximum.max_ns());
}

TEST(Notifier, WakesEveryWaiterForEveryWriteThatCameAfterItsLook) {
  constexpr std::uint32_t kWrites = 3000;
  Notifier notifier;
  std::array<std::atomic<std::uint32_t>, 2> seen{};
  const auto follow = [&notifier](std::atomic<std::uint32_t>& mine) {
    while (mine < kWrites) {
      const time_ns_t until = monotonic_now_ns() + s_to_ns(10);
      const std::uint32_t word = notifier.wait(mine, until);
      if (monotonic_now_ns() >= until) return;  // nobody woke it
      mine = word;
    }
  };
  {
    const std::jthread first([&] { follow(seen[0]); });
    const std::jthread second([&] { follow(seen[1]); });
    const time_ns_t until = monotonic_now_ns() + s_to_ns(60);
    for (std::uint32_t i = 1; i <= kWrites; ++i) {
      notifier.wait(i - 1, monotonic_now_ns());  // a third one gives up
      notifier.notify();
      Backoff backoff;
      while ((seen[0] < i || seen[1] < i) && monotonic_now_ns() < until) backoff();
    }
  }
  EXPECT_EQ(seen[0], kWrites);
  EXPECT_EQ(seen[1], kWrites);
}

}  // namespace mauve::testing::test_data
