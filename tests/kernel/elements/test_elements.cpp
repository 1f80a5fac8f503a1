// SPDX-License-Identifier: LGPL-3.0-or-later
// Common shells, relay and multiplexers, each run as a component.
#include "fixtures.hpp"

namespace mauve::testing::test_elements {

using types::Float64;

/// An element with the resources in0, in1, ... and out at its ports, written and read by the test.
class Elements : public Deployed {
 protected:
  template <typename CoreType>
  void add_element(std::initializer_list<const char*> inputs) {
    using ShellType = typename CoreType::shell_type;
    element_ = &architecture.add_component<ShellType, CoreType, PeriodicUpdateFsm<ShellType>>("element");
    element_->set_property("period_us", std::int64_t{1000});
    for (const char* port : inputs) {
      const std::string name = "in" + std::to_string(inputs_.size());
      inputs_.push_back(&architecture.add_resource<SharedData<Float64>>(name));
      architecture.connect("element", port, name, "read");
    }
    output_ = &architecture.add_resource<SharedData<Float64>>("out");
    architecture.connect("element", "output", "out", "write");
  }
  /// Writes to an input a sample that is so old, or a future one.
  void write(std::size_t input, double value, time_ns_t age_ns = 0) {
    inputs_[input]->write.write({value}, monotonic_now_ns() - age_ns);
  }
  /// The value in the output, and how many were written.
  std::pair<double, std::uint64_t> output() {
    Float64 value;
    time_ns_t time_ns = 0;
    ReaderState seen;
    output_->read.read(value, time_ns, seen);
    return {value.data, seen.seen};
  }
  std::uint64_t written() { return output().second; }
  void wait_output(double value) {
    wait_until([&] { return output().first == value; }, "the element's output");
  }
  /// Lets the element update at least twice, from begin to end.
  void wait_updates() {
    const auto& releases = element_->task().statistics().releases;
    const std::uint64_t before = releases.load();
    wait_until([&] { return releases.load() >= before + 3; }, "the element to run");
  }

  static constexpr time_ns_t kLong = s_to_ns(3600);

  Component* element_{nullptr};

