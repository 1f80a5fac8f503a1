// SPDX-License-Identifier: LGPL-3.0-or-later
// Sequences whose capacity is given with the resource: nothing is allocated after that, nothing is cut, what is too long is refused.
#include <thread>

#include "mauve_rt/architecture/plugin.hpp"
#include "mauve_rt/base/thread_counters.hpp"
#include "mauve_rt/data/capacities.hpp"

#include "fixtures.hpp"

namespace mauve::testing::test_sequence {

struct Scan {
  std::int32_t number{0};
  Sequence<double> ranges;
};
struct Marker {
  BoundedString<16> name;
  Sequence<types::Point> points;
};
struct Markers {
  std::array<Marker, 2> pair;
  Sequence<Marker> markers;
};

}  // namespace mauve::testing::test_sequence

MAUVE_TYPE(mauve::testing::test_sequence::Scan, "test_msgs/msg/SequenceScan", number, ranges)
MAUVE_TYPE(mauve::testing::test_sequence::Marker, "test_msgs/msg/SequenceMarker", name, points)
MAUVE_TYPE(mauve::testing::test_sequence::Markers, "test_msgs/msg/SequenceMarkers", pair, markers)

/// As another library may have it: another struct of the same name and layout, and one of another layout.
namespace mauve::testing::test_sequence::elsewhere {

struct Scan {
  std::int32_t number_m{0};  // one word more
  Sequence<double> ranges;
};
struct Old {
  std::int32_t number{0};
  Sequence<float> ranges;
};

}  // namespace mauve::testing::test_sequence::elsewhere

MAUVE_TYPE(mauve::testing::test_sequence::elsewhere::Scan, "test_msgs/msg/SequenceScan", number_m, ranges)
MAUVE_TYPE(mauve::testing::test_sequence::elsewhere::Old, "test_msgs/msg/SequenceScan", number, ranges)

