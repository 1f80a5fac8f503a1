// SPDX-License-Identifier: LGPL-3.0-or-later
// Another fsm or shell of a component that waits for events: which events are whose, and how close releases come.
#include "free_fsm.hpp"
#include "hosts.hpp"

namespace mauve::testing::test_sporadic_changes {

constexpr time_ns_t kHour = s_to_ns(3600);
constexpr time_ns_t kShortest = ms_to_ns(20);

/// Waits for a write to the resource of `input`, then runs.
Define waits_first(time_ns_t shortest_ns = kShortest) {
  return [=](FreeFsm& fsm) {
    State& event = fsm.wait_event("Event", fsm.ports().input, kHour, shortest_ns);
    State& run = fsm.run("Run");
    fsm.set_initial(event);
    fsm.next(event, run);
    fsm.next(run, event);
  };
}

/// Runs, then waits for it.
Define runs_first(time_ns_t shortest_ns = kShortest) {
  return [=](FreeFsm& fsm) {
    State& run = fsm.run("Run");
    State& event = fsm.wait_event("Event", fsm.ports().input, kHour, shortest_ns);
    fsm.set_initial(run);
    fsm.next(run, event);
    fsm.next(event, run);
  };
}

Define periodic(time_ns_t period_ns) {
  return [=](FreeFsm& fsm) {
    State& run = fsm.run("Run");
    State& pause = fsm.wait("Pause", period_ns);
    fsm.set_initial(run);
    fsm.next(run, pause);
    fsm.next(pause, run);
  };
}

template <typename Way>
class SporadicChanges : public OnBothHosts<Way> {
 protected:
  Component& deploy_with(const Define& how) {
    Component& component = add_free(this->architecture, "c", how);
    this->architecture.connect("c", "input", "x", "read");
    this->deploy();
    const time_ns_t epoch = this->architecture.deployment_epoch_ns();
    this->host.until([&] { return this->host.now_ns() > epoch + ms_to_ns(1); }, "the epoch");
    return component;
  }
  void write() { x.write.write({1.0}, this->host.now_ns()); }
  void swap(const Define& how) {
    Transaction change;
    change.replace_fsm("c", std::make_unique<FreeFsm>(how));
    this->host.commit(std::move(change),
                      0);  // one that goes on in its wait is released by the next event only
  }
  /// As long as releases take that nobody expects.
  void rest() {
    const time_ns_t until = this->host.now_ns() + 3 * kShortest;
    this->host.until([&] { return this->host.now_ns() > until; }, "time to pass");
  }
  void expect_apart(Component& component, time_ns_t shortest_ns) {
    this->host.shutdown();
    const auto& instants = this->core(component).instants;
    for (std::size_t i = 1; i < instants.size(); ++i)
      EXPECT_GE(instants[i] - instants[i - 1], shortest_ns) << "activation " << i;
  }

