// SPDX-License-Identifier: LGPL-3.0-or-later
// LatestValue: readers of one writer that see whole values in order, whatever the writer does.
#include "fixtures.hpp"

namespace mauve::testing::test_latest_value {

/// Large enough to be torn.
struct Block {
  std::array<std::uint64_t, 64> words{};
};
/// Small enough for the way in front of the slots.
struct Pair {
  std::array<std::uint64_t, 2> words{};
};
static_assert(LatestRegister<Pair>::kHasFront && !LatestRegister<Block>::kHasFront);
/// Cannot be copied as bytes.
struct Owning {
  Owning() = default;
  Owning(const Owning& other) : value(other.value) {}
  Owning& operator=(const Owning& other) {
    value = other.value;
    return *this;
  }
  double value{};
};
/// Large enough to be torn, and not to be copied as bytes.
struct OwningBlock {
  OwningBlock() = default;
  OwningBlock(const OwningBlock& other) : words(other.words) {}
  OwningBlock& operator=(const OwningBlock& other) {
    words = other.words;
    return *this;
  }
  std::array<std::uint64_t, 64> words{};
};

}  // namespace mauve::testing::test_latest_value

MAUVE_TYPE(mauve::testing::test_latest_value::OwningBlock, "test_msgs/msg/OwningBlock", words)
MAUVE_TYPE(mauve::testing::test_latest_value::Block, "test_msgs/msg/Block", words)
MAUVE_TYPE(mauve::testing::test_latest_value::Pair, "test_msgs/msg/Pair", words)
MAUVE_TYPE(mauve::testing::test_latest_value::Owning, "test_msgs/msg/Owning", value)

