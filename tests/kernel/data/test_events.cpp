// SPDX-License-Identifier: LGPL-3.0-or-later
// Events: the counter that ports raise, and listeners that every write tells.
#include "fixtures.hpp"

namespace mauve::testing::test_events {

struct Recorder final : EventListener {
  void on_event(time_ns_t time_ns) noexcept override {
    last_ns.store(time_ns);
    calls.fetch_add(1);
  }
  std::atomic<int> calls{0};
  std::atomic<time_ns_t> last_ns{0};
};

struct EventsFixture : ::testing::Test {
  EventsFixture() { port.set_context(&context); }
  void raise_at(time_ns_t time_ns) {
    context.clock_ns = time_ns;
    port.raise();
  }
  Context context;
  EventPort port{"happened"};
  EventCounter event;
};

TEST_F(EventsFixture, RaisesAreCountedWithTheTimeOfTheLast) {
  ReadPort<EventCount> count("count");
  count.connect(event.read, "event");
  port.connect(event.raise, "event");
  EXPECT_EQ(DataStatus::none, count.read().status);
  raise_at(10);
  raise_at(20);
  const Sample<EventCount> sample = count.read();
  EXPECT_EQ(2U, sample.value.data);
  EXPECT_EQ(20, sample.time_ns);
  EXPECT_EQ(DataStatus::new_data, sample.status);
  EXPECT_EQ(DataStatus::old_data, count.read().status);
  port.close();
  raise_at(30);
  EXPECT_EQ(2U, count.read().value.data);
}

TEST(EventMessages, EmptySaysEveryRaiseAndEveryMessageRaises) {
  EventCounter event(EventMessage::empty);
  EXPECT_EQ("std_msgs/msg/Empty", event.type());
  std::vector<std::byte> message;
  time_ns_t time_ns = 0;
  std::uint64_t seen = 0;
  EXPECT_FALSE(event.next_sample(message, time_ns, seen));
  event.raise.raise(10);
  event.raise.raise(20);
  ASSERT_TRUE(event.next_sample(message, time_ns, seen));
  ASSERT_TRUE(event.next_sample(message, time_ns, seen));
  EXPECT_FALSE(event.next_sample(message, time_ns, seen));
  EXPECT_TRUE(event.write_sample(message, 30));
  EXPECT_TRUE(event.write_sample(kCdrHeader, 30));  // some send no byte for a message without members
  EXPECT_FALSE(event.write_sample({}, 30));
  ASSERT_TRUE(event.next_sample(message, time_ns, seen));
  ASSERT_TRUE(event.next_sample(message, time_ns, seen));
  EXPECT_FALSE(event.next_sample(message, time_ns, seen));
}

TEST(EventMessages, BoolSaysTrueAndAFalseOneRaisesNothing) {
  EventCounter event(EventMessage::truth);
  EXPECT_EQ("std_msgs/msg/Bool", event.type());
  std::vector<std::byte> message;
  CdrWriter(message).put(std::uint8_t{0});
  EXPECT_TRUE(event.write_sample(message, 10));
  time_ns_t time_ns = 0;
  std::uint64_t seen = 0;
  EXPECT_FALSE(event.next_sample(message, time_ns, seen));
  event.raise.raise(20);
  ASSERT_TRUE(event.next_sample(message, time_ns, seen));
  std::uint8_t truth = 0;
  EXPECT_TRUE(CdrReader(message).get(truth));
  EXPECT_EQ(1, truth);
  EXPECT_TRUE(event.write_sample(message, 30));
  EXPECT_TRUE(event.next_sample(message, time_ns, seen));
  EXPECT_FALSE(event.write_sample(kCdrHeader, 30));
}

TEST_F(EventsFixture, ATopicCarriesTheCountAndAMessageRaises) {
  port.connect(event.raise, "event");
  std::vector<std::byte> message;
  time_ns_t time_ns = 0;
  std::uint64_t seen = 0;
  EXPECT_EQ("std_msgs/msg/UInt64", event.type());
  EXPECT_FALSE(event.next_sample(message, time_ns, seen));
  raise_at(10);
  ASSERT_TRUE(event.next_sample(message, time_ns, seen));
  EXPECT_EQ(10, time_ns);
  EXPECT_FALSE(event.next_sample(message, time_ns, seen));
  EXPECT_TRUE(event.write_sample(message, 1));
  EXPECT_FALSE(event.write_sample({}, 1));
  std::uint64_t sequence = 0;
  EXPECT_TRUE(event.peek_sample(message, time_ns, sequence));
  EXPECT_EQ(2U, sequence);
}

TEST_F(EventsFixture, EveryKindTellsItsListenersOfWritesThatSucceeded) {
  SharedData<Number> shared;
  LatestValue<Number> latest;
  RingBuffer<Number> ring(1);
  const std::vector<Resource*> resources{&shared, &latest, &ring, &event};
  std::vector<Recorder> recorders(resources.size());
  for (std::size_t i = 0; i < resources.size(); ++i) resources[i]->listen(recorders[i]);
  shared.write.write({1.0}, 11);
  latest.write.write({1.0}, 12);
  EXPECT_TRUE(ring.write.write({1.0}, 13));
  EXPECT_FALSE(ring.write.write({1.0}, 99));
  event.raise.raise(14);
  for (int i = 0; i < 4; ++i) {
    EXPECT_EQ(1, recorders[static_cast<std::size_t>(i)].calls)
        << resources[static_cast<std::size_t>(i)]->kind();
    EXPECT_EQ(11 + i, recorders[static_cast<std::size_t>(i)].last_ns);
  }
  std::vector<std::byte> message;
  CdrWriter(message).put(Number{});
  EXPECT_TRUE(shared.write_sample(message, 1));
  EXPECT_EQ(2, recorders[0].calls);
  EXPECT_FALSE(shared.write_sample({}, 1));
  EXPECT_EQ(2, recorders[0].calls);
}

TEST_F(EventsFixture, TheDataIsInPlaceAndUnlockedWhenAListenerIsCalled) {
  struct ReadsBack final : EventListener {
    explicit ReadsBack(SharedData<Number>& shared) { input.connect(shared.read, "shared"); }
    void on_event(time_ns_t) noexcept override { found = input.read().value.value; }
    ReadPort<Number> input{"input"};
    double found{0.0};
  };
  SharedData<Number> shared;
  ReadsBack reads_back(shared);
  shared.listen(reads_back);
  shared.write.write({5.0}, 1);
  EXPECT_EQ(5.0, reads_back.found);
}

TEST_F(EventsFixture, AListenerIsCalledOncePerRegistration) {
  Recorder recorder;
  event.listen(recorder);
  event.listen(recorder);
  event.raise.raise(1);
  EXPECT_EQ(2, recorder.calls);
  event.unlisten(recorder);
  event.raise.raise(2);
  EXPECT_EQ(3, recorder.calls);
  event.unlisten(recorder);
  event.unlisten(recorder);  // once too often does nothing
  event.raise.raise(3);
  EXPECT_EQ(3, recorder.calls);
}

TEST_F(EventsFixture, TooManyListenersAreRefusedByName) {
  event.set_name("bumped");
  std::vector<Recorder> recorders(EventListeners::kCapacity + 1);
  for (std::size_t i = 0; i < EventListeners::kCapacity; ++i) event.listen(recorders[i]);
  try {
    event.listen(recorders.back());
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(ErrorCode::out_of_range, error.code());
    EXPECT_EQ("resource bumped", error.detail().element);
    EXPECT_EQ("at most 1024 listeners", error.detail().expected);
    EXPECT_EQ("1025", error.detail().found);
  }
  event.unlisten(recorders.front());
  event.listen(recorders.back());
  event.raise.raise(1);
  EXPECT_EQ(0, recorders.front().calls);
  EXPECT_EQ(1, recorders.back().calls);
}

TEST_F(EventsFixture, HundredsListenAndAreCalledInTheirOrder) {
  struct Ordered final : EventListener {
    void on_event(time_ns_t) noexcept override { order->push_back(number); }
    std::vector<int>* order{nullptr};
    int number{0};
  };
  std::vector<int> order;
  std::vector<Ordered> all(300);
  for (int i = 0; i < 300; ++i) {
    Ordered& each = all[static_cast<std::size_t>(i)];
    each.order = &order;
    each.number = i;
    event.listen(each);
  }
  for (const std::size_t gone : {0U, 150U, 299U}) event.unlisten(all[gone]);
  event.relisten(all[1], all[0]);
  event.raise.raise(1);
  ASSERT_EQ(297U, order.size());
  EXPECT_EQ(0, order.front()) << "in the place of 1";
  EXPECT_TRUE(std::is_sorted(order.begin(), order.end()));
}

/// Listeners come and go, and end, while a writer hammers: none is called after its end.
TEST_F(EventsFixture, ListenersMayEndOnceTheyAreTakenAway) {
  struct Mortal final : EventListener {
    ~Mortal() override { alive = false; }
    void on_event(time_ns_t) noexcept override {
      EXPECT_TRUE(alive);
      calls.fetch_add(1);
    }
    bool alive{true};
    std::atomic<int> calls{0};
  };
  std::atomic<bool> done{false};
  std::thread writer([&] {
    while (!done) event.raise.raise(1);
  });
  const auto come_and_go = [&] {
    for (int i = 0; i < 100; ++i) {
      auto mortal = std::make_unique<Mortal>();
      event.listen(*mortal);
      Backoff backoff;
      while (mortal->calls == 0) backoff();
      event.unlisten(*mortal);
    }
  };
  std::thread first(come_and_go);
  std::thread second(come_and_go);
  first.join();
  second.join();
  done = true;
  writer.join();
  Recorder last;
  event.listen(last);  // there is room: all were taken away
  event.raise.raise(1);
  EXPECT_EQ(1, last.calls);
}

}  // namespace mauve::testing::test_events