 private:
  std::vector<SharedData<Float64>*> inputs_;
  SharedData<Float64>* output_{nullptr};
};

using Relay = RelayCore<Float64>;
using Multiplexer = MultiplexerCore<Float64, 2>;
using PriorityMultiplexer = PriorityMultiplexerCore<Float64, 3>;

struct Half : UpdateCore<FilterShell<Float64>> {
  void update() override { shell().output.write({0.5 * shell().input.read().value.data}); }
};

TEST_F(Elements, AFilterIsOneMethod) {
  add_element<Half>({"input"});
  deploy();
  EXPECT_EQ(ms_to_ns(1), element_->fsm().period_ns());
  write(0, 3.0);
  wait_output(1.5);
}

struct Ramp : UpdateCore<SourceShell<Float64>> {
  double level{0.0};
  void update() override { shell().output.write({++level}); }
};
struct Keep : UpdateCore<SinkShell<Float64>> {
  std::atomic<double> kept{0.0};
  void update() override { kept.store(shell().input.read().value.data); }
};

TEST_F(Elements, ASourceFeedsASink) {
  architecture.add_component<SourceShell<Float64>, Ramp, PeriodicUpdateFsm<SourceShell<Float64>>>("source");
  auto& sink =
      architecture.add_component<SinkShell<Float64>, Keep, PeriodicUpdateFsm<SinkShell<Float64>>>("sink");
  architecture.add_resource<SharedData<Float64>>("level");
  architecture.connect("source", "output", "level", "write");
  architecture.connect("sink", "input", "level", "read");
  deploy();
  wait_until([&] { return sink.core_as<Keep>().kept.load() >= 3.0; }, "the level to rise");
}

TEST_F(Elements, ARelayWritesWhatIsNewOnce) {
  add_element<Relay>({"input"});
  deploy();
  wait_updates();
  EXPECT_EQ(0U, written());
  write(0, 1.0);
  wait_output(1.0);
  wait_updates();
  EXPECT_EQ(1U, written());
  write(0, 2.0, kLong);
  wait_output(2.0);  // of any age, without a limit
}

TEST_F(Elements, ARelayWritesInEachPeriodWhenToldSo) {
  add_element<Relay>({"input"});
  element_->set_property("only_new", false);
  deploy();
  write(0, 1.0);
  wait_until([&] { return written() >= 4; }, "the value to be repeated");
  EXPECT_EQ(1.0, output().first);
}

TEST_F(Elements, ARelayWritesTheDefaultOnceWhenItsInputIsTooOld) {
  add_element<Relay>({"input"});
  element_->set_property("max_age_ms", std::int64_t{60'000});
  deploy();
  write(0, 1.0, kLong);
  wait_updates();
  EXPECT_EQ(0U, written());  // nothing was passed that would have to be taken back
  write(0, 2.0);
  wait_output(2.0);
  write(0, 3.0, kLong);
  wait_output(0.0);
  wait_updates();
  EXPECT_EQ(2U, written());
  // The limit is raised in flight: the old sample counts again.
  deployer.set_property("element", "max_age_ms", std::int64_t{0});
  wait_output(3.0);
}

TEST_F(Elements, AMultiplexerPassesTheInputThatIsSelectedInFlight) {
  add_element<Multiplexer>({"input_0", "input_1"});
  deploy();
  write(0, 10.0);
  wait_output(10.0);
  write(1, 20.0);
  wait_updates();
  EXPECT_EQ(10.0, output().first);
  deployer.set_property("element", "select", std::int64_t{1});
  wait_output(20.0);
  write(0, 11.0);
  wait_updates();
  EXPECT_EQ(20.0, output().first);
  deployer.set_property("element", "select", std::int64_t{0});
  wait_output(11.0);
  EXPECT_EQ(3U, written());
  EXPECT_THROW(deployer.set_property("element", "select", std::int64_t{2}), Error);
  EXPECT_THROW(deployer.set_property("element", "select", std::int64_t{-1}), Error);
}

TEST_F(Elements, AMultiplexerLeavesNothingOfTheInputBefore) {
  add_element<Multiplexer>({"input_0"});  // input_1 is not even connected
  deploy();
  write(0, 10.0);
  wait_output(10.0);
  deployer.set_property("element", "select", std::int64_t{1});
  wait_output(0.0);
}

TEST_F(Elements, APriorityMultiplexerPassesTheFirstThatIsFresh) {
  add_element<PriorityMultiplexer>({"input_0", "input_1", "input_2"});
  for (int i = 0; i < 3; ++i)
    element_->set_property("max_age_" + std::to_string(i) + "_ms", std::int64_t{60'000});
  deploy();
  write(2, 30.0);
  wait_output(30.0);
  write(1, 20.0);
  wait_output(20.0);
  write(0, 10.0);
  wait_output(10.0);
  write(1, 21.0);
  wait_updates();
  EXPECT_EQ(10.0, output().first);
  write(0, 11.0, kLong);
  wait_output(21.0);
  write(1, 22.0, kLong);
  wait_output(30.0);
  write(2, 31.0, kLong);
  wait_output(0.0);
  // Which input was passed, and when, is in the trace.
  deployer.shutdown();
  std::vector<std::int64_t> chosen;
  for (const TraceRecord& record : records_of(deployer.drain_trace(), TraceKind::mark))
    chosen.push_back(record.a);
  EXPECT_THAT(chosen, ::testing::ElementsAre(2, 1, 0, 1, 2, -1));
}

TEST_F(Elements, AnAgeLimitIsPerInput) {
  add_element<PriorityMultiplexer>({"input_0", "input_1"});
  element_->set_property("max_age_0_ms", std::int64_t{60'000});
  element_->set_property("max_age_1_ms", std::int64_t{0});
  deploy();
  write(0, 10.0, kLong);
  write(1, 20.0, kLong);
  wait_output(20.0);
}

TEST_F(Elements, AReplacedCoreGoesOnWithoutWritingAgain) {
  add_element<Relay>({"input"});
  deploy();
  write(0, 1.0);
  wait_output(1.0);
  element_->swap_core(std::make_unique<Relay>());
  wait_updates();
  EXPECT_EQ(1U, written());
  write(0, 2.0);
  wait_output(2.0);
}

struct Fixed : UpdateCore<RelayShell<Float64>> {
  void update() override { shell().output.write({5.0}); }
};

TEST_F(Elements, ARelayTakesBackWhatAnotherCoreLeft) {
  add_element<Fixed>({"input"});
  deploy();
  wait_output(5.0);
  element_->swap_core(std::make_unique<Relay>());
  wait_output(0.0);
  element_->swap_core(std::make_unique<Fixed>());
  wait_output(5.0);
}

TEST_F(Elements, ARelayEmptiesARingOneByOne) {
  add_element<Relay>({});
  auto& ring = architecture.add_resource<RingBuffer<Float64>>("ring", std::size_t{4}, WhenFull::refuse);
  architecture.connect("element", "input", "ring", "read");
  deploy();
  for (const double value : {1.0, 2.0, 3.0}) ring.write.write({value}, monotonic_now_ns());
  wait_output(3.0);
  wait_updates();
  EXPECT_EQ(3U, written());
}

}  // namespace mauve::testing::test_elements
