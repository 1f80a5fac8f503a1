// SPDX-License-Identifier: LGPL-3.0-or-later
// max_slew of a component: an output moves no faster over changes of core and shell, reverts, stops and starts.
#include <cmath>

#include "probation_fixtures.hpp"

namespace mauve::testing::test_max_slew {

using ::testing::HasSubstr;

constexpr double kSlew = 100.0;  // 0.1 a release

struct Written {
  double value;
  time_ns_t time_ns;
};

/// Writes this target at each release.
struct TargetCore : TestCore {
  explicit TargetCore(double first = 0.0) : target(first) {}
  void act() override {
    if (writes) exposed_shell().output.write({target.load()});
    TestCore::act();
  }
  std::atomic<double> target;
  std::atomic<bool> writes{true};
};

template <typename Way>
class MaxSlew : public OnBothHosts<Way> {
 protected:
  Component& add_slewed(const std::string& name = "c") {
    Component& component =
        this->architecture.template add_component<TestShell, TargetCore, TestFsm>(name, settings());
    sink = &this->architecture.template add_resource<RingBuffer<Number>>("sink_" + name, 1'000'000);
    this->architecture.connect(name, "output", "sink_" + name, "write");
    return component;
  }
  static TaskSettings settings() { return {.max_slew = {{"output.value", kSlew}}}; }
  static TargetCore& core(Component& component) { return component.core_as<TargetCore>(); }
  static SlewRecord record(Component& component) { return component.slews().at(0); }
  static bool is_executing(Component& component) {
    return component.task().state() == ComponentState::running;
  }
  /// All values since the last call, with their times.
  void collect() {
    Number value;
    time_ns_t time_ns = 0;
    while (sink->read.read(value, time_ns, reader) == DataStatus::new_data)
      all.push_back({value.value, time_ns});
  }
  double newest() {
    collect();
    return all.empty() ? kNan : all.back().value;
  }
  /// Lets the component write a value that is far from the first one.
  void wait_value(double value) {
    this->host.until([&] { return std::abs(newest() - value) < 1e-9; }, "the output to come there");
  }
  void run_up(Component& component, double value = 1.0) {
    this->host.until([&] { return !std::isnan(newest()); }, "the first value");
    core(component).target = value;
    wait_value(value);
  }
  /// Steps that are longer than allowed.
  int jumps() {
    collect();
    int found = 0;
    for (std::size_t i = 1; i < all.size(); ++i) {
      const double step = kSlew * static_cast<double>(all[i].time_ns - all[i - 1].time_ns) / 1e9;
      found += std::abs(all[i].value - all[i - 1].value) > std::max(0.0, step) * (1 + 1e-12) + 1e-15 ? 1 : 0;
    }
    return found;
  }
  void stop_by_force() { (*this->host).stop("c", StopOptions{.timeout_ns = s_to_ns(10), .force = true}); }

