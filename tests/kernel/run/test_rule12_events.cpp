// SPDX-License-Identifier: LGPL-3.0-or-later
// Rule 12: machines that wait for events.
#include <functional>

#include "free_fsm.hpp"

namespace mauve::testing::test_rule12_events {

using ::testing::ElementsAre;

constexpr time_ns_t kTimeout = ms_to_ns(20);
constexpr time_ns_t kShortest = ms_to_ns(4);

/// Run, then wait for a write to the resource of `input`.
Define sporadic(time_ns_t timeout_ns = kTimeout, time_ns_t execution_ns = 0,
                time_ns_t shortest_ns = kShortest) {
  return [=](FreeFsm& fsm) {
    State& run = fsm.run("Run", execution_ns);
    State& event = fsm.wait_event("Event", fsm.ports().input, timeout_ns, shortest_ns);
    fsm.set_initial(run);
    fsm.next(run, event);
    fsm.next(event, run);
  };
}

class Rule12Events : public Simulated {
 protected:
  Component& add_listener(const Define& how = sporadic(), const TaskSettings& settings = {}) {
    Component& component = add_free(architecture, "c", how, settings);
    architecture.connect("c", "input", "x", "read");
    return component;
  }
  /// Writes to a resource at this time after the epoch, stamped with it.
  void write_at(double after_ms, SharedData<Number>& resource) {
    const time_ns_t when = simulation.epoch_ns() + static_cast<time_ns_t>(after_ms * 1e6);
    simulation.at(when, [&resource, when] { resource.write.write({1.0}, when); });
  }
  SharedData<Number>& x = architecture.add_resource<SharedData<Number>>("x");
};

TEST_F(Rule12Events, ReleaseAtTheEventsTimeOrAtTheTimeout) {
  Component& component = add_listener();
  deploy();
  write_at(7.25, x);
  write_at(12, x);
  run_to(ms_to_ns(60));
  EXPECT_THAT(instants_ms(component), ElementsAre(0, 7.25, 12, 32, 52))
      << "20 ms without an event: the timeout";
}

TEST_F(Rule12Events, AreKeptApartByTheMinimalInterarrival) {
  Component& component = add_listener();
  deploy();
  write_at(1, x);
  write_at(5, x);
  write_at(10, x);
  run_to(ms_to_ns(20));
  EXPECT_THAT(instants_ms(component), ElementsAre(0, 4, 8, 12)) << "each max(last + 4, event time)";
}

TEST_F(Rule12Events, SeveralBeforeAWaitAreOne) {
  Component& component = add_listener();
  deploy();
  for (const double when : {10.0, 10.5, 11.0, 11.5, 13.0}) write_at(when, x);
  run_to(ms_to_ns(37));
  EXPECT_THAT(instants_ms(component), ElementsAre(0, 10, 14, 18))
      << "10.5 makes the next, and those after it one";
}

TEST_F(Rule12Events, OneBeforeTheWaitIsNotLost) {
  Component& component = add_free(architecture, "c", [](FreeFsm& fsm) {
    State& run = fsm.run("Run");
    State& pause = fsm.wait("Pause", ms_to_ns(10));
    State& event = fsm.wait_event("Event", fsm.ports().input, kTimeout, kShortest);
    fsm.set_initial(run);
    fsm.next(run, pause);
    fsm.next(pause, event);
    fsm.next(event, run);
  });
  architecture.connect("c", "input", "x", "read");
  deploy();
  write_at(3, x);
  run_to(ms_to_ns(23));
  EXPECT_THAT(instants_ms(component), ElementsAre(0, 14)) << "last clock 10, and 4 more";
}

TEST_F(Rule12Events, OneDuringAnExecutionIsNotLost) {
  Component& component = add_listener(sporadic(kTimeout, ms_to_ns(6)));
  deploy();
  write_at(2, x);
  run_to(ms_to_ns(20));
  EXPECT_THAT(instants_ms(component), ElementsAre(0, 4));
  const auto releases = records_of(architecture.drain_trace(), TraceKind::release);
  ASSERT_EQ(2U, releases.size());
  EXPECT_EQ(simulation.epoch_ns() + ms_to_ns(6), releases[1].b) << "as soon as it can";
}

TEST_F(Rule12Events, EveryKindOfResourceRaisesThem) {
  auto& ring = architecture.add_resource<RingBuffer<Number>>("ring", std::size_t{4});
  auto& latest = architecture.add_resource<LatestValue<Number>>("latest");
  for (const char* name : {"ring", "latest"}) {
    add_free(architecture, name, sporadic());
    architecture.connect(name, "input", name, "read");
  }
  deploy();
  const time_ns_t when = simulation.epoch_ns() + ms_to_ns(5);
  simulation.at(when, [&] {
    ring.write.write({1.0}, when);
    latest.write.write({1.0}, when);
  });
  run_to(ms_to_ns(24));
  EXPECT_THAT(instants_ms(architecture.component("ring")), ElementsAre(0, 5));
  EXPECT_THAT(instants_ms(architecture.component("latest")), ElementsAre(0, 5));
}

struct CountShell : TestShell {
  ReadPort<EventCount>& count = read_port<EventCount>("count").optional();
};
struct CountFsm : Fsm<CountShell, TestCore> {
  void define() override {
    State& run = execution("Run", "act", &TestCore::act);
    State& event = wait_event("Event", shell().count, kTimeout, kShortest);
    set_initial(run);
    next(run, event);
    next(event, run);
  }
};

TEST_F(Rule12Events, ARaiseIsOne) {
  auto& counter = architecture.add_resource<EventCounter>("counter");
  Component& component = architecture.add_component<CountShell, TestCore, CountFsm>("c");
  core(component).instants.reserve(10);
  architecture.connect("c", "count", "counter", "read");
  deploy();
  const time_ns_t when = simulation.epoch_ns() + ms_to_ns(6);
  simulation.at(when, [&] { counter.raise.raise(when); });
  run_to(ms_to_ns(25));
  EXPECT_THAT(instants_ms(component), ElementsAre(0, 6));
}

TEST_F(Rule12Events, AnotherComponentsWriteCarriesItsLogicalClock) {
  Component& component = add_listener();
  Component& writer = add("writer", 15, 3.0, {.priority = 60});
  architecture.connect("writer", "output", "x", "write");
  core(writer).work = [&] { core(writer).exposed_shell().output.write({1.0}); };
  deploy();
  run_to(ms_to_ns(50));
  EXPECT_THAT(instants_ms(component), ElementsAre(0, 4, 15, 30, 45))
      << "at the writer's clock; the first was before its own";
}

TEST_F(Rule12Events, AnUnconnectedPortsWaitTimesOut) {
  Component& component = add_free(architecture, "c", sporadic());
  deploy();
  write_at(5, x);
  run_to(ms_to_ns(45));
  EXPECT_THAT(instants_ms(component), ElementsAre(0, 20, 40));
}

TEST_F(Rule12Events, ARewiredPortListensToItsNewResourceOnly) {
  auto& y = architecture.add_resource<SharedData<Number>>("y");
  Component& component = add_listener();
  deploy();
  simulation.at(simulation.epoch_ns() + ms_to_ns(10), [&] {
    Transaction change;
    change.disconnect("c", "input").connect("c", "input", "y", "read");
    host().commit(std::move(change));
  });
  write_at(5, x);
  write_at(12, x);
  write_at(14, y);
  simulation.at(simulation.epoch_ns() + ms_to_ns(15), [&] {
    Transaction change;
    change.disconnect("c", "input").remove_resource("y");
    host().commit(std::move(change));
  });
  run_to(ms_to_ns(40));
  EXPECT_THAT(instants_ms(component), ElementsAre(0, 5, 14, 34))
      << "a commit keeps the timeout that was running";
}

/// Writes in the very commit that puts it in.
struct WritingCore : TestCore {
  explicit WritingCore(std::function<void()> write) : write_(std::move(write)) {}
  void take(CoreBase& /*old*/) noexcept override { write_(); }