  SharedData<Number>& x = this->architecture.template add_resource<SharedData<Number>>("x");
};
TYPED_TEST_SUITE(SporadicChanges, EveryHost, HostNames);

TYPED_TEST(SporadicChanges, EventsOfAPreparationAreForTheOldFsmOnly) {
  Component& component = this->deploy_with(waits_first());
  Transaction change;
  change.replace_fsm("c", std::make_unique<FreeFsm>(waits_first()));
  auto prepared = (*this->host).prepare(std::move(change), {});
  for (int i = 1; i <= 3; ++i) {
    this->write();
    this->wait_runs(component, i);
  }
  ASSERT_EQ(PreparedOutcome::committed, prepared->commit(s_to_ns(10)));
  this->rest();
  EXPECT_EQ(3, this->core(component).runs) << "the old fsm has run for each of them";
  this->write();
  this->wait_runs(component, 4);
}

TYPED_TEST(SporadicChanges, AnEventWhoseReleaseIsStillToComeIsForTheNewFsm) {
  Component& component = this->deploy_with(waits_first());
  this->write();
  this->wait_runs(component, 1);
  this->write();  // its release is due when the minimal interarrival has passed
  this->swap(waits_first());
  this->wait_runs(component, 2);
  this->rest();
  EXPECT_EQ(2, this->core(component).runs);
  this->expect_apart(component, kShortest);
}

TYPED_TEST(SporadicChanges, AnInitialStateThatRunsIsReleasedInPlaceOfThatEvent) {
  Component& component = this->deploy_with(waits_first());
  this->write();
  this->wait_runs(component, 1);
  this->write();
  this->swap(runs_first());
  this->wait_runs(component, 2);
  this->rest();
  EXPECT_EQ(2, this->core(component).runs);
  this->expect_apart(component, kShortest);
}

TYPED_TEST(SporadicChanges, AnotherShellLosesNoEventEither) {
  Component& component = this->deploy_with(waits_first());
  this->write();
  this->wait_runs(component, 1);
  this->write();
  Transaction change;
  change.replace_shell("c", std::make_unique<TestShell>());
  this->host.commit(std::move(change), 0);
  this->wait_runs(component, 2);
  this->write();
  this->wait_runs(component, 3);
  this->expect_apart(component, kShortest);
}

TYPED_TEST(SporadicChanges, AnEventThatCameWhileItWasStoppedIsForTheFsmThatStarts) {
  Component& component = this->deploy_with(waits_first());
  this->host.stop("c");
  this->write();
  this->swap(waits_first());
  EXPECT_EQ(0, this->core(component).runs);
  this->host.start("c");
  this->wait_runs(component, 1);
  this->rest();
  EXPECT_EQ(1, this->core(component).runs);
}

TYPED_TEST(SporadicChanges, AStopTakesNoEventAway) {
  Component& component = this->deploy_with(waits_first());
  this->write();
  this->wait_runs(component, 1);
  this->write();  // pending for 20 ms
  this->host.stop("c");
  this->host.start("c");
  this->wait_runs(component, 2);
  this->expect_apart(component, kShortest);
}

TYPED_TEST(SporadicChanges, AnEventOfAnotherResourceIsNotTakenOver) {
  this->architecture.template add_resource<SharedData<Number>>("y");
  Component& component = this->deploy_with(waits_first());
  this->host.stop("c");
  this->write();
  Transaction change;
  change.disconnect("c", "input").connect("c", "input", "y", "read");
  change.replace_fsm("c", std::make_unique<FreeFsm>(waits_first()));
  this->host.commit(std::move(change));
  this->host.start("c");
  this->rest();
  EXPECT_EQ(0, this->core(component).runs);
}

TYPED_TEST(SporadicChanges, TheMinimalInterarrivalHoldsAcrossSwaps) {
  for (const bool runs : {true, false}) {
    SCOPED_TRACE(runs ? "runs first" : "waits first");
    const Define how = runs ? runs_first() : waits_first();
    Component& component = runs ? this->deploy_with(how) : this->architecture.component("c");
    if (!runs) this->swap(how);
    const int before = this->core(component).runs;
    for (int i = 0; i < 30; ++i) {
      this->write();
      const time_ns_t until = this->host.now_ns() + ms_to_ns(3);
      this->host.until([&] { return this->host.now_ns() > until; }, "a part of the interarrival");
      if (i % 3 == 0) {
        Transaction change;
        change.replace_shell("c", std::make_unique<TestShell>());
        change.replace_fsm("c", std::make_unique<FreeFsm>(how));
        this->host.commit(std::move(change), 0);
      } else {
        this->swap(how);
      }
    }
    EXPECT_GT(this->core(component).runs, before) << "swaps do not starve it";
  }
  this->expect_apart(this->architecture.component("c"), kShortest);
}

TYPED_TEST(SporadicChanges, TheMinimalInterarrivalOfTheWaitThatReleasesCounts) {
  Component& component = this->deploy_with(waits_first(ms_to_ns(40)));
  this->write();
  this->wait_runs(component, 1);
  this->swap(waits_first(ms_to_ns(5)));
  this->write();
  this->wait_runs(component, 2);
  this->swap(waits_first(ms_to_ns(60)));
  this->write();
  this->wait_runs(component, 3);
  this->host.shutdown();
  const auto& instants = this->core(component).instants;
  EXPECT_GE(instants[1] - instants[0], ms_to_ns(5));
  EXPECT_GE(instants[2] - instants[1], ms_to_ns(60)) << "the new fsm's, since the old one's release";
  if (TestFixture::is_virtual) {
    EXPECT_LT(instants[1] - instants[0], ms_to_ns(40)) << "not the old one's";
    EXPECT_LT(instants[2] - instants[1], ms_to_ns(61));
  }
}

TYPED_TEST(SporadicChanges, AStartKeepsTheMinimalInterarrivalToo) {
  Component& component = this->deploy_with(runs_first());
  this->wait_runs(component, 1);
  for (int i = 0; i < 5; ++i) {
    this->host.stop("c");
    this->host.start("c");
  }
  this->wait_runs(component, 2);
  this->expect_apart(component, kShortest);
}

TYPED_TEST(SporadicChanges, MoreThanEightListenToOneResourceAndEachIsReplaced) {
  constexpr int kMany = 20;
  std::vector<std::string> names;
  for (int i = 0; i < kMany; ++i) {
    names.push_back("c" + std::to_string(i));
    add_free(this->architecture, names.back(), waits_first(us_to_ns(1)));
    this->architecture.connect(names.back(), "input", "x", "read");
  }
  this->deploy();
  Transaction change;
  for (const std::string& name : names)
    change.replace_fsm(name, std::make_unique<FreeFsm>(waits_first(us_to_ns(1))));
  this->host.commit(std::move(change), 0);
  this->write();
  for (const std::string& name : names) this->wait_runs(this->architecture.component(name), 1);
}

TYPED_TEST(SporadicChanges, AnotherFsmKeepsTheGridOfAStartOnAClock) {
  Component& component = this->add("c", 10);
  this->deploy();
  this->wait_runs(component, 1);
  const time_ns_t clock = this->architecture.deployment_epoch_ns() + ms_to_ns(3);
  const auto expect_from = [&](time_ns_t reference_ns, time_ns_t period_ns) {
    this->wait_runs(component, this->core(component).runs + 3);
    this->host.stop("c");
    const auto& instants = this->core(component).instants;
    EXPECT_EQ(0, (Grid{.reference_ns = reference_ns, .period_ns = period_ns}.phase_error(instants.back())));
  };
  this->host.stop("c");
  this->host.start("c", clock);
  EXPECT_EQ(clock, component.task().grid().reference_ns);
  Transaction change;
  change.replace_fsm("c", std::make_unique<FreeFsm>(periodic(ms_to_ns(4))));
  this->host.commit(std::move(change));
  expect_from(clock, ms_to_ns(4));
  this->host.start("c");
  expect_from(this->architecture.deployment_epoch_ns(), ms_to_ns(4));
  Transaction start;
  start.start("c", clock);
  this->host.commit(std::move(start));
  Transaction again;
  again.stop("c").start("c");
  this->host.commit(std::move(again));
  expect_from(clock, ms_to_ns(4));
  this->host.start("c", clock);
  Transaction resynchronise;
  resynchronise.resynchronise();
  this->host.commit(std::move(resynchronise));
  EXPECT_EQ(this->architecture.deployment_epoch_ns(), component.task().grid().reference_ns);
}

class SporadicOnThreads : public Deployed {};

/// The time-out is an hour away: an event that is lost is seen.
TEST_F(SporadicOnThreads, NoEventBesideASwapIsLost) {
  auto& x = architecture.add_resource<SharedData<Number>>("x");
  add_free(architecture, "c", waits_first(us_to_ns(1)));
  architecture.connect("c", "input", "x", "read");
  std::atomic<int> seen{0};
  Component& component = architecture.component("c");
  core(component).work = [&, &own = core(component)] {
    seen = static_cast<int>(own.exposed_shell().input.read().value.value);
  };
  const ComponentsEndFirst guard(deployer);
  deploy();
  for (int i = 1; i <= 300; ++i) {
    std::thread swaps([&, i] {
      Transaction change;
      if (i % 3 == 0) change.replace_shell("c", std::make_unique<TestShell>());
      if (i % 3 != 2) change.replace_fsm("c", std::make_unique<FreeFsm>(waits_first(us_to_ns(1))));
      if (i % 3 == 2) change.disconnect("c", "input").connect("c", "input", "x", "read");
      deployer.commit(std::move(change), {.timeouts = {.commit_ns = s_to_ns(30), .phase_ns = 0}});
    });
    std::this_thread::sleep_for(std::chrono::microseconds(i * 7 % 400));
    x.write.write({static_cast<double>(i)}, monotonic_now_ns());
    wait_until([&] { return seen == i; }, "the event");
    swaps.join();
    if (HasFatalFailure()) return;
  }
}

}  // namespace mauve::testing::test_sporadic_changes