namespace mauve::testing::test_latest_value {

template <typename T>
T filled(std::uint64_t number) {
  T block;
  block.words.fill(number);
  return block;
}

template <typename T>
bool is_whole(const T& block) {
  return std::all_of(block.words.begin(), block.words.end(),
                     [&](std::uint64_t word) { return word == block.words[0]; });
}

ErrorCode code_of(const std::function<void()>& call) {
  try {
    call();
  } catch (const Error& error) {
    return error.code();
  }
  ADD_FAILURE() << "nothing was refused";
  return ErrorCode::internal;
}

TEST(LatestValue, TakesOneWriter) {
  LatestValue<Number> latest;
  WritePort<Number> first("first");
  WritePort<Number> second("second");
  first.connect(latest.write, "latest");
  EXPECT_EQ(ErrorCode::invalid_argument, code_of([&] { second.connect(latest.write, "latest"); }));
  EXPECT_FALSE(second.is_connected());
  first.connect(latest.write, "latest");  // the same port again is no second writer
  first.disconnect();
  second.connect(latest.write, "latest");
  EXPECT_EQ(1U, latest.write.ports());
}

TEST(LatestValue, AnIncomingTopicIsItsWriter) {
  LatestValue<Number> latest;
  latest.bind_input();
  WritePort<Number> port("port");
  EXPECT_EQ(ErrorCode::invalid_argument, code_of([&] { port.connect(latest.write, "latest"); }));
  LatestValue<Number> taken;
  port.connect(taken.write, "taken");
  EXPECT_EQ(ErrorCode::invalid_argument, code_of([&] { taken.bind_input(); }));
  SharedData<Number> shared;
  port.connect(shared.write, "shared");
  shared.bind_input();  // any number of writers
}

TEST(LatestValue, TakesAsManyReadersAsDeclared) {
  EXPECT_THROW(LatestValue<Number>(0), Error);
  EXPECT_THROW(LatestValue<Number>(kMostReaders + 1), Error);
  LatestValue<Number> latest(2);
  TestShell a;
  TestShell b;
  TestShell c;
  a.input.connect(latest.read, "latest");
  b.input.connect(latest.read, "latest");
  EXPECT_EQ(ErrorCode::invalid_argument, code_of([&] { c.input.connect(latest.read, "latest"); }));
  b.input.disconnect();
  c.input.connect(latest.read, "latest");
}

TEST(LatestValue, AWriterNeverWaitsForReadersThatKeepOldValues) {
  constexpr int kReaders = 5;
  LatestValue<Number> latest(kReaders);
  TestShell writer;
  TestShell readers[kReaders];
  writer.output.connect(latest.write, "latest");
  for (TestShell& reader : readers) reader.input.connect(latest.read, "latest");
  for (int i = 0; i < kReaders; ++i) {  // each keeps another slot
    ASSERT_TRUE(writer.output.write({static_cast<double>(i)}));
    EXPECT_EQ(i, readers[i].input.read().value.value);
  }
  for (int i = 0; i < 1000; ++i) ASSERT_TRUE(writer.output.write({static_cast<double>(i)}));
  for (TestShell& reader : readers) EXPECT_EQ(999.0, reader.input.read().value.value);
}

TEST(SharedData, TakesReadersWhileItIsInUse) {
  constexpr int kReaders = 30;
  SharedData<Block> shared;
  WritePort<Block> writer("writer");
  writer.connect(shared.write, "shared");
  std::atomic<bool> done{false};
  std::atomic<std::uint64_t> written{0};
  std::thread hammer([&] {
    for (std::uint64_t number = 1; !done; ++number) {
      ASSERT_TRUE(writer.write(filled<Block>(number))) << "a slot is always free";
      written = number;
    }
  });
  std::vector<std::unique_ptr<ReadPort<Block>>> readers;
  for (int i = 0; i < kReaders; ++i) {
    readers.push_back(std::make_unique<ReadPort<Block>>("reader"));
    readers.back()->connect(shared.read, "shared");
    EXPECT_TRUE(readers.back()->service()->is_wait_free());
    for (const auto& reader : readers) {  // each keeps what it has read
      const std::uint64_t at_least = written;
      const Sample<Block> sample = reader->read();
      EXPECT_TRUE(is_whole(sample.value));
      EXPECT_GE(sample.value.words[0], at_least);
    }
  }
  done = true;
  hammer.join();
}

TEST(SharedData, TakesReadersWithoutAPort) {
  SharedData<Number> shared;
  EXPECT_TRUE(shared.write.write({1.0}, 10));
  for (int i = 0; i < 100; ++i) {  // with one slot lost a round, the third write would find none
    ReaderState passing;
    Number number;
    time_ns_t time_ns = 0;
    EXPECT_EQ(DataStatus::new_data, shared.read.read(number, time_ns, passing));
    EXPECT_EQ(DataStatus::old_data, shared.read.read(number, time_ns, passing));
    EXPECT_EQ(1.0 + i, number.value);
    EXPECT_EQ(10 + i, time_ns);
    EXPECT_TRUE(shared.write.write({2.0 + i}, 11 + i));
  }
}

TEST(SharedData, ALockIsForWritersAmongThemselves) {
  if (!has_process_barrier()) GTEST_SKIP() << "needs membarrier(2)";
  SharedData<Number> shared;
  WritePort<Number> first("first");
  WritePort<Number> second("second");
  ReadPort<Number> reader("reader");
  first.connect(shared.write, "shared");
  reader.connect(shared.read, "shared");
  EXPECT_TRUE(first.service()->is_wait_free());
  second.connect(shared.write, "shared");
  EXPECT_FALSE(first.service()->is_wait_free());
  EXPECT_TRUE(reader.service()->is_wait_free());
  first.disconnect();
  EXPECT_TRUE(second.service()->is_wait_free());
}

TEST(LatestValue, ADisconnectedReaderKeepsNothing) {
  LatestValue<Number> latest(1);
  TestShell writer;
  writer.output.connect(latest.write, "latest");
  for (int i = 0; i < 100; ++i) {  // with one slot lost a round, the third write would find none
    TestShell passing;
    passing.input.connect(latest.read, "latest");
    ASSERT_TRUE(writer.output.write({static_cast<double>(i)}));
    EXPECT_EQ(i, passing.input.read().value.value);
    passing.input.disconnect();
  }
}

TEST(LatestValue, MoreReadersThanDeclaredMakeAWriteRefuseAndTearNothing) {
  LatestRegister<Block> latest(1);
  const auto write = [&](std::uint64_t number) { return latest.write(filled<Block>(number), 0); };
  ReaderState readers[2];
  const auto read = [&](int reader) { return latest.sample({}, readers[reader]).value.words[0]; };
  ASSERT_TRUE(write(1));
  EXPECT_EQ(1U, read(0));
  ASSERT_TRUE(write(2));
  EXPECT_EQ(2U, read(1));
  ASSERT_TRUE(write(3));
  EXPECT_FALSE(write(4));
  latest.let_go(readers[0].held);
  EXPECT_TRUE(write(5));
  EXPECT_EQ(5U, read(1));
}

TEST(LatestValue, ItsSerializedFaceIsAReaderOfItsOwn) {
  LatestValue<Number> latest(1);
  TestShell shell;
  shell.output.connect(latest.write, "latest");
  shell.input.connect(latest.read, "latest");
  std::vector<std::byte> message;
  time_ns_t time_ns = 0;
  std::uint64_t seen = 0;
  EXPECT_FALSE(latest.next_sample(message, time_ns, seen));
  for (int i = 1; i <= 100; ++i) {
    ASSERT_TRUE(shell.output.write({static_cast<double>(i)}));
    EXPECT_EQ(i, shell.input.read().value.value);
    ASSERT_TRUE(latest.next_sample(message, time_ns, seen));
    Number number;
    ASSERT_TRUE(CdrReader(message).get(number));
    EXPECT_EQ(i, number.value);
    EXPECT_FALSE(latest.next_sample(message, time_ns, seen));
    std::uint64_t sequence = 0;
    EXPECT_TRUE(latest.peek_sample(message, time_ns, sequence));
    EXPECT_EQ(static_cast<std::uint64_t>(i), sequence);
  }
  EXPECT_TRUE(latest.write_sample(message, 7));
  EXPECT_FALSE(latest.write_sample({}, 8));
}

TEST(LatestValue, OfATypeThatCannotBeCopiedAsBytesIsRefused) {
  PluginRegistry registry;
  registry.type<Owning>();
  EXPECT_NE(nullptr, registry.make_resource("shared_data", "test_msgs/msg/Owning", {}));
  EXPECT_EQ(ErrorCode::type_mismatch,
            code_of([&] { registry.make_resource("latest_value", "test_msgs/msg/Owning", {}); }));
  EXPECT_EQ(ErrorCode::unknown_type, code_of([&] { registry.make_resource("latest_value", "a/msg/B", {}); }));
  registry.type<Number>();
  const auto resource = registry.make_resource("latest_value", "std_msgs/msg/Float64", {{"max_readers", 3}});
  EXPECT_EQ(3U, resource->find_service("read")->max_ports());
}

/// A value of a type, and the resource that holds it.
template <typename Value, typename Resource>
struct Kept {
  using Block = Value;
  static std::unique_ptr<Resource> make(std::uint32_t readers) {
    if constexpr (std::is_constructible_v<Resource, std::uint32_t>) {
      return std::make_unique<Resource>(readers);
    } else {
      return std::make_unique<Resource>();
    }
  }
};

template <typename T>
class LatestValueStress : public ::testing::Test {};
using Cases = ::testing::Types<Kept<Block, LatestValue<Block>>, Kept<Pair, LatestValue<Pair>>,
                               Kept<Block, SharedData<Block>>, Kept<Pair, SharedData<Pair>>,
                               Kept<OwningBlock, SharedData<OwningBlock>>>;
TYPED_TEST_SUITE(LatestValueStress, Cases, );

/// Readers of every kind against a writer that never rests: a value is whole, sequences never go back, and no read
/// finds less than was written, or found by anybody else, before it started.
TYPED_TEST(LatestValueStress, ReadersSeeWholeValuesInOrder) {
  using Block = TypeParam::Block;
  constexpr int kReaders = 3;
  constexpr std::uint64_t kReads = 20'000;
  constexpr std::uint64_t kChanges = 200;  // each reader sees the writer go on that often at least
  constexpr std::uint64_t kReadsInARow = 16;
  const auto owned = TypeParam::make(kReaders + 1);  // one more: a port that comes and goes
  auto& latest = *owned;
  WritePort<Block> writer("writer");
  writer.connect(latest.write, "latest");
  ASSERT_TRUE(writer.write(filled<Block>(1)));
  std::atomic<std::uint64_t> known{1};  // written, or found by a reader
  const auto know = [&](std::uint64_t number) {
    std::uint64_t before = known.load();
    while (before < number && !known.compare_exchange_weak(before, number)) {
    }
  };
  std::atomic<bool> done{false};
  std::atomic<std::uint64_t> torn{0};
  std::atomic<std::uint64_t> backwards{0};
  std::atomic<std::uint64_t> stale{0};
  std::thread hammer([&] {
    for (std::uint64_t number = 2; !done; ++number) {
      ASSERT_TRUE(writer.write(filled<Block>(number))) << "a slot is always free";
      know(number);
    }
  });
  const auto check = [&](const Block& block, std::uint64_t& last, std::uint64_t at_least) {
    if (!is_whole(block)) ++torn;
    if (block.words[0] < last) ++backwards;
    if (block.words[0] < at_least) ++stale;
    know(block.words[0]);
    const bool changed = block.words[0] != last;
    last = block.words[0];
    return changed;
  };
  std::vector<std::thread> readers;
  for (int i = 0; i < kReaders; ++i) {
    readers.emplace_back([&] {
      ReadPort<Block> port("port");
      port.connect(latest.read, "latest");
      auto block = std::make_unique<Block>();
      std::uint64_t last = 0;
      std::uint64_t changes = 0;
      for (std::uint64_t read = 0; read < kReads || changes < kChanges; ++read) {
        const std::uint64_t at_least = known.load();
        if (read % 2 == 0) {
          ASSERT_NE(DataStatus::none, port.read(*block));
        } else {
          *block = port.read().value;
        }
        if (check(*block, last, at_least)) ++changes;
        if (read % kReadsInARow == 0) std::this_thread::yield();  // where there are few CPUs
      }
      port.disconnect();
    });
  }
  readers.emplace_back([&] {
    std::uint64_t last = 0;
    for (std::uint64_t read = 0; read < kReads / 10; ++read) {
      ReadPort<Block> port("port");
      port.connect(latest.read, "latest");
      const std::uint64_t at_least = known.load();
      check(port.read().value, last, at_least);
      port.disconnect();
    }
  });
  readers.emplace_back([&] {
    std::vector<std::byte> message;
    time_ns_t time_ns = 0;
    std::uint64_t seen = 0;
    std::uint64_t last = 0;
    auto block = std::make_unique<Block>();
    for (std::uint64_t read = 0; read < kReads / 10; ++read) {
      const std::uint64_t before = seen;
      if (!latest.next_sample(message, time_ns, seen)) continue;
      if (seen <= before) ++backwards;
      ASSERT_TRUE(CdrReader(message).get(*block));
      check(*block, last, 0);
    }
  });
  for (std::thread& reader : readers) reader.join();
  done = true;
  hammer.join();
  EXPECT_EQ(0U, torn);
  EXPECT_EQ(0U, backwards);
  EXPECT_EQ(0U, stale);
}

/// The watchdog zeroes the output of a component that hangs in mid-write: two threads write, none is torn.
TYPED_TEST(LatestValueStress, ZerosBesideTheWriterTearNothing) {
  using Block = TypeParam::Block;
  const auto owned = TypeParam::make(1);
  auto& latest = *owned;
  WritePort<Block> writer("writer");
  ReadPort<Block> reader("reader");
  writer.connect(latest.write, "latest");
  reader.connect(latest.read, "latest");
  std::atomic<bool> done{false};
  std::thread component([&] {
    for (std::uint64_t number = 1; !done; ++number) writer.write(filled<Block>(number));
  });
  std::thread watchdog([&] {
    for (int i = 0; i < 5'000; ++i) writer.write_zero();
    done = true;
  });
  while (!done) ASSERT_TRUE(is_whole(reader.read().value));
  component.join();
  watchdog.join();
}

}  // namespace mauve::testing::test_latest_value
