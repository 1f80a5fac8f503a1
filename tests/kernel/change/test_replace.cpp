// SPDX-License-Identifier: LGPL-3.0-or-later
// Rules 7 and 9: a core or property is replaced while the component runs.
#include <random>

#include "fixtures.hpp"

namespace mauve::testing::test_replace {

/// Carries the number of runs over.
struct Successor : TestCore {
  bool refuse{false};
  bool throw_in_adopt{false};
  bool fail_configure{false};
  std::atomic<int>* cleaned{nullptr};

  bool adopt(const CoreBase& old) override {
    if (throw_in_adopt) throw std::runtime_error("cannot read the old state");
    return !refuse && dynamic_cast<const TestCore*>(&old) != nullptr;
  }
  void take(CoreBase& old) noexcept override { runs = static_cast<TestCore&>(old).runs.load(); }
  bool configure_hook() override { return !fail_configure; }
  void cleanup_hook() override {
    if (cleaned != nullptr) ++*cleaned;
  }
};

class Rule9Replace : public Deployed {};

TEST_F(Rule9Replace, KeepsThePendingInstantAndMissesNothing) {
  Component& component = add("c", 50);
  Component& neighbour = add("neighbour", 1, {.priority = 60, .cpus = {0}});
  deploy();
  wait_runs(component, 1);
  const int runs = core(component).runs;
  const StepReport report = component.swap_core(std::make_unique<Successor>());
  wait_runs(component, runs + 2);
  EXPECT_EQ(0, report.missed_releases);
  EXPECT_EQ(0, report.phase_nominal_ns);
  EXPECT_GE(report.phase_actual_ns, 0);
  EXPECT_GT(report.blackout_ns, 0);
  EXPECT_GT(core(neighbour).runs, 1);

  const TraceDrain drain = deployer.drain_trace();
  const auto parked = records_of(drain, TraceKind::parked);
  const auto armed = records_of(drain, TraceKind::armed);
  ASSERT_EQ(1U, parked.size());
  ASSERT_EQ(1U, armed.size());
  EXPECT_EQ(parked[0].a, armed[0].a) << "the pending instant was kept";
  EXPECT_EQ(1, armed[0].b);
  EXPECT_EQ(report.blackout_ns, armed[0].time_ns - parked[0].time_ns);
  // The release after is the one that was pending.
  for (const TraceRecord& release : records_of(drain, TraceKind::release)) {
    if (release.time_ns > armed[0].time_ns) {
      EXPECT_EQ(parked[0].a, release.a);
      break;
    }
  }
}

TEST_F(Rule9Replace, AThousandTimesAtRandomPhasesMissesNoRelease) {
  Component& component = add("c", 1);
  core(component).work = [] {};
  deploy();
  std::mt19937 random(3);
  std::uniform_int_distribution<int> phase_us(0, 900);
  int in_time = 0;
  for (int i = 0; i < 1000; ++i) {
    std::this_thread::sleep_for(std::chrono::microseconds(phase_us(random)));
    deployer.drain_trace();
    const StepReport report = component.swap_core(std::make_unique<Successor>(),
                                                  {.commit_ns = s_to_ns(10), .phase_ns = s_to_ns(10)});
    ASSERT_EQ(0, report.phase_nominal_ns);
    const TraceDrain drain = deployer.drain_trace();
    const auto parked = records_of(drain, TraceKind::parked);
    const auto armed = records_of(drain, TraceKind::armed);
    ASSERT_EQ(1U, parked.size());
    ASSERT_EQ(1U, armed.size());
    // The machine stalled the commit past the instant. armed[0].a is later by a stall that lost some instants.
    if (armed[0].time_ns > parked[0].a) continue;
    if (!records_of(drain, TraceKind::overrun).empty()) continue;  // or the thread between this and its wait
    ++in_time;
    ASSERT_EQ(0, report.missed_releases) << "armed before the pending instant, it was released at it";
  }
  EXPECT_GT(in_time, may_use_fifo() ? 500 : 0) << "a commit is made while there is time for it";
  EXPECT_GE(core(component).runs, 1000) << "take() carried the count over each time";
}

TEST_F(Rule9Replace, RefusalsLeaveTheOldCoreRunning) {
  Component& component = add("c", 2);
  deploy();
  wait_runs(component, 1);
  CoreBase* const old = &component.core();
  const auto refused = [&](auto&& prepare, ErrorCode expected) {
    auto fresh = std::make_unique<Successor>();
    std::atomic<int> cleaned{0};
    fresh->cleaned = &cleaned;
    prepare(*fresh);
    const bool was_configured = !fresh->fail_configure;
    try {
      component.swap_core(std::move(fresh));
      ADD_FAILURE() << "should have been refused";
    } catch (const Error& error) {
      EXPECT_EQ(expected, error.code()) << error.what();
    }
    EXPECT_EQ(was_configured ? 1 : 0, cleaned);
    EXPECT_EQ(old, &component.core());
    const int runs = core(component).runs;
    wait_runs(component, runs + 2);
  };
  refused([](Successor& core) { core.fail_configure = true; }, ErrorCode::prepare_failed);
  refused([](Successor& core) { core.refuse = true; }, ErrorCode::adopt_refused);
  refused([](Successor& core) { core.throw_in_adopt = true; }, ErrorCode::adopt_refused);
}

TEST_F(Rule9Replace, ACoreOfAnotherKindIsRefusedAtPrepare) {
  struct OtherShell : Shell {};
  struct OtherCore : Core<OtherShell> {};
  struct UnrelatedCore : Core<TestShell> {};
  Component& component = add("c", 2);
  deploy();
  EXPECT_THROW(component.swap_core(std::make_unique<OtherCore>()), Error);
  EXPECT_THROW(component.swap_core(std::make_unique<UnrelatedCore>()), Error);
  const int runs = core(component).runs;
  wait_runs(component, runs + 1);
}

TEST_F(Rule9Replace, ACommitThatCannotBeMadeInTimeIsWithdrawn) {
  Component& component = add("c", 5);
  std::atomic<bool> go_on{false};
  core(component).work = [&] {
    while (!go_on) {
    }
  };
  deploy();
  wait_runs(component, 1);
  CoreBase* const old = &component.core();
  try {
    component.swap_core(std::make_unique<Successor>(), {.commit_ns = ms_to_ns(20)});
    FAIL() << "should have timed out";
  } catch (const Error& error) {
    EXPECT_EQ(ErrorCode::timeout, error.code());
    EXPECT_THAT(error.what(), ::testing::HasSubstr("state Run"));
  }
  go_on = true;
  wait_runs(component, 3);
  EXPECT_EQ(old, &component.core());
  const StepReport report = component.swap_core(std::make_unique<Successor>());
  EXPECT_GT(report.blackout_ns, 0);
}

TEST_F(Rule9Replace, AStoppedComponentTakesItHereAndNow) {
  Component& component = add("c", 2);
  deploy();
  wait_runs(component, 1);
  deployer.stop("c");
  const int runs = core(component).runs;
  const StepReport report = component.swap_core(std::make_unique<Successor>());
  EXPECT_EQ(0, report.blackout_ns);
  EXPECT_EQ(runs, core(component).runs);
  deployer.start("c");
  wait_runs(component, runs + 1);
}

TEST_F(Rule9Replace, ASecondCommitBeforeTheReleaseSupersedesTheFirst) {
  Component& component = add("c", 400);
  deploy();
  wait_runs(component, 1);
  StepReport first;
  std::atomic<bool> committed{false};
  std::thread waiting([&] {
    first = component.swap_core(std::make_unique<Successor>(),
                                {.commit_ns = s_to_ns(5), .phase_ns = s_to_ns(5)}, [&] { committed = true; });
  });
  wait_until([&] { return committed.load(); }, "the first commit");
  const StepReport second =
      component.swap_core(std::make_unique<Successor>(), {.commit_ns = s_to_ns(5), .phase_ns = s_to_ns(5)});
  waiting.join();
  EXPECT_EQ(kNotMeasured, first.phase_actual_ns);
  EXPECT_NE(kNotMeasured, second.phase_actual_ns);
}

class Rule7Hold : public Deployed {};

TEST_F(Rule7Hold, APropertyIsSetInsideTheWaitAndKeepsTheInstant) {
  Component& component = add("c", 100);
  deploy();
  wait_runs(component, 1);
  bool is_inside = false;
  for (int i = 0; i < 20 && !is_inside; ++i) {  // a computer that stalls makes a change late
    const double gain = 2.5 + i / 10.0;
    const StepReport report = deployer.set_property("c", "gain", gain);
    EXPECT_EQ(0, report.phase_nominal_ns);
    EXPECT_EQ(PropertyValue(gain), component.shown().properties[0].value);
    const auto armed = records_of(deployer.drain_trace(), TraceKind::armed);
    ASSERT_EQ(1U, armed.size());
    is_inside = armed[0].time_ns < armed[0].a && report.missed_releases == 0;
  }
  EXPECT_TRUE(is_inside) << "released before the pending instant";
}

TEST_F(Rule7Hold, BadPropertiesAreRefusedWithTheRange) {
  add("c", 1);
  deploy();
  const auto code = [&](const std::string& name, const PropertyValue& value) {
    try {
      deployer.set_property("c", name, value);
    } catch (const Error& error) {
      EXPECT_EQ("c", error.detail().component.empty() ? "c" : error.detail().component);
      return error.code();
    }
    return ErrorCode::internal;
  };
  EXPECT_EQ(ErrorCode::out_of_range, code("gain", 11.0));
  EXPECT_EQ(ErrorCode::out_of_range, code("gain", std::numeric_limits<double>::quiet_NaN()));
  EXPECT_EQ(ErrorCode::type_mismatch, code("gain", std::string("much")));
  EXPECT_EQ(ErrorCode::unknown_property, code("gian", 1.0));
}

TEST_F(Rule9Replace, OnlyDeclaredCoresByName) {
  PluginRegistry registry;
  registry.shell<TestShell>("t/Shell");
  registry.core<TestCore>("t/Core", "t/Shell");
  registry.core<Successor>("t/Successor", "t/Shell");
  registry.core<Successor>("t/Stranger", "t/Shell");
  registry.fsm<TestFsm>("t/Fsm", "t/Shell");
  Architecture named(&registry);
  Component& component = named.add_component("c", "t/Shell", "t/Core", "t/Fsm", {});
  component.allow({"t/Successor"}, true);
  named.configure();
  Deployer deployer(named);
  deployer.deploy();
  const auto code = [&](const std::string& core) {
    try {
      deployer.replace_core("c", core);
    } catch (const Error& error) {
      return error.code();
    }
    return ErrorCode::internal;
  };
  EXPECT_EQ(ErrorCode::internal, code("t/Successor")) << "declared";
  EXPECT_EQ("t/Successor", component.core_implementation());
  EXPECT_EQ(ErrorCode::undeclared_core, code("t/Stranger"));
  EXPECT_EQ(ErrorCode::unknown_core, code("t/Nobody"));
  EXPECT_EQ(ErrorCode::internal, code("t/Core")) << "the one it was declared with";
  component.allow({Component::any_core}, true);
  EXPECT_EQ(ErrorCode::internal, code("t/Stranger")) << "whatever there is";
  EXPECT_EQ(ErrorCode::unknown_core, code("t/Nobody"));
  component.allow({}, false);
  EXPECT_EQ(ErrorCode::not_reconfigurable, code("t/Core"));
}

}  // namespace mauve::testing::test_replace
