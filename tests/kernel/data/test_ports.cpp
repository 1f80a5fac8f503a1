// SPDX-License-Identifier: LGPL-3.0-or-later
// Ports: status, age and time of what they read, their connections, and how these are exchanged.
#include "fixtures.hpp"

namespace mauve::testing::test_ports {

/// As another package has the same message.
struct OtherNumber {
  double value_m{};
};
/// As it had it in another version.
struct OldNumber {
  float value{};
};

}  // namespace mauve::testing::test_ports

MAUVE_TYPE(mauve::testing::test_ports::OtherNumber, "std_msgs/msg/Float64", value_m)
MAUVE_TYPE(mauve::testing::test_ports::OldNumber, "std_msgs/msg/Float64", value)

namespace mauve::testing::test_ports {

ErrorCode code_of(const std::function<void()>& call) {
  try {
    call();
  } catch (const Error& error) {
    EXPECT_FALSE(error.detail().remedy.empty()) << error.what();
    return error.code();
  }
  ADD_FAILURE() << "nothing was refused";
  return ErrorCode::internal;
}

/// A shell on a clock of the test's own, before the resources so that it sees them go.
struct PortsFixture : ::testing::Test {
  PortsFixture() { shell.set_context(&context); }
  void write_at(time_ns_t time_ns, double value) {
    context.clock_ns = time_ns;
    EXPECT_TRUE(shell.output.write({value}));
  }

