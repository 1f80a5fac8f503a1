// SPDX-License-Identifier: LGPL-3.0-or-later
// Every write to a resource is kept for a recorder, in order; what finds no room is counted; no writer waits or allocates.
#include <thread>

#include "mauve_rt/base/thread_counters.hpp"

#include "fixtures.hpp"

namespace mauve::testing::test_write_log {

using Written = std::pair<double, time_ns_t>;

/// All that a resource has kept, and not given yet.
template <typename Value = Number>
std::vector<Written> taken(Resource& resource) {
  std::vector<Written> all;
  std::vector<std::byte> message;
  time_ns_t time_ns = 0;
  while (resource.next_write(message, time_ns)) {
    Value value;
    EXPECT_TRUE(CdrReader(message).get(value));
    if constexpr (std::is_same_v<Value, EventCount>)
      all.emplace_back(value.data, time_ns);
    else
      all.emplace_back(value.value, time_ns);
  }
  return all;
}

template <typename Made>
struct WriteLogs : ::testing::Test {
  Made resource;
};

using Kinds = ::testing::Types<SharedData<Number>, LatestValue<Number>>;
TYPED_TEST_SUITE(WriteLogs, Kinds);

TYPED_TEST(WriteLogs, KeepEveryWriteFromTheBeginToTheEnd) {
  auto& resource = this->resource;
  resource.write.write({1.0}, 10);
  EXPECT_EQ(taken(resource), std::vector<Written>{}) << "nobody has asked yet";
  resource.begin_log(1024);
  for (int i = 2; i <= 4; ++i) resource.write.write({static_cast<double>(i)}, 10 * i);
  EXPECT_EQ(taken(resource), (std::vector<Written>{{2.0, 20}, {3.0, 30}, {4.0, 40}}));
  EXPECT_EQ(TryWrite::done, resource.write.try_write({5.0}, 50));
  EXPECT_EQ(taken(resource), (std::vector<Written>{{5.0, 50}}));
  resource.write.raise_floor(100);
  resource.write.write({6.0}, 99);
  EXPECT_EQ(taken(resource), std::vector<Written>{}) << "a write that is dropped is none";
  resource.write.write({7.0}, 100);
  resource.end_log();
  resource.write.write({8.0}, 101);
  EXPECT_EQ(taken(resource), std::vector<Written>{});
  EXPECT_EQ(0U, resource.lost_writes());
}

TYPED_TEST(WriteLogs, CountWhatFindsNoRoom) {
  auto& resource = this->resource;
  resource.begin_log(1);  // the fewest: 16
  for (int i = 1; i <= 20; ++i) resource.write.write({static_cast<double>(i)}, i);
  EXPECT_EQ(4U, resource.lost_writes());
  const std::vector<Written> kept = taken(resource);
  ASSERT_EQ(16U, kept.size());
  EXPECT_EQ(Written(16.0, 16), kept.back());
  resource.write.write({21.0}, 21);
  EXPECT_EQ(taken(resource), (std::vector<Written>{{21.0, 21}}));
}

TYPED_TEST(WriteLogs, NoWriterAllocatesOrFaults) {
  if (allocation_counting() == AllocationCounting::none)
    GTEST_SKIP() << "a sanitizer counts allocations itself";
  auto& resource = this->resource;
  resource.begin_log(1 << 16U);
  ThreadCounters counters;
  std::thread writer([&] {
    counters.attach();
    resource.write.write({0.0}, 0);
    counters.mark();
    for (int i = 1; i < 1000; ++i) resource.write.write({static_cast<double>(i)}, i);
    counters.detach();
  });
  writer.join();
  EXPECT_EQ(0U, counters.allocations());
  EXPECT_EQ(1000U, taken(resource).size());
}

TYPED_TEST(WriteLogs, NothingIsLostOrTornBetweenThreads) {
  auto& resource = this->resource;
  resource.begin_log(1 << 20U);
  constexpr int kWrites = 200'000;
  std::atomic<bool> done{false};
  std::thread writer([&] {
    for (int i = 1; i <= kWrites; ++i) {
      while (!resource.write.write({static_cast<double>(i)}, i)) {
      }
    }
    done = true;
  });
  std::uint64_t seen = 0;
  double last = 0;
  for (bool ending = false; !ending;) {
    ending = done;
    for (const auto& [value, time_ns] : taken(resource)) {
      EXPECT_GT(value, last);
      EXPECT_EQ(value, static_cast<double>(time_ns));
      last = value;
      ++seen;
    }
  }
  writer.join();
  EXPECT_EQ(static_cast<std::uint64_t>(kWrites), seen + resource.lost_writes());
}

TYPED_TEST(WriteLogs, BeginAndEndWhileAWriterRuns) {
  auto& resource = this->resource;
  std::atomic<bool> done{false};
  std::atomic<int> written{0};
  std::thread writer([&] {
    for (int i = 1; !done; ++i) {
      resource.write.write({static_cast<double>(i)}, i);
      written = i;
    }
  });
  std::size_t seen = 0;
  for (int round = 0; round < 200; ++round) {
    resource.begin_log(1024);
    for (const int before = written; written == before;) std::this_thread::yield();
    const std::vector<Written> kept = taken(resource);
    for (std::size_t i = 1; i < kept.size(); ++i) EXPECT_GT(kept[i].first, kept[i - 1].first);
    seen += kept.size();
    resource.end_log();
  }
  done = true;
  writer.join();
  EXPECT_GT(seen, 0U);
}

TEST(WriteLog, OfARingHasWhatReadersTookAndWhatWasOverwritten) {
  RingBuffer<Number> ring(2, WhenFull::overwrite);
  ring.begin_log(1024);
  for (int i = 1; i <= 4; ++i) ring.write.write({static_cast<double>(i)}, i);
  std::vector<std::byte> message;
  time_ns_t time_ns = 0;
  std::uint64_t sequence = 0;
  EXPECT_TRUE(ring.next_sample(message, time_ns, sequence));
  EXPECT_EQ(4U, taken(ring).size());
  RingBuffer<Number> refusing(1);
  refusing.begin_log(1024);
  EXPECT_TRUE(refusing.write.write({1.0}, 1));
  EXPECT_FALSE(refusing.write.write({2.0}, 2));
  EXPECT_EQ(taken(refusing), (std::vector<Written>{{1.0, 1}})) << "a write that is refused is none";
}

TEST(WriteLog, OfAnEventHasEachRaise) {
  EventCounter event;
  event.begin_log(1024);
  event.raise.raise(10);
  event.raise.raise(20);
  EXPECT_EQ(taken<EventCount>(event), (std::vector<Written>{{1.0, 10}, {2.0, 20}}));
}

TEST(WriteLog, IsRefusedWhereThereAreNoValues) {
  struct Map : Resource {
    Map() : Resource("mission/Map", "mission/Map") {}
  } map;
  EXPECT_THROW(map.begin_log(1024), Error);
  map.end_log();
  std::vector<std::byte> message;
  time_ns_t time_ns = 0;
  EXPECT_FALSE(map.next_write(message, time_ns));
}

}  // namespace mauve::testing::test_write_log
