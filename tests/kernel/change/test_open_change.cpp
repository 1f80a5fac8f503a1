// SPDX-License-Identifier: LGPL-3.0-or-later
// A change that is made is what the architecture is, also while a component is late to take it.
#include "open_change_fixtures.hpp"

namespace mauve::testing::test_open_change {

using namespace open_change;

struct EventShell : Shell {
  ReadPort<EventCount>& input = read_port<EventCount>("input").optional();
};
struct EventCore : Core<EventShell> {
  std::atomic<int> runs{0};
  void act() { ++runs; }
};
struct EventFsm : Fsm<EventShell, EventCore> {
  void define() override {
    State& run = execution("Run", "act", &EventCore::act);
    State& pause = wait_event("Pause", shell().input, s_to_ns(1000), us_to_ns(100));
    set_initial(pause);
    next(run, pause);
    next(pause, run);
  }
};

TYPED_TEST_SUITE(OpenChange, EveryHost, HostNames);

TYPED_TEST(OpenChange, AnInnocentChangesAgainAtOnce) {
  this->deploy();
  this->make_late();
  EXPECT_NO_THROW(this->commit(Transaction().set_property("b", "gain", 3.0)));
  EXPECT_NO_THROW(this->commit(Transaction().replace_core("b", "t/Counting")));
  EXPECT_EQ("t/Counting", this->architecture.component("b").core_implementation());
  EXPECT_FALSE(this->has_taken());
  const Error error =
      this->refusal([&] { this->commit(Transaction().set_property("late", "gain", 5.0), kShortly); });
  EXPECT_EQ(ErrorCode::timeout, error.code());
  EXPECT_EQ("late", error.detail().component) << error.what();
  this->await_taken();
  EXPECT_NO_THROW(this->commit(Transaction().set_property("late", "gain", 5.0)));
}

TYPED_TEST(OpenChange, APreparedStopOfAnInnocentIsMade) {
  this->deploy();
  const auto armed = this->host().prepare(std::move(Transaction().stop("b")));
  this->make_late();
  EXPECT_TRUE(armed->is_current()) << "a change of its core does not make a stop stale";
  EXPECT_NO_THROW(this->host().prepare(std::move(Transaction().stop("b")))) << "prepared anew";
  EXPECT_EQ(PreparedOutcome::committed, armed->commit(kLong));
  EXPECT_EQ(ComponentState::stopped, this->state("b"));
  EXPECT_FALSE(this->has_taken());
  armed->complete();
  this->await_taken();
}

TYPED_TEST(OpenChange, WhatItAddsIsListedStoppedAndRemoved) {
  this->deploy();
  Transaction change;
  change.set_property("late", "gain", 2.0).add_component("new", new_parts()).start("new");
  change.add_resource("data", std::make_unique<SharedData<Number>>());
  this->make_late(std::move(change));
  EXPECT_THAT(this->listed(), ::testing::Contains("new"));
  EXPECT_NE(nullptr, this->architecture.find_resource("data"));
  this->host().stop("new", kLong);
  EXPECT_EQ(ComponentState::stopped, this->state("new"));
  EXPECT_EQ(ErrorCode::duplicate_name,
            this->refusal([&] { this->commit(Transaction().add_component("new", new_parts())); }).code());
  EXPECT_NO_THROW(this->commit(Transaction().remove_component("new").remove_resource("data")));
  EXPECT_THAT(this->listed(), ::testing::Not(::testing::Contains("new")));
  EXPECT_FALSE(this->has_taken());
}

TYPED_TEST(OpenChange, WhatItRemovesIsNotListedAndNeverStarts) {
  this->deploy();
  const auto removed = this->architecture.hold_component("p");
  this->make_late(std::move(Transaction().set_property("late", "gain", 2.0).remove_component("p")));
  EXPECT_THAT(this->listed(), ::testing::Not(::testing::Contains("p")));
  EXPECT_EQ(ErrorCode::unknown_component, this->refusal([&] { this->host().start("p"); }).code());
  EXPECT_EQ(ErrorCode::unknown_component, this->refusal([&] { removed->task().start(); }).code());
  EXPECT_NE(ComponentState::running, removed->task().state());
  EXPECT_NO_THROW(this->commit(Transaction().add_component("p", new_parts()))) << "its name is free";
}

TYPED_TEST(OpenChange, AResourceThatALateOneIsToUseIsConnected) {
  this->architecture.connect("late", "input", "r", "read");
  this->deploy();
  Transaction change;
  change.set_property("late", "gain", 2.0).disconnect("late", "input").connect("late", "input", "s", "read");
  this->make_late(std::move(change));
  const Error error = this->refusal([&] { this->commit(Transaction().remove_resource("s")); });
  EXPECT_EQ("late.input", error.detail().found) << error.what();
  EXPECT_NO_THROW(this->commit(Transaction().remove_resource("r"))) << "no wire leads there any more";
  EXPECT_EQ(nullptr, this->architecture.find_resource("r"));
  this->pass_time();  // the late one reads it still
  this->await_taken();
  EXPECT_EQ("s", this->late->template shell_as<TestShell>().input.resource_name());
}

TYPED_TEST(OpenChange, ARemovedResourceIsNotConnectedAgain) {
  this->deploy();
  this->make_late(std::move(Transaction().set_property("late", "gain", 2.0).remove_resource("r")));
  EXPECT_EQ(ErrorCode::unknown_resource,
            this->refusal([&] { this->commit(Transaction().connect("p", "input", "r", "read")); }).code());
}

TYPED_TEST(OpenChange, AWritersEndHasOneOwner) {
  this->architecture.connect("p", "output", "r", "write");
  this->deploy();
  Transaction change;
  change.set_property("late", "gain", 2.0).disconnect("p", "output").connect("late", "output", "r", "write");
  this->make_late(std::move(change));
  EXPECT_EQ(ErrorCode::invalid_argument,
            this->refusal([&] { this->commit(Transaction().connect("b", "output", "r", "write")); }).code());
  this->await_taken();
}

TYPED_TEST(OpenChange, WhatALateOneWritesReplacesNoValueOfALaterOwner) {
  this->architecture.connect("late", "output", "r", "write");
  this->after_doors = [this] { this->core(*this->late).exposed_shell().output.write({-1.0}); };
  this->core(this->architecture.component("p")).work = [this] {
    this->core(this->architecture.component("p")).exposed_shell().output.write({1.0});
  };
  this->deploy();
  this->make_late(std::move(Transaction().set_property("late", "gain", 2.0).disconnect("late", "output")));
  const auto second = this->commit(Transaction().connect("p", "output", "r", "write"));
  EXPECT_LT(this->first.instant_ns, second.instant_ns) << "a change that builds on another lies later";
  this->way.until([&] { return this->value_of("r") == 1.0; }, "the new owner to write");
  this->await_taken();
  EXPECT_EQ(1.0, this->value_of("r"));
}

TYPED_TEST(OpenChange, EventsOfTheOldResourceReleaseNobody) {
  this->architecture.template add_resource<EventCounter>("old");
  this->architecture.template add_resource<EventCounter>("new");
  this->architecture.template add_component<EventShell, EventCore, EventFsm>("x");
  this->architecture.connect("x", "input", "old", "read");
  this->deploy();
  const auto raise = [this](const char* name) {
    static_cast<EventCounter&>(this->architecture.resource(name)).raise.raise(this->host().now_ns());
    this->pass_time();
  };
  Component& x = this->architecture.component("x");
  auto& runs = x.core_as<EventCore>().runs;
  raise("old");
  this->way.until([&] { return runs == 1; }, "an event");
  Transaction change;
  change.set_property("late", "gain", 2.0).disconnect("x", "input").connect("x", "input", "new", "read");
  this->make_late(std::move(change));
  const int before = runs;
  raise("old");
  raise("old");
  EXPECT_EQ(before, runs);
  raise("new");
  this->way.until([&] { return runs == before + 1; }, "an event of the new one");
  this->await_taken();
  raise("old");
  EXPECT_EQ(before + 1, runs);
  raise("new");
  this->way.until([&] { return runs == before + 2; }, "an event after the settlement");
}

TYPED_TEST(OpenChange, AProbationBeginsWithItsOwnComponent) {
  this->deploy();
  Transaction change;
  change.set_property("late", "gain", 2.0)
      .replace_core("p", std::make_unique<TestCore>(), ProbationOptions{.duration_ns = kLong});
  this->make_late(std::move(change));
  EXPECT_EQ(1U, this->host().probations().size());
  EXPECT_TRUE(this->host().revert_probation("p", "the operator", TestFixture::is_virtual ? 0 : kLong));
  EXPECT_EQ("t/Core", this->architecture.component("p").core_implementation());
  this->await_taken();
  this->host().settle_probations();
  ASSERT_EQ(1U, this->host().probations().size());
  EXPECT_EQ(ProbationVerdict::reverted, this->host().probations().front().verdict);
}

TYPED_TEST(OpenChange, ANewEpochLeavesOutWhoIsLate) {
  this->deploy();
  this->make_late();
  EXPECT_NO_THROW(this->commit(Transaction().resynchronise()));
  EXPECT_FALSE(this->has_taken());
  this->await_taken();
}

TYPED_TEST(OpenChange, ALateOneTakesTheNewEpochAtItsNextStart) {
  this->deploy();
  this->make_late();
  const time_ns_t before_ns = this->late->task().grid().reference_ns;
  this->commit(Transaction().resynchronise());
  this->await_taken();
  EXPECT_EQ(before_ns, this->late->task().grid().reference_ns) << "it keeps its grid while it runs";
  this->host().stop("late", kLong);
  this->host().start("late");
  EXPECT_EQ(this->architecture.deployment_epoch_ns(), this->late->task().grid().reference_ns);
}

TYPED_TEST(OpenChange, OneThatIsLateToAnEpochStartsOnTheLatestOne) {
  this->deploy();
  this->make_late(std::move(Transaction().set_property("late", "gain", 2.0).resynchronise()));
  const time_ns_t first_ns = this->architecture.deployment_epoch_ns();
  this->pass_time();
  this->commit(Transaction().resynchronise());
  EXPECT_GT(this->architecture.deployment_epoch_ns(), first_ns);
  this->await_taken();
  EXPECT_EQ(first_ns, this->late->task().grid().reference_ns) << "of the change that it took";
  this->host().stop("late", kLong);
  this->host().start("late");
  EXPECT_EQ(this->architecture.deployment_epoch_ns(), this->late->task().grid().reference_ns);
}

TYPED_TEST(OpenChange, AReaderThatComesAsAnotherOneGoesHasAPlaceOfItsOwn) {
  this->architecture.template add_resource<SharedData<Number>>("shared");
  this->architecture.connect("b", "input", "shared", "read");
  this->deploy();
  std::string on = "b";
  std::string off = "p";
  for (int round = 0; round < 20; ++round) {
    this->commit(Transaction().disconnect(on, "input").connect(off, "input", "shared", "read"));
    std::swap(on, off);
    EXPECT_TRUE(this->architecture.component(on).shell().find_port("input")->is_seated()) << round;
  }
}

}  // namespace mauve::testing::test_open_change