 private:
  std::function<void()> write_;
};

TEST_F(Rule12Events, ARewiredPortMissesNothingFromItsCommitOn) {
  auto& y = architecture.add_resource<SharedData<Number>>("y");
  Component& component = add_listener();
  deploy();
  const time_ns_t when = simulation.epoch_ns() + ms_to_ns(10);
  simulation.at(when, [&] {
    auto fresh = std::make_unique<WritingCore>([&y, when] { y.write.write({1.0}, when); });
    fresh->instants.reserve(10);
    Transaction change;
    change.disconnect("c", "input").connect("c", "input", "y", "read").replace_core("c", std::move(fresh));
    host().commit(std::move(change));
  });
  run_to(ms_to_ns(15));
  EXPECT_THAT(instants_ms(component), ElementsAre(10)) << "the timeout would have come at 20";
}

TEST_F(Rule12Events, AreNoPeriodNorPhase) {
  Component& component = add_listener(sporadic(), {.offset_ns = ms_to_ns(2)});
  deploy();
  EXPECT_EQ(0, component.fsm().period_ns());
  EXPECT_TRUE(component.fsm().is_sporadic());
  EXPECT_EQ(0, component.task().grid().period_ns);
  simulation.at(simulation.epoch_ns() + ms_to_ns(7), [this] {
    host().stop("c");
    host().start("c");
  });
  run_to(ms_to_ns(10));
  EXPECT_THAT(instants_ms(component), ElementsAre(2, 7.200001))
      << "no grid: the first instant later than 200 us";
}

TEST_F(Rule12Events, APeriodMustNotBeDeclared) {
  add_listener(sporadic(), {.period_ns = ms_to_ns(1)});
  try {
    architecture.configure();
    FAIL() << "should have been refused";
  } catch (const Error& error) {
    EXPECT_EQ(ErrorCode::bad_period, error.code());
    EXPECT_EQ("c", error.detail().component);
  }
}

TEST_F(Rule12Events, TimesMustFitAndThePortMustRead) {
  const auto refused = [](time_ns_t timeout_ns, time_ns_t shortest_ns) {
    Architecture architecture;
    add_free(architecture, "c", sporadic(timeout_ns, 0, shortest_ns));
    try {
      architecture.configure();
    } catch (const Error& error) {
      return error.code() == ErrorCode::bad_fsm;
    }
    return false;
  };
  EXPECT_FALSE(refused(ms_to_ns(4), ms_to_ns(4)));
  EXPECT_FALSE(refused(us_to_ns(100), 1));
  EXPECT_FALSE(refused(kForever, 1));
  EXPECT_FALSE(refused(kForever, kLongest));
  EXPECT_TRUE(refused(1, 1)) << "it would never rest";
  EXPECT_TRUE(refused(kForever, kForever)) << "the sum with an instant is none";
  EXPECT_TRUE(refused(kForever, kLongest + 1));
  EXPECT_TRUE(refused(ms_to_ns(4), 0));
  EXPECT_TRUE(refused(0, 0));
  EXPECT_TRUE(refused(ms_to_ns(3), ms_to_ns(4)));
  EXPECT_EQ(ErrorCode::bad_fsm, error_of([](FreeFsm& fsm) {
              static TestShell shell;
              fsm.wait_event("Event", shell.output, 2, 1);
            }));
}

TEST_F(Rule12Events, AnOverrunPastTheTimeoutGoesOnAtOnce) {
  Component& component = add_listener(sporadic(ms_to_ns(10), ms_to_ns(12)));
  deploy();
  run_to(ms_to_ns(30));
  EXPECT_THAT(instants_ms(component), ElementsAre(0, 12, 24)) << "no grid to keep: the clock is the present";
  EXPECT_EQ(3U, component.task().statistics().overruns);
  EXPECT_EQ(0U, component.task().statistics().skipped);
}

class Rule12Threads : public Deployed {
 protected:
  Component& add_listener() {
    Component& component =
        add_free(architecture, "c", sporadic(s_to_ns(3600), 0, us_to_ns(1)), {.cpus = {0}});
    architecture.connect("c", "input", "x", "read");
    return component;
  }
  /// Deploys a listener with this timeout, and puts in a core whose adopt does this: after its first release, or with an offset before it.
  Component& change_in_adopt(time_ns_t timeout_ns, std::function<bool()> adopt, time_ns_t offset_ns = 0) {
    Component& component = add_free(architecture, "c", sporadic(timeout_ns, 0, us_to_ns(1)),
                                    {.cpus = {0}, .offset_ns = offset_ns});
    architecture.connect("c", "input", "x", "read");
    deploy();
    if (offset_ns == 0) wait_runs(component, 1);
    auto fresh = std::make_unique<AdoptingCore>(std::move(adopt));
    fresh->instants.reserve(100);
    Transaction change;
    change.replace_core("c", std::move(fresh));
    try {
      report = deployer.commit(std::move(change), {.timeouts = {.commit_ns = s_to_ns(10)}}).steps.front();
    } catch (const Error& error) {
      EXPECT_EQ(ErrorCode::adopt_refused, error.code()) << error.what();
    }
    return component;
  }