namespace mauve::testing::test_sequence {

static_assert(kHasSequences<Markers> && !kHasSequences<types::Pose>);
static_assert(!std::is_copy_constructible_v<Scan> && std::is_copy_assignable_v<Scan>);

constexpr std::size_t kCapacity = 8;

Error error_of(const std::function<void()>& call) {
  try {
    call();
  } catch (const Error& error) {
    return error;
  }
  ADD_FAILURE() << "nothing was refused";
  return Error(ErrorCode::internal, "");
}

TEST(Sequence, HoldsItsCapacityAndMarksMore) {
  Sequence<int> three;
  three.allocate(3);
  EXPECT_TRUE(three.push_back(1) && three.push_back(2) && three.push_back(3));
  EXPECT_FALSE(three.is_overflowed());
  EXPECT_FALSE(three.push_back(4));
  EXPECT_TRUE(three.is_overflowed());
  EXPECT_EQ(3U, three.size()) << "unchanged";
  three.clear();
  EXPECT_FALSE(three.is_overflowed());
  EXPECT_TRUE(three.resize(2));
  EXPECT_FALSE(three.resize(4));
  EXPECT_EQ(2U, three.size());
}

TEST(Sequence, IsAssignedWholeOrNotAtAll) {
  Sequence<int> three;
  three.allocate(3);
  Sequence<int> two;
  two.allocate(2);
  three.assign(std::array{1, 2});
  two = three;
  EXPECT_THAT(two.view(), ::testing::ElementsAre(1, 2));
  three.push_back(3);
  two = three;
  EXPECT_TRUE(two.empty() && two.is_overflowed());
  three.push_back(4);
  Sequence<int> also;
  also.allocate(3);
  also = three;
  EXPECT_TRUE(also.is_overflowed()) << "what is marked is not whole";
}

TEST(Sequence, TakesTheLargerBlockOfATemporary) {
  const auto made = [](std::size_t capacity) {
    Sequence<int> sequence;
    sequence.allocate(capacity);
    sequence.push_back(7);
    return sequence;
  };
  Sequence<int> member;
  member = made(4);
  EXPECT_EQ(4U, member.capacity());
  member = made(2);
  EXPECT_EQ(4U, member.capacity());
  EXPECT_THAT(member.view(), ::testing::ElementsAre(7));
}

TEST(Sequence, GoesOverTheWireAndRefusesMoreThanItHolds) {
  const SequenceLimits<Markers> large(Capacities{{"markers", 3}, {"markers.points", 4}, {"pair.points", 1}});
  const SequenceLimits<Markers> small(Capacities{{"markers", 3}, {"markers.points", 1}, {"pair.points", 1}});
  const auto sent = large.make();
  sent->markers.resize(2);
  sent->markers[1].name = "second";
  sent->markers[1].points.assign(std::array{types::Point{1, 2, 3}, types::Point{4, 5, 6}});
  std::vector<std::byte> message;
  CdrWriter(message).put(*sent);
  const auto got = large.make();
  ASSERT_TRUE(CdrReader(message).get(*got));
  ASSERT_EQ(2U, got->markers.size());
  EXPECT_EQ("second", got->markers[1].name);
  ASSERT_EQ(2U, got->markers[1].points.size());
  EXPECT_EQ(6.0, got->markers[1].points[1].z);
  EXPECT_FALSE(CdrReader(message).get(*small.make()));
}

TEST(Capacities, AreOfThePathsOfTheType) {
  const MessageShape shape = message_shape<Markers>();
  EXPECT_THAT(sequence_paths(shape), ::testing::ElementsAre("pair.points", "markers", "markers.points"));
  const Capacities capacities{{"markers", 3}, {"markers.points", 4}, {"pair.points", 1}};
  EXPECT_EQ(sizeof(Markers) + 3 * (sizeof(Marker) + 4 * sizeof(types::Point)) + 2 * sizeof(types::Point),
            value_bytes(shape, capacities));
  const auto number = [](std::int64_t value) { return PropertyValue(value); };
  const ResourceParameters given{{"capacity.markers", number(3)},
                                 {"capacity.markers.points", number(4)},
                                 {"capacity.pair.points", number(1)}};
  EXPECT_EQ(capacities, capacities_of(shape, given));
  ResourceParameters lacking = given;
  lacking.erase("capacity.markers.points");
  EXPECT_EQ("capacity.markers.points", error_of([&] { capacities_of(shape, lacking); }).detail().element);
  ResourceParameters unknown = given;
  unknown.emplace("capacity.point", number(1));
  EXPECT_EQ("one of pair.points, markers, markers.points",
            error_of([&] { capacities_of(shape, unknown); }).detail().expected);
  ResourceParameters none = given;
  none["capacity.markers"] = number(0);
  EXPECT_EQ(ErrorCode::out_of_range, error_of([&] { capacities_of(shape, none); }).code());
  none["capacity.markers"] = PropertyValue(1.5);
  EXPECT_EQ(ErrorCode::type_mismatch, error_of([&] { capacities_of(shape, none); }).code());
}

template <typename ResourceType>
std::unique_ptr<ResourceType> made();
template <>
std::unique_ptr<SharedData<Scan>> made() {
  return std::make_unique<SharedData<Scan>>(Capacities{{"ranges", kCapacity}});
}
template <>
std::unique_ptr<RingBuffer<Scan>> made() {
  return std::make_unique<RingBuffer<Scan>>(4, WhenFull::refuse, Capacities{{"ranges", kCapacity}});
}

template <typename ResourceType>
struct WithSequences : ::testing::Test {
  WithSequences() {
    writer.connect(resource->write, "scan");
    reader.connect(resource->read, "scan");
  }
  bool write(std::int32_t number, std::size_t size) {
    return writer.write_with([&](Scan& scan) {
      scan.number = number;
      if (scan.ranges.resize(size)) std::fill(scan.ranges.begin(), scan.ranges.end(), number);
    });
  }