  RingBuffer<Number>* sink{nullptr};
  ReaderState reader;
  std::vector<Written> all;
};
TYPED_TEST_SUITE(MaxSlew, EveryHost, HostNames);

TYPED_TEST(MaxSlew, ACoreMovesItsOutputNoFaster) {
  Component& component = this->add_slewed();
  this->deploy();
  this->run_up(component);
  EXPECT_EQ(0, this->jumps());
  EXPECT_GE(this->record(component).limited, 5U) << "a busy machine may make it skip some";
  EXPECT_EQ(0U, this->record(component).not_limited);
  EXPECT_EQ("output.value", this->record(component).output);
  EXPECT_EQ(kSlew, this->record(component).max_slew);
}

TYPED_TEST(MaxSlew, AReplacedCoreGoesOnFromTheLastValue) {
  Component& component = this->add_slewed();
  this->deploy();
  this->run_up(component);
  Transaction change;
  change.replace_core("c", std::make_unique<TargetCore>(-1.0));
  this->host.commit(std::move(change));
  this->wait_value(-1.0);
  EXPECT_EQ(0, this->jumps());
}

TYPED_TEST(MaxSlew, ARevertedCoreGoesOnFromTheLastValue) {
  Component& component = this->add_slewed();
  this->deploy();
  this->run_up(component);
  Transaction change;
  change.replace_core("c", std::make_unique<TargetCore>(-1.0), ProbationOptions{.duration_ns = kLong});
  this->host.commit(std::move(change));
  this->wait_value(-1.0);
  EXPECT_TRUE(component.revert_probation("a test", s_to_ns(30)));
  this->wait_value(1.0);
  EXPECT_EQ(0, this->jumps());
}

TYPED_TEST(MaxSlew, AnotherShellGoesOnFromTheLastValue) {
  Component& component = this->add_slewed();
  this->deploy();
  this->run_up(component);
  Transaction change;
  change.replace_shell("c", std::make_unique<TestShell>())
      .replace_core("c", std::make_unique<TargetCore>(-1.0));
  this->host.commit(std::move(change));
  this->wait_value(-1.0);
  EXPECT_EQ(0, this->jumps());
}

/// A shell without such a number.
struct OtherShell : Shell {
  WritePort<Number>& other = write_port<Number>("other").optional();
};

TYPED_TEST(MaxSlew, AShellWithoutTheNumberIsRefused) {
  Component& component = this->add_slewed();
  this->deploy();
  std::string text;
  Transaction change;
  change.replace_shell("c", std::make_unique<OtherShell>());
  const ErrorCode code = this->code_of([&] { this->host.commit(std::move(change)); }, &text);
  EXPECT_EQ(ErrorCode::unknown_port, code) << text;
  this->run_up(component);
}

TYPED_TEST(MaxSlew, AStopMovesTheOutputToItsZero) {
  Component& component = this->add_slewed();
  this->deploy();
  this->run_up(component);
  const std::uint64_t releases = component.task().statistics().releases;
  this->host.stop("c");
  if constexpr (TestFixture::is_virtual) {
    EXPECT_EQ(ComponentState::stopping, component.task().state()) << "no instant has come yet";
    EXPECT_EQ(releases, component.task().statistics().releases);
  }
  this->wait_state(component, ComponentState::stopped);
  EXPECT_EQ(0.0, this->newest());
  EXPECT_EQ(0, this->jumps());
  EXPECT_EQ(0U, this->record(component).not_limited);
  if constexpr (TestFixture::is_virtual) {
    EXPECT_EQ(releases, component.task().statistics().releases);
  }
}

TYPED_TEST(MaxSlew, AStopBeginsWithOneStepHoweverLongNothingWasWritten) {
  Component& component = this->add_slewed();
  this->deploy();
  this->run_up(component);
  this->core(component).writes = false;
  const int runs = this->core(component).runs;
  this->wait_runs(component, runs + 50);
  this->collect();
  const std::size_t before = this->all.size();
  this->host.stop("c");
  this->wait_state(component, ComponentState::stopped);
  EXPECT_EQ(0.0, this->newest());
  ASSERT_GT(this->all.size(), before);
  EXPECT_DOUBLE_EQ(0.9, this->all[before].value);
  EXPECT_EQ(0U, this->record(component).not_limited);
}

TYPED_TEST(MaxSlew, AStartGoesOnFromTheZeroHoweverLongItWasStopped) {
  Component& component = this->add_slewed();
  this->deploy();
  this->run_up(component);
  this->host.stop("c");
  this->wait_state(component, ComponentState::stopped);
  this->collect();
  const std::size_t before = this->all.size();
  const time_ns_t until_ns = this->host.now_ns() + ms_to_ns(50);
  this->host.until([&] { return this->host.now_ns() >= until_ns; }, "the time");
  this->host.start("c");
  this->wait_value(1.0);
  ASSERT_GT(this->all.size(), before);
  EXPECT_LE(this->all[before].value, kSlew / 1e3 * (1 + 1e-12)) << "as in any release";
  EXPECT_EQ(0, this->jumps());
}

TYPED_TEST(MaxSlew, AStopByForceWritesTheZeroAtOnce) {
  Component& component = this->add_slewed();
  this->deploy();
  this->run_up(component);
  this->stop_by_force();
  EXPECT_EQ(ComponentState::stopped, component.task().state());
  EXPECT_EQ(0.0, this->newest());
  EXPECT_EQ(1U, this->record(component).not_limited);
}

TYPED_TEST(MaxSlew, AStopByForceEndsARamp) {
  Component& component = this->add_slewed();
  this->deploy();
  this->run_up(component, 100.0);
  std::string text;
  const auto stop = [&] { (*this->host).stop("c", 0); };
  if constexpr (TestFixture::is_virtual) {
    stop();
  } else {
    EXPECT_EQ(ErrorCode::timeout, this->code_of(stop, &text));
  }
  EXPECT_EQ(ComponentState::stopping, component.task().state());
  Transaction change;
  change.replace_core("c", std::make_unique<TargetCore>());
  this->code_of([&] { this->host.commit(std::move(change)); }, &text);
  EXPECT_THAT(text, HasSubstr("STOPPING"));
  this->stop_by_force();
  EXPECT_EQ(ComponentState::stopped, component.task().state());
  EXPECT_EQ(0.0, this->newest());
  EXPECT_EQ(1U, this->record(component).not_limited);
  this->host.start("c");
  this->host.until([&] { return this->newest() > 1.0; }, "the output to go on");
}

TYPED_TEST(MaxSlew, AFaultWritesTheZeroAtOnce) {
  Component& component = this->add_slewed();
  std::atomic<bool> fails{false};
  this->core(component).work = [&] {
    if (fails) throw std::runtime_error("it fails");
  };
  this->deploy();
  this->run_up(component);
  fails = true;
  this->wait_state(component, ComponentState::faulted);
  EXPECT_EQ(0.0, this->newest());
  EXPECT_EQ(1U, this->record(component).not_limited);
}

TYPED_TEST(MaxSlew, AStopInATransactionAndARemovalWriteTheZeroAtOnce) {
  Component& component = this->add_slewed();
  this->deploy();
  this->run_up(component);
  Transaction stop;
  stop.stop("c");
  this->host.commit(std::move(stop));
  EXPECT_EQ(ComponentState::stopped, component.task().state());
  EXPECT_EQ(0.0, this->newest());
  EXPECT_EQ(1U, this->record(component).not_limited);
  this->host.start("c");
  this->wait_value(1.0);
  Transaction removal;
  removal.remove_component("c");
  this->host.commit(std::move(removal));
  EXPECT_EQ(0.0, this->newest());
}

TYPED_TEST(MaxSlew, AShutdownEndsInZero) {
  Component& component = this->add_slewed();
  this->deploy();
  this->run_up(component);
  this->host.shutdown();
  EXPECT_EQ(0.0, this->newest());
}

TYPED_TEST(MaxSlew, OfAComponentThatWasAddedWhileTheOthersRun) {
  this->add("neighbour");
  this->deploy();
  ComponentParts rest{.settings = this->settings()};
  Transaction change;
  change.template add_component<TestShell, TargetCore, TestFsm>("c", rest);
  auto buffer = std::make_unique<RingBuffer<Number>>(100'000);
  this->sink = buffer.get();
  change.add_resource("sink", std::move(buffer)).connect("c", "output", "sink", "write").start("c");
  this->host.commit(std::move(change));
  this->run_up(this->architecture.component("c"));
  EXPECT_EQ(0, this->jumps());
}

/// What add_component() says of such a max_slew.
std::pair<ErrorCode, std::string> refusal(const mauve::MaxSlew& max_slew) {
  Architecture architecture;
  try {
    architecture.add_component<TestShell, TargetCore, TestFsm>("c", {.max_slew = max_slew});
  } catch (const Error& error) {
    return {error.code(), error.what()};
  }
  ADD_FAILURE() << "it was not refused";
  return {ErrorCode::internal, ""};
}

TEST(MaxSlewSetting, SaysWhatIsWrong) {
  const auto expect = [](const std::string& output, double per_second, ErrorCode code, const char* text) {
    const auto [found, words] = refusal({{output, per_second}});
    EXPECT_EQ(code, found) << words;
    EXPECT_THAT(words, HasSubstr(text));
    EXPECT_THAT(words, HasSubstr("c")) << "the component";
  };
  using enum ErrorCode;
  expect("none.value", 1.0, unknown_port, "the shell has no such port");
  expect("input.value", 1.0, invalid_argument, "a write port, found a port of kind read");
  expect("output.speed", 1.0, invalid_argument, "max_slew output.speed");
  expect("output", 1.0, invalid_argument, "a dot and the path of a number");
  expect("output.", 1.0, invalid_argument, "a dot and the path of a number");
  expect(".value", 1.0, invalid_argument, "a dot and the path of a number");
  expect("output.value", 0.0, out_of_range, "a finite number above 0");
  expect("output.value", -1.0, out_of_range, "a finite number above 0");
  expect("output.value", kNan, out_of_range, "a finite number above 0");
  expect("output.value", std::numeric_limits<double>::infinity(), out_of_range, "a finite number above 0");
  EXPECT_EQ(duplicate_name, refusal({{"output.value", 1.0}, {"output.value", 2.0}}).first);
}

}  // namespace mauve::testing::test_max_slew