  struct AdoptingCore : TestCore {
    explicit AdoptingCore(std::function<bool()> adopt) : adopt_(std::move(adopt)) {}
    bool adopt(const CoreBase& /*old*/) override { return adopt_(); }

   private:
    std::function<bool()> adopt_;
  };

  StepReport report;
  SharedData<Number>& x = architecture.add_resource<SharedData<Number>>("x");
};

/// An adopt in which an event comes, and then the timeout passes.
class Rule12Adopt : public Rule12Threads, public ::testing::WithParamInterface<bool> {};
INSTANTIATE_TEST_SUITE_P(All, Rule12Adopt, ::testing::Bool(),
                         [](const auto& tested) { return std::string(tested.param ? "Agrees" : "Refuses"); });

TEST_P(Rule12Adopt, AnEventInItEndsTheWaitAtItsTime) {
  time_ns_t event_ns = 0;
  Component& component = change_in_adopt(ms_to_ns(120), [&, agrees = GetParam()] {
    sleep_for(ms_to_ns(70));
    event_ns = monotonic_now_ns();
    x.write.write({1.0}, event_ns);
    sleep_for(ms_to_ns(70));
    return agrees;
  });
  wait_runs(component, GetParam() ? 2 : 3);
  deployer.shutdown();
  const auto& instants = core(component).instants;
  const std::size_t first = GetParam() ? 0 : 1;
  EXPECT_EQ(event_ns, instants[first]);
  EXPECT_EQ(event_ns + ms_to_ns(120), instants[first + 1]) << "the timeout counts from there";
}

TEST_P(Rule12Adopt, TimeoutsThatPassInItAreMissedAndAreNoOverruns) {
  time_ns_t end_ns = 0;
  Component& component = change_in_adopt(ms_to_ns(40), [&, agrees = GetParam()] {
    sleep_for(ms_to_ns(150));
    end_ns = monotonic_now_ns();
    return agrees;
  });
  wait_runs(component, GetParam() ? 2 : 3);
  deployer.shutdown();
  const auto& instants = core(component).instants;
  const std::size_t first = GetParam() ? 0 : 1;
  EXPECT_GE(instants[first], end_ns);
  EXPECT_EQ(ms_to_ns(40), instants[first + 1] - instants[first]);
  EXPECT_EQ(0U, component.task().statistics().overruns);
  if (GetParam()) {
    EXPECT_GE(report.missed_releases, 2);
  }
}

TEST_P(Rule12Adopt, AStartThatPassesInItIsMissed) {
  constexpr time_ns_t kOffset = ms_to_ns(300);
  time_ns_t end_ns = 0;
  const auto adopt = [&, agrees = GetParam()] {
    sleep_for(deployer.epoch_ns() + kOffset + ms_to_ns(150) - monotonic_now_ns());
    end_ns = monotonic_now_ns();
    return agrees;
  };
  Component& component = change_in_adopt(ms_to_ns(40), adopt, kOffset);
  wait_runs(component, 2);
  deployer.shutdown();
  const auto& instants = core(component).instants;
  EXPECT_GE(instants[0], end_ns) << "150 ms late, longer than the timeout";
  EXPECT_EQ(ms_to_ns(40), instants[1] - instants[0]);
  EXPECT_EQ(0U, component.task().statistics().overruns);
}

TEST_F(Rule12Threads, NoWriteOfAnOrdinaryThreadIsLost) {
  Component& component = add_listener();
  std::atomic<double> seen{0.0};
  core(component).work = [&, &own = core(component)] { seen = own.exposed_shell().input.read().value.value; };
  deploy();
  wait_runs(component, 1);
  for (int i = 1; i <= 5'000; ++i) {
    x.write.write({static_cast<double>(i)}, monotonic_now_ns());
    wait_until([&] { return seen == i; }, "the event; its timeout is an hour away");
    if (HasFatalFailure()) return;
  }
}

TEST_F(Rule12Threads, NorIsAComponentsNorOneOfAStop) {
  Component& component = add_listener();
  Component& writer = add("writer", 1);
  architecture.connect("writer", "output", "x", "write");
  core(writer).work = [&own = core(writer)] {
    own.exposed_shell().output.write({static_cast<double>(own.runs)});
  };
  std::atomic<double> seen{0.0};
  const ComponentsEndFirst guard(deployer);
  core(component).work = [&, &own = core(component)] { seen = own.exposed_shell().input.read().value.value; };
  deploy();
  for (int i = 0; i < 200; ++i) {
    deployer.stop("c", s_to_ns(10));
    deployer.start("c");
    const int now = core(writer).runs;
    wait_until([&] { return seen > now; }, "an event after the restart");
    if (HasFatalFailure()) return;
  }
}

}  // namespace mauve::testing::test_rule12_events
