// SPDX-License-Identifier: LGPL-3.0-or-later
// A change that is made while a component, or a hook of its parts, hangs: on threads.
#include <future>

#include "open_change_fixtures.hpp"

namespace mauve::testing::test_open_change_beside {

using namespace open_change;

TEST_F(OpenChangeBeside, AShutdownEndsWhatAChangeHasAddedAndWhatItHasRemoved) {
  architecture.connect("late", "output", "s", "write");
  deploy();
  auto core = std::make_unique<TestCore>();
  core->work = [&own = *core] { own.exposed_shell().output.write({7.0}); };
  Parts parts = new_parts();
  parts.core = std::move(core);
  Transaction change;
  change.set_property("late", "gain", 2.0).add_component("new", std::move(parts));
  change.connect("new", "output", "r", "write").start("new");
  make_late(std::move(change));
  const auto added = architecture.hold_component("new");
  way.until([&] { return value_of("r") == 7.0; }, "the new one to write");
  way.shutdown();
  EXPECT_EQ(ComponentState::stopped, added->task().state());
  EXPECT_FALSE(added->task().has_thread());
  EXPECT_EQ(0.0, value_of("r")) << "it commands no more";
}

TEST_F(OpenChangeBeside, ARevertThatALateOneIsStoppedBeforeIsCarriedOut) {
  deploy();
  auto trial = std::make_unique<TestCore>();
  trial->work = [held = held] {
    if (held->is_armed.exchange(false)) held->doors.pass();
  };
  commit(Transaction().replace_core("late", std::move(trial), ProbationOptions{.duration_ns = kLong}));
  Transaction change;
  change.add("revert_core", "late").set_property("late", "gain", 2.0);
  make_late(std::move(change));
  EXPECT_EQ(ErrorCode::timeout, refusal([&] { host().stop("late", 0); }).code());
  let_it_go_on();
  way.until([&] { return late->task().state() == ComponentState::stopped; }, "the pending stop");
  host().start("late");
  way.until([&] { return late->core_implementation() == "t/Core"; }, "the old core");
  EXPECT_EQ(ProbationVerdict::reverted, host().probations().front().verdict);
}

TEST_F(OpenChangeBeside, OneThatHungAndIsRemovedTakesNothing) {
  deploy();
  Transaction change;
  change.set_property("late", "gain", 2.0).connect("late", "output", "r", "write");
  make_late(std::move(change));
  const auto gone = architecture.hold_component("late");
  EXPECT_TRUE(host().stop("late", {.timeout_ns = ms_to_ns(20), .force = true}));
  EXPECT_EQ(0.0, value_of("r")) << "the safe value goes through the end that it has yet to take";
  commit(Transaction().remove_component("late"));
  EXPECT_NO_THROW(commit(Transaction().remove_resource("r")));
  EXPECT_NO_THROW(commit(Transaction().set_property("b", "gain", 3.0)));
  let_it_go_on();
  wait_until([&] { return architecture.threads_left_behind() == 0; }, "the thread's end");
  commit(Transaction().set_property("b", "gain", 4.0));
  EXPECT_FALSE(gone->shell_as<TestShell>().output.is_connected());
}

TEST_F(OpenChangeBeside, TwoAdoptsThatHangLeaveTheirRecordToBoth) {
  deploy();
  std::array<std::shared_ptr<Doors>, 2> doors{std::make_shared<Doors>(), std::make_shared<Doors>()};
  Transaction change;
  int i = 0;
  for (const char* name : {"b", "p"}) {
    auto core = std::make_unique<HookedCore>();
    core->adopting = [door = doors.at(static_cast<std::size_t>(i++))] { door->pass(); };
    change.replace_core(name, std::move(core));
  }
  EXPECT_EQ(ErrorCode::faulted, refusal([&] { commit(change, {.commit_ns = ms_to_ns(200)}); }).code());
  commit(Transaction().remove_component("b").remove_component("p"));
  for (auto door = doors.rbegin(); door != doors.rend(); ++door) {
    (*door)->open = true;
    const std::size_t left = static_cast<std::size_t>(doors.rend() - door) - 1;
    wait_until([&] { return architecture.threads_left_behind() == left; }, "a thread's end");
    commit(Transaction().set_property("late", "gain", 3.0 + static_cast<double>(left)));
  }
}

TEST_F(OpenChangeBeside, AnAdoptThatHangsKeepsTheResourceThatItWasToHave) {
  deploy();
  const auto doors = std::make_shared<Doors>();
  auto core = std::make_unique<HookedCore>();
  core->adopting = [doors] { doors->pass(); };
  Transaction change;
  change.add_resource("new", std::make_unique<LatestValue<Number>>())
      .replace_shell("b", std::make_unique<TestShell>())
      .replace_core("b", std::move(core))
      .connect("b", "output", "new", "write");
  EXPECT_EQ(ErrorCode::faulted, refusal([&] { commit(change, {.commit_ns = ms_to_ns(150)}); }).code());
  EXPECT_EQ(nullptr, architecture.find_resource("new"));
  commit(Transaction().remove_component("b"));
  doors->open = true;
  wait_until([&] { return architecture.threads_left_behind() == 0; }, "the thread's end");
  EXPECT_NO_THROW(commit(Transaction().set_property("late", "gain", 3.0)));
}

class OpenChangeTakes : public OpenChangeBeside, public ::testing::WithParamInterface<int> {};

/// 0: a new core; 1: and another end; 2: and a new shell.
TEST_P(OpenChangeTakes, ATakeThatHangsHasSafeOutputsThroughAllEndsOfItsOwn) {
  architecture.connect("b", "output", "r", "write");
  core(architecture.component("b")).work = [this] {
    core(architecture.component("b")).exposed_shell().output.write({7.0});
  };
  deploy();
  way.until([&] { return value_of("r") == 7.0; }, "a value");
  static_cast<LatestValue<Number>&>(architecture.resource("s")).write.write({5.0}, monotonic_now_ns());
  const auto doors = std::make_shared<Doors>();
  auto core = std::make_unique<HookedCore>();
  core->taking = [doors] { MAUVE_RT_TRUSTED(doors->pass()); };
  Transaction change;
  change.replace_core("b", std::move(core));
  const bool has_moved = GetParam() == 1;
  if (has_moved) change.disconnect("b", "output").connect("b", "output", "s", "write");
  if (GetParam() == 2) change.replace_shell("b", std::make_unique<TestShell>());
  EXPECT_NO_THROW(commit(change, {.commit_ns = ms_to_ns(200), .phase_ns = 0}));
  EXPECT_EQ(ComponentState::faulted, Hosted::state("b"));
  EXPECT_EQ(0.0, value_of(has_moved ? "s" : "r"));
  doors->open = true;
  wait_until([&] { return architecture.component("b").task().is_parked(); }, "the take's end");
  EXPECT_EQ(0.0, value_of(has_moved ? "s" : "r"));
}
INSTANTIATE_TEST_SUITE_P(All, OpenChangeTakes, ::testing::Values(0, 1, 2));

TEST_F(OpenChangeBeside, AnUrgentChangeComesBeforeAPreparationAndADryRun) {
  deploy();
  for (const bool is_dry : {true, false}) {
    const auto doors = std::make_shared<Doors>();
    const auto stop = host().prepare(std::move(Transaction().stop("b")));
    auto slow = std::async(std::launch::async, [&] {
      host().commit(std::move(Transaction().replace_core("b", std::make_unique<HangingCore>(doors))),
                    {.dry_run = is_dry});
    });
    wait_until([&] { return doors->entered.load(); }, "the hook");
    EXPECT_EQ(PreparedOutcome::committed, stop->commit(kLong)) << "while the hook lasts";
    EXPECT_EQ(ComponentState::stopped, Hosted::state("b"));
    doors->open = true;
    if (is_dry) {
      EXPECT_NO_THROW(slow.get());
    } else {
      EXPECT_EQ(ErrorCode::wrong_revision, refusal([&] { slow.get(); }).code());
    }
    stop->complete();
    host().start("b");
  }
}

TEST_F(OpenChangeBeside, AChangeWaitsForAPreparationNoLongerThanItsTimeout) {
  deploy();
  const auto doors = std::make_shared<Doors>();
  auto slow = std::async(std::launch::async, [&] {
    commit(Transaction().replace_core("b", std::make_unique<HangingCore>(doors)));
  });
  wait_until([&] { return doors->entered.load(); }, "the hook");
  const Error error = refusal([&] { commit(Transaction().set_property("b", "gain", 3.0), kShortly); });
  EXPECT_EQ(ErrorCode::timeout, error.code()) << error.what();
  doors->open = true;
  EXPECT_NO_THROW(slow.get());
}

TEST_F(OpenChangeBeside, ACleanupThatHangsHoldsNobody) {
  deploy();
  const auto doors = std::make_shared<Doors>();
  auto old = std::make_unique<HookedCore>();
  old->cleaning = [doors] { doors->pass(); };
  commit(Transaction().replace_core("b", std::move(old)));
  auto change = std::async(std::launch::async, [&] { commit(Transaction().replace_core("b", "t/Core")); });
  wait_until([&] { return doors->entered.load(); }, "the cleanup");
  EXPECT_NO_THROW(commit(Transaction().set_property("p", "gain", 3.0), kShortly));
  EXPECT_NO_THROW(commit(Transaction().set_property("b", "gain", 3.0), kShortly))
      << "of the same component, too";
  EXPECT_NO_THROW(commit(Transaction().remove_component("p").remove_resource("r")));
  const auto stop = host().prepare(std::move(Transaction().stop("b")));
  EXPECT_EQ(PreparedOutcome::committed, stop->commit(kLong));
  EXPECT_THAT(architecture.disposing().what, ::testing::HasSubstr("component b"));
  change.get();
  way.shutdown();
  EXPECT_FALSE(doors->open) << "and a shutdown";
  doors->open = true;
}

/// Of a dry run and of a refused change, whose shadow does not begin.
TEST_F(OpenChangeBeside, ACleanupOfAShadowThatHangsHoldsNobody) {
  deploy();
  for (const bool is_dry : {true, false}) {
    const auto doors = std::make_shared<Doors>();
    auto candidate = std::make_unique<HookedCore>();
    candidate->cleaning = [doors] { doors->pass(); };
    Transaction change;
    change.shadow("b", std::move(candidate), {.budget_ns = ms_to_ns(1)});
    if (!is_dry) change.replace_core("p", "t/Refusing");
    auto asked =
        std::async(std::launch::async, [&] { host().commit(std::move(change), {.dry_run = is_dry}); });
    wait_until([&] { return doors->entered.load(); }, "the cleanup");
    EXPECT_NO_THROW(commit(Transaction().set_property("b", "gain", 3.0), kShortly));
    if (is_dry) {
      EXPECT_NO_THROW(asked.get());
    } else {
      EXPECT_EQ(ErrorCode::adopt_refused, refusal([&] { asked.get(); }).code());
    }
    EXPECT_FALSE(doors->open) << "who asked is answered";
    doors->open = true;
  }
}

TEST_F(OpenChangeBeside, AStopByForceEndsAnAdoptThatHangs) {
  architecture.connect("b", "output", "r", "write");
  core(architecture.component("b")).work = [this] {
    core(architecture.component("b")).exposed_shell().output.write({7.0});
  };
  deploy();
  way.until([&] { return value_of("r") == 7.0; }, "a value");
  const auto doors = std::make_shared<Doors>();
  auto core = std::make_unique<HookedCore>();
  core->adopting = [doors] { doors->pass(); };
  auto change = std::async(std::launch::async, [&, fresh = std::move(core)]() mutable {
    return refusal([&] { commit(Transaction().replace_core("b", std::move(fresh)), {.commit_ns = kLong}); });
  });
  wait_until([&] { return doors->entered.load(); }, "the adopt");
  EXPECT_TRUE(host().stop("b", {.timeout_ns = ms_to_ns(20), .force = true}));
  EXPECT_EQ(ComponentState::faulted, Hosted::state("b"));
  EXPECT_EQ(0.0, value_of("r"));
  EXPECT_EQ(ErrorCode::wrong_revision, change.get().code()) << "the change is answered";
  EXPECT_FALSE(doors->open) << "while the adopt hangs";
  doors->open = true;
}

class OpenChangeBudgets : public OpenChangeBeside, public ::testing::WithParamInterface<bool> {};

TEST_P(OpenChangeBudgets, AHookThatHangsIsWatchedByItsBudget) {
  architecture.connect("b", "output", "r", "write");
  deploy();
  const auto doors = std::make_shared<Doors>();
  auto core = std::make_unique<HookedCore>();
  core->declared = us_to_ns(200);
  (GetParam() ? core->adopting : core->taking) = [doors] { MAUVE_RT_TRUSTED(doors->pass()); };
  auto change = std::async(std::launch::async, [&, fresh = std::move(core)]() mutable {
    host().commit(std::move(Transaction().replace_core("b", std::move(fresh))),
                  {.timeouts = {.commit_ns = kLong, .phase_ns = 0}});
  });
  wait_until([&] { return Hosted::state("b") == ComponentState::faulted; },
             "the watchdog, long before the timeout");
  EXPECT_EQ("adopt or take of its new part ran longer than its declared 200 us",
            architecture.component("b").task().fault().what);
  way.until([&] { return value_of("r") == 0.0; }, "safe outputs: FAULTED is shown first");
  if (GetParam()) {
    EXPECT_THROW(change.get(), Error);
  } else {
    EXPECT_NO_THROW(change.get()) << "it is made";
  }
  EXPECT_FALSE(doors->open);
  doors->open = true;
}
INSTANTIATE_TEST_SUITE_P(AdoptAndTake, OpenChangeBudgets, ::testing::Bool());

}  // namespace mauve::testing::test_open_change_beside