  std::unique_ptr<ResourceType> resource = made<ResourceType>();
  WritePort<Scan> writer{"writer"};
  ReadPort<Scan> reader{"reader"};
};
using Kinds = ::testing::Types<SharedData<Scan>, RingBuffer<Scan>>;
TYPED_TEST_SUITE(WithSequences, Kinds);

TYPED_TEST(WithSequences, AreWrittenAndReadInPlace) {
  EXPECT_EQ(DataStatus::none, this->reader.with([](const Scan&) { FAIL() << "there is nothing"; }));
  ASSERT_TRUE(this->write(3, 5));
  EXPECT_EQ(DataStatus::new_data, this->reader.with([](const Scan& scan) {
    EXPECT_EQ(3, scan.number);
    EXPECT_THAT(scan.ranges.view(), ::testing::ElementsAre(3, 3, 3, 3, 3));
  }));
  EXPECT_EQ(DataStatus::new_data, this->reader.status());
}

TYPED_TEST(WithSequences, AreCopiedIntoAMemberThatHasItsMemory) {
  Scan out = this->writer.prototype();
  EXPECT_EQ(kCapacity, out.ranges.capacity());
  out.number = 4;
  out.ranges.push_back(1.5);
  ASSERT_TRUE(this->writer.write(out));
  Scan in = this->reader.prototype();
  EXPECT_EQ(DataStatus::new_data, this->reader.read(in));
  EXPECT_EQ(4, in.number);
  EXPECT_THAT(in.ranges.view(), ::testing::ElementsAre(1.5));
}

TYPED_TEST(WithSequences, AMemberWithoutMemoryGetsNothingAndIsCounted) {
  ASSERT_TRUE(this->write(1, 5));
  Scan without;
  EXPECT_EQ(DataStatus::none, this->reader.read(without));
  EXPECT_EQ(1U, this->resource->refused_values());
  EXPECT_THAT(this->resource->why_refused_value(),
              ::testing::HasSubstr("ranges has more elements than its memory"));
}

TYPED_TEST(WithSequences, MoreThanTheCapacityIsRefusedCountedAndExplained) {
  EXPECT_EQ("", this->resource->why_refused_value());
  EXPECT_TRUE(this->write(1, kCapacity));
  EXPECT_FALSE(this->write(2, kCapacity + 1)) << "the place holds no more";
  EXPECT_EQ(1U, this->resource->refused_values());
  Scan longer;
  longer.ranges.allocate(100);
  longer.ranges.resize(20);
  EXPECT_FALSE(this->writer.write(longer));
  EXPECT_EQ(2U, this->resource->refused_values());
  EXPECT_EQ(
      "ranges has 20 elements, the resource's capacity is 8: write no more, or raise capacity.ranges of the "
      "resource",
      this->resource->why_refused_value());
  EXPECT_EQ(DataStatus::new_data, this->reader.with([](const Scan& scan) { EXPECT_EQ(1, scan.number); }));
  for (int i = 0; i < 20; ++i) {  // no place is lost with a refused value
    this->reader.with([](const Scan&) {});
    ASSERT_TRUE(this->write(i, 1)) << i;
  }
}

TYPED_TEST(WithSequences, APlaceReturnsWhenFillOrUseThrows) {
  for (int i = 0; i < 20; ++i) {
    EXPECT_THROW(this->writer.write_with([](Scan&) { throw std::runtime_error("no"); }), std::runtime_error);
    ASSERT_TRUE(this->write(i, 2));
    EXPECT_THROW(this->reader.with([](const Scan&) { throw std::runtime_error("no"); }), std::runtime_error);
  }
}

TYPED_TEST(WithSequences, AMessageOfATopicIsTakenOrRefused) {
  const SequenceLimits<Scan> larger(Capacities{{"ranges", 100}});
  const auto value = larger.make();
  value->ranges.resize(kCapacity);
  std::vector<std::byte> message;
  CdrWriter(message).put(*value);
  EXPECT_TRUE(this->resource->write_sample(message, 1));
  value->ranges.resize(kCapacity + 1);
  CdrWriter(message).put(*value);
  EXPECT_FALSE(this->resource->write_sample(message, 1));
  EXPECT_THAT(this->resource->why_refused(message), ::testing::HasSubstr("ranges has 9 elements"));
  std::uint64_t seen = 0;
  time_ns_t time_ns = 0;
  EXPECT_TRUE(this->resource->next_sample(message, time_ns, seen));
  EXPECT_TRUE(CdrReader(message).get(*value));
  EXPECT_EQ(kCapacity, value->ranges.size());
}

TYPED_TEST(WithSequences, AStopWritesTheEmptyValue) {
  ASSERT_TRUE(this->write(1, 3));
  this->reader.with([](const Scan&) {});
  this->writer.write_zero();
  EXPECT_EQ(DataStatus::new_data, this->reader.with([](const Scan& scan) {
    EXPECT_EQ(0, scan.number);
    EXPECT_TRUE(scan.ranges.empty());
  }));
}

TYPED_TEST(WithSequences, AreKeptInTheLog) {
  this->resource->begin_log(1 << 20);
  ASSERT_TRUE(this->write(1, 3));
  std::vector<std::byte> message;
  time_ns_t time_ns = 0;
  ASSERT_TRUE(this->resource->next_write(message, time_ns));
  const auto value = SequenceLimits<Scan>(Capacities{{"ranges", kCapacity}}).make();
  ASSERT_TRUE(CdrReader(message).get(*value));
  EXPECT_THAT(value->ranges.view(), ::testing::ElementsAre(1, 1, 1));
}

TYPED_TEST(WithSequences, ALookShowsTheNewestValueWhoeverHasReadIt) {
  std::vector<std::byte> message;
  time_ns_t time_ns = 0;
  std::uint64_t sequence = 7;
  const auto look = [&] {
    const auto value = SequenceLimits<Scan>(Capacities{{"ranges", kCapacity}}).make();
    const bool is_there = this->resource->peek_sample(message, time_ns, sequence);
    EXPECT_TRUE(CdrReader(message).get(*value));
    EXPECT_EQ(is_there, sequence != 0);
    return value->number;
  };
  EXPECT_EQ(0, look());
  for (int i = 1; i <= 20; ++i) {
    ASSERT_TRUE(this->write(i, 2));
    EXPECT_EQ(i, look());
    this->reader.with([](const Scan&) {});
    EXPECT_EQ(i, look());
    EXPECT_EQ(static_cast<std::uint64_t>(i), sequence);
  }
}

TYPED_TEST(WithSequences, GoBetweenStructsOfOneLayoutAndBetweenNoOthers) {
  ReadPort<elsewhere::Scan> equal("equal");
  equal.connect(this->resource->read, "scan");
  ASSERT_TRUE(this->write(6, 2));
  EXPECT_EQ(DataStatus::new_data, equal.with([](const elsewhere::Scan& scan) {
    EXPECT_EQ(6, scan.number_m);
    EXPECT_EQ(2U, scan.ranges.size());
  }));
  ReadPort<elsewhere::Old> old("old");
  const Error error = error_of([&] { old.connect(this->resource->read, "scan"); });
  EXPECT_EQ(ErrorCode::type_mismatch, error.code());
  EXPECT_THAT(error.statement(), ::testing::HasSubstr("in field 'ranges'"));
  EXPECT_THAT(error.detail().expected, ::testing::HasSubstr("float32[] ranges at byte 8"));
  EXPECT_THAT(error.detail().found, ::testing::HasSubstr("float64[] ranges at byte 8"));
  EXPECT_THAT(error.detail().found, ::testing::HasSubstr("("));  // the library
}

/// Whole values only, while other threads read and write.
TYPED_TEST(WithSequences, AreWholeBesideOtherWritersAndReaders) {
  constexpr int kWrites = 2000;
  WritePort<Scan> second{"second"};
  second.connect(this->resource->write, "scan");
  ReadPort<Scan> other{"other"};
  other.connect(this->resource->read, "scan");
  std::atomic<bool> done{false};
  const auto write = [&](WritePort<Scan>& port) {
    for (int i = 1; i <= kWrites; ++i) {
      port.write_with([&](Scan& scan) {
        scan.number = i;
        scan.ranges.resize(static_cast<std::size_t>(i) % kCapacity);
        std::fill(scan.ranges.begin(), scan.ranges.end(), i);
      });
    }
  };
  const auto read = [&](ReadPort<Scan>& port) {
    Scan in = port.prototype();
    for (int i = 0; !done; ++i) {
      const auto check = [](const Scan& scan) {
        ASSERT_EQ(static_cast<std::size_t>(scan.number) % kCapacity, scan.ranges.size());
        for (const double range : scan.ranges) ASSERT_EQ(scan.number, range);
      };
      if (i % 2 == 0) {
        port.with(check);
      } else if (port.read(in) == DataStatus::new_data) {
        check(in);
      }
    }
  };
  const auto look = [&] {
    const auto value = SequenceLimits<Scan>(Capacities{{"ranges", kCapacity}}).make();
    std::vector<std::byte> message;
    time_ns_t time_ns = 0;
    std::uint64_t sequence = 0;
    while (!done) {
      if (!this->resource->peek_sample(message, time_ns, sequence)) continue;
      ASSERT_TRUE(CdrReader(message).get(*value));
      for (const double range : value->ranges) ASSERT_EQ(value->number, range);
      std::this_thread::yield();
    }
  };
  std::vector<std::thread> threads;
  threads.emplace_back(look);
  threads.emplace_back([&] { read(this->reader); });
  threads.emplace_back([&] { read(other); });
  std::thread writer([&] { write(second); });
  write(this->writer);
  writer.join();
  done = true;
  for (std::thread& thread : threads) thread.join();
}

TYPED_TEST(WithSequences, AreReadAndWrittenWithoutAllocation) {
  if (allocation_counting() == AllocationCounting::none)
    GTEST_SKIP() << "a sanitizer counts allocations itself";
  Scan out = this->writer.prototype();
  Scan in = this->reader.prototype();
  ThreadCounters counters;
  std::thread thread([&] {
    counters.attach();
    for (int i = 0; i < 100; ++i) {
      if (i == 1) counters.mark();
      this->write(i, kCapacity + i % 2);  // a refused one, too
      this->reader.with([](const Scan&) {});
      out.ranges.resize(static_cast<std::size_t>(i) % kCapacity);
      this->writer.write(out);
      this->reader.read(in);
    }
    counters.detach();
  });
  thread.join();
  EXPECT_EQ(0U, counters.allocations());
}

struct Picture {
  std::array<std::uint8_t, 10'000'000> pixels{};
};

}  // namespace mauve::testing::test_sequence