  Context context;
  TestShell shell;
  TestShell second;
};

/// Refuses every value, and counts them.
struct Refusing final : OutputWatch {
  bool admits(const void* /*value*/) MAUVE_RT override {
    ++asked;
    return false;
  }
  int asked{0};
};

/// The end of a probation, in another thread, may come after the begin of the next one.
TEST_F(PortsFixture, ALaterWatchStaysWhereAnEarlierOneIsTakenAway) {
  SharedData<Number> resource;
  shell.output.connect(resource.write, "r");
  Refusing earlier;
  Refusing later;
  shell.output.watch(earlier);
  write_at(10, 1.0);
  shell.output.watch(later);
  shell.output.unwatch(earlier);
  write_at(20, 2.0);
  write_at(30, 3.0);
  EXPECT_EQ(1, earlier.asked);
  EXPECT_EQ(2, later.asked);
  shell.output.unwatch(later);
  write_at(40, 4.0);
  write_at(50, 5.0);
  EXPECT_EQ(2, later.asked);
  shell.input.connect(resource.read, "r");
  EXPECT_EQ(5.0, shell.input.read().value.value);
}

/// The same rules for every kind that keeps its value.
template <typename ResourceType>
struct KeepingResources : PortsFixture {
  ResourceType resource;
};
using Kinds = ::testing::Types<SharedData<Number>, LatestValue<Number>>;
TYPED_TEST_SUITE(KeepingResources, Kinds);

TYPED_TEST(KeepingResources, StatusIsPerPort) {
  this->shell.input.connect(this->resource.read, "r");
  this->second.input.connect(this->resource.read, "r");
  this->shell.output.connect(this->resource.write, "r");
  EXPECT_EQ(DataStatus::none, this->shell.input.read().status);
  EXPECT_EQ(7.0, this->shell.input.read().value.value) << "the port's default";
  this->write_at(10, 1.0);
  EXPECT_EQ(DataStatus::new_data, this->shell.input.read().status);
  EXPECT_EQ(DataStatus::old_data, this->shell.input.read().status);
  EXPECT_EQ(DataStatus::new_data, this->second.input.read().status);
  EXPECT_EQ(1.0, this->second.input.read().value.value);
}

TYPED_TEST(KeepingResources, StatusAndAgeStayWithThePortAfterTheRead) {
  this->shell.input.connect(this->resource.read, "r");
  this->shell.output.connect(this->resource.write, "r");
  EXPECT_EQ(DataStatus::none, this->shell.input.status());
  this->write_at(10, 1.0);
  EXPECT_EQ(DataStatus::none, this->shell.input.status()) << "nothing was read yet";
  this->context.clock_ns = 25;
  const Sample<Number> sample = this->shell.input.read();
  EXPECT_EQ(DataStatus::new_data, this->shell.input.status());
  EXPECT_EQ(15, this->shell.input.age_ns());
  EXPECT_EQ(15, sample.age_ns(25));
  this->context.clock_ns = 40;
  EXPECT_EQ(30, this->shell.input.age_ns());
  this->write_at(50, 2.0);
  EXPECT_EQ(40, this->shell.input.age_ns()) << "of what was read, not of what is there";
}

TYPED_TEST(KeepingResources, ReadingInPlaceIsTheSame) {
  this->shell.input.connect(this->resource.read, "r");
  this->shell.output.connect(this->resource.write, "r");
  Number place{3.0};
  time_ns_t time_ns = 0;
  EXPECT_EQ(DataStatus::none, this->shell.input.read(place, &time_ns));
  EXPECT_EQ(3.0, place.value);
  this->write_at(10, 1.0);
  EXPECT_EQ(DataStatus::new_data, this->shell.input.read(place, &time_ns));
  EXPECT_EQ(DataStatus::old_data, this->shell.input.read(place, &time_ns));
  EXPECT_EQ(1.0, place.value);
  EXPECT_EQ(10, time_ns);
}

TYPED_TEST(KeepingResources, AConnectionForgetsWhatTheLastOneSaw) {
  this->shell.input.connect(this->resource.read, "r");
  this->shell.output.connect(this->resource.write, "r");
  this->write_at(10, 1.0);
  EXPECT_EQ(DataStatus::new_data, this->shell.input.read().status);
  this->shell.input.disconnect();
  EXPECT_EQ(DataStatus::none, this->shell.input.status());
  EXPECT_EQ(0, this->shell.input.age_ns());
  EXPECT_EQ(7.0, this->shell.input.read().value.value);
  this->shell.input.connect(this->resource.read, "r");
  EXPECT_EQ(DataStatus::new_data, this->shell.input.read().status);
}

TEST_F(PortsFixture, UnconnectedPortsYieldTheDefaultOrDoNothing) {
  const Sample<Number> sample = shell.input.read();
  EXPECT_EQ(7.0, sample.value.value);
  EXPECT_EQ(DataStatus::none, sample.status);
  EXPECT_EQ(DataStatus::none, shell.input.status());
  EXPECT_EQ(0, shell.input.age_ns());
  Number place{3.0};
  EXPECT_EQ(DataStatus::none, shell.input.read(place));
  EXPECT_EQ(3.0, place.value);
  EXPECT_TRUE(shell.output.write({1.0}));
  shell.output.write_zero();
  EventPort event("event");
  event.raise();
  CallPort<void(int)> call("call", "p/Call");
  EXPECT_FALSE(call.is_connected());
  EXPECT_THROW(call(1), std::logic_error);
}

TEST_F(PortsFixture, WritersTimeIsTheLogicalClockOrTheRealOne) {
  SharedData<Number> shared;
  second.output.connect(shared.write, "shared");
  shell.input.connect(shared.read, "shared");
  shell.output.connect(shared.write, "shared");
  const time_ns_t before = monotonic_now_ns();
  second.output.write({1.0});
  EXPECT_GE(shell.input.read().time_ns, before) << "no component: the real clock";
  write_at(1234, 1.0);
  EXPECT_EQ(1234, shell.input.read().time_ns);
}

TEST_F(PortsFixture, AResourceKnowsWhatAStopHasWritten) {
  SharedData<Number> shared;
  Notifier written;
  Notifier stopped;
  shared.set_notifier(&written, &stopped);
  shell.output.connect(shared.write, "shared");
  write_at(1, 5.0);
  shell.output.write_zero(2);
  EXPECT_EQ(2U, written.word());
  EXPECT_EQ(0U, stopped.word());
  EXPECT_LT(shared.stop_ns(), 1) << "a commit's write is no stop's";
  shell.output.write_stopped(3);
  EXPECT_EQ(3, shared.stop_ns());
  EXPECT_EQ(1U, shared.stops());
  EXPECT_EQ(1U, stopped.word());
  shell.output.close();
  EXPECT_TRUE(shell.output.make_safe(true, 4));
  EXPECT_EQ(4, shared.stop_ns());
  EXPECT_EQ(2U, shared.stops());
}

TEST_F(PortsFixture, AClosedOutputSwallowsWrites) {
  SharedData<Number> shared;
  shell.input.connect(shared.read, "shared");
  shell.output.connect(shared.write, "shared");
  write_at(1, 5.0);
  shell.output.close();
  shell.output.write_zero();
  EXPECT_TRUE(shell.output.write({6.0}));
  EXPECT_EQ(0.0, shell.input.read().value.value);
  shell.output.reopen();
  write_at(2, 7.0);
  EXPECT_EQ(7.0, shell.input.read().value.value);
}

/// A resource whose write lets the watchdog close the port in mid-write.
TEST_F(PortsFixture, TheZerosStayLastWhenThePortIsClosedDuringAWrite) {
  struct ClosesItsWriter final : EventListener {
    explicit ClosesItsWriter(PortBase& port) : port_(port) {}
    void on_event(time_ns_t) noexcept override { port_.close(); }
    PortBase& port_;
  };
  SharedData<Number> shared;
  shell.input.connect(shared.read, "shared");
  shell.output.connect(shared.write, "shared");
  ClosesItsWriter closes(shell.output);
  shared.listen(closes);
  shell.output.write({5.0});
  EXPECT_EQ(0.0, shell.input.read().value.value);
}

TEST_F(PortsFixture, UnequalKindsAndTypesAreRefused) {
  SharedData<Number> shared;
  SharedData<EventCount> counts;
  EventCounter event;
  EXPECT_EQ(ErrorCode::type_mismatch, code_of([&] { shell.input.connect(counts.read, "r"); }));
  EXPECT_EQ(ErrorCode::type_mismatch, code_of([&] { shell.input.connect(shared.write, "r"); }));
  EXPECT_EQ(ErrorCode::type_mismatch, code_of([&] { shell.output.connect(event.raise, "r"); }));
  EXPECT_FALSE(shell.input.is_connected());
  EXPECT_EQ(0U, shared.read.ports());
}

TEST_F(PortsFixture, ATypeIsItsNameAndItsLayout) {
  SharedData<OtherNumber> equal;
  shell.input.connect(equal.read, "r");
  shell.output.connect(equal.write, "r");
  ASSERT_TRUE(shell.output.write({3.5}));
  EXPECT_EQ(3.5, shell.input.read().value.value);
  shell.output.disconnect();

  SharedData<OldNumber> other;
  ASSERT_EQ(shell.input.type(), other.read.type());
  EXPECT_EQ(ErrorCode::type_mismatch, code_of([&] { shell.input.connect(other.read, "r"); }));
  EXPECT_EQ(ErrorCode::type_mismatch, code_of([&] { shell.output.connect(other.write, "r"); }));
  EXPECT_FALSE(shell.output.is_connected());

  struct Doubles final : CallService<double(double)> {
    Doubles() : CallService("double", "p/Call") {}
    double call(double value) override { return 2 * value; }
  };
  Doubles doubles;
  CallPort<float(float)> narrow("narrow", "p/Call");
  EXPECT_EQ(ErrorCode::type_mismatch, code_of([&] { narrow.connect(doubles, "r"); }));
  CallPort<double(double)> wide("wide", "p/Call");
  wide.connect(doubles, "r");
  EXPECT_EQ(4.0, wide(2.0));
}

TEST_F(PortsFixture, APreparedConnectionChangesNothingUntilItIsSwappedIn) {
  SharedData<Number> first;
  SharedData<Number> other;
  shell.output.connect(first.write, "first");
  PortConnection connection = shell.output.prepare(other.write, "other");
  EXPECT_EQ("first", shell.output.resource_name());
  EXPECT_EQ(0U, other.write.ports());

  shell.output.swap(connection);
  EXPECT_EQ(&other.write, shell.output.service());
  EXPECT_EQ("other", shell.output.connected_to().resource);
  EXPECT_EQ("write", shell.output.connected_to().service);
  EXPECT_EQ(1U, other.write.ports());
  EXPECT_EQ(0U, first.write.ports());

  shell.output.swap(connection);  // what came out goes back in: how a transaction would be undone
  EXPECT_EQ("first", shell.output.connected_to().resource);
  PortConnection none;
  shell.output.swap(none);
  EXPECT_FALSE(shell.output.is_connected());
  EXPECT_EQ("", shell.output.connected_to().service);
  EXPECT_EQ("first", none.resource);
}

TEST_F(PortsFixture, AConnectionIsDescribedWhileItIsSwapped) {
  SharedData<Number> first;
  SharedData<Number> other;
  const std::string long_name(50, 'x');
  PortConnection spare = shell.output.prepare(other.write, long_name);
  shell.output.connect(first.write, "first");
  std::atomic<bool> done{false};
  std::thread describer([&] {
    while (!done) {
      const ConnectedTo shown = shell.output.connected_to();
      ASSERT_TRUE(shown.resource == "first" || shown.resource == long_name) << shown.resource;
    }
  });
  for (int i = 0; i < 10'000; ++i) shell.output.swap(spare);
  done = true;
  describer.join();
}

TEST(PortFactories, MakePortsOfRegisteredTypes) {
  PluginRegistry registry;
  registry.type<Number>();
  const auto input = registry.make_port(PortKind::read, "std_msgs/msg/Float64", "in");
  const auto output =
      registry.make_port(PortKind::write, "std_msgs/msg/Float64", "out", {.on_stop = OutputPolicy::hold});
  const auto event = registry.make_port(PortKind::event, "", "event");
  const auto count = registry.make_port(PortKind::read, "std_msgs/msg/UInt64", "count");
  EXPECT_EQ(OutputPolicy::hold, output->output().on_stop);
  EXPECT_EQ("in", input->name());
  const auto shared = registry.make_resource("latest_value", "std_msgs/msg/Float64", {});
  input->connect(*shared->find_service("read"), "shared");
  output->connect(*shared->find_service("write"), "shared");
  const auto counter = registry.make_resource("event", "", {});
  event->connect(*counter->find_service("raise"), "counter");
  count->connect(*counter->find_service("read"), "counter");

  std::vector<std::byte> message;
  CdrWriter(message).put(Number{4.0});
  EXPECT_TRUE(output->write_serialized(message));
  DataStatus status{};
  time_ns_t time_ns = 0;
  std::vector<std::byte> back;
  EXPECT_TRUE(input->read_serialized(back, status, time_ns));
  EXPECT_EQ(message, back);
  EXPECT_EQ(DataStatus::new_data, status);

  EXPECT_EQ(ErrorCode::unknown_type, code_of([&] { registry.make_port(PortKind::read, "a/msg/B", "p"); }));
  EXPECT_EQ(ErrorCode::invalid_argument, code_of([&] { registry.make_port(PortKind::call, "a/B", "p"); }));
  EXPECT_EQ(ErrorCode::invalid_argument, code_of([&] { registry.make_port(PortKind::event, "a/B", "p"); }));
}

}  // namespace mauve::testing::test_ports