MAUVE_TYPE(mauve::testing::test_sequence::Picture, "test_msgs/msg/SequencePicture", pixels)

namespace mauve::testing::test_sequence {

template <typename Resource>
void go_on_a_small_stack(Resource& resource) {
  const auto writer = std::make_unique<WritePort<Picture>>("writer");
  writer->connect(resource.write, "picture");
  const auto reader = std::make_unique<ReadPort<Picture>>("reader");
  reader->connect(resource.read, "picture");
  struct Work {
    std::function<void()> call;
    static void* run(void* work) {
      static_cast<Work*>(work)->call();
      return nullptr;
    }
  } work{[&] {
    EXPECT_TRUE(writer->write_with([](Picture& picture) { picture.pixels.back() = 9; }));
    EXPECT_EQ(DataStatus::new_data,
              reader->with([](const Picture& picture) { EXPECT_EQ(9, picture.pixels.back()); }));
    writer->write_zero();
  }};
  pthread_attr_t attributes;
  pthread_attr_init(&attributes);
  pthread_attr_setstacksize(&attributes, std::size_t{64} << 10U);
  pthread_t thread{};
  ASSERT_EQ(0, pthread_create(&thread, &attributes, Work::run, &work));
  pthread_join(thread, nullptr);
  pthread_attr_destroy(&attributes);
}

TEST(SharedData, OfTenMegabytesNeedsNoStack) {
  const auto shared = std::make_unique<SharedData<Picture>>();
  go_on_a_small_stack(*shared);
}
TEST(RingBuffer, OfTenMegabytesNeedsNoStack) {
  const auto ring = std::make_unique<RingBuffer<Picture>>(1);
  go_on_a_small_stack(*ring);
}

/// How often `with` calls its function in three reads of one value.
template <typename T, typename ResourceType>
int calls_of_with(ResourceType& resource) {
  WritePort<T> writer("writer");
  writer.connect(resource.write, "r");
  ReadPort<T> reader("reader");
  reader.connect(resource.read, "r");
  writer.write_with([](T&) {});
  int found = 0;
  for (int i = 0; i < 3; ++i) reader.with([&](const T&) { ++found; });
  return found;
}

/// Small and large values alike.
TEST(SharedData, GivesAnOldValueToWithAgain) {
  SharedData<Number> small;
  EXPECT_EQ(3, calls_of_with<Number>(small));
  EXPECT_EQ(3, calls_of_with<Scan>(*made<SharedData<Scan>>()));
}
TEST(RingBuffer, GivesAValueToWithOnce) {
  RingBuffer<Number> small(4);
  EXPECT_EQ(1, calls_of_with<Number>(small));
  EXPECT_EQ(1, calls_of_with<Scan>(*made<RingBuffer<Scan>>()));
}

TEST(RingBuffer, OfSequencesThatOverwritesKeepsTheNewest) {
  RingBuffer<Scan> ring(2, WhenFull::overwrite, Capacities{{"ranges", kCapacity}});
  WritePort<Scan> writer("writer");
  writer.connect(ring.write, "ring");
  ReadPort<Scan> reader("reader");
  reader.connect(ring.read, "ring");
  for (int i = 1; i <= 5; ++i) EXPECT_TRUE(writer.write_with([&](Scan& scan) { scan.number = i; }));
  std::vector<int> numbers;
  while (reader.with([&](const Scan& scan) { numbers.push_back(scan.number); }) == DataStatus::new_data) {
  }
  EXPECT_THAT(numbers, ::testing::ElementsAre(4, 5));
}

TEST(Sequences, OfAFileAreGivenWithTheResource) {
  PluginRegistry registry;
  registry.type<Scan>();
  const std::string name = type_name<Scan>();
  const ResourceParameters capacity{{"capacity.ranges", PropertyValue(std::int64_t{5})}};
  EXPECT_NE(nullptr, registry.make_resource("shared_data", name, capacity));
  ResourceParameters ring = capacity;
  ring.emplace("capacity", PropertyValue(std::int64_t{3}));
  EXPECT_NE(nullptr, registry.make_resource("ring_buffer", name, ring));
  const Error none = error_of([&] { registry.make_resource("shared_data", name, {}); });
  EXPECT_EQ("add capacity: {ranges: N}", none.detail().remedy);
  EXPECT_EQ(ErrorCode::type_mismatch,
            error_of([&] { registry.make_resource("latest_value", name, capacity); }).code());
  registry.type<types::Pose>();
  const Error needless =
      error_of([&] { registry.make_resource("shared_data", type_name<types::Pose>(), capacity); });
  EXPECT_EQ("none: each field of geometry_msgs/msg/Pose has its bound", needless.detail().expected);
}

}  // namespace mauve::testing::test_sequence
