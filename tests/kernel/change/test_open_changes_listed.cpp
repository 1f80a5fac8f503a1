// SPDX-License-Identifier: LGPL-3.0-or-later
// The list of open changes, and the way out of one.
#include <future>

#include "open_change_fixtures.hpp"

namespace mauve::testing::test_open_changes_listed {

using namespace open_change;

template <typename Way>
class OpenChangeListed : public OpenChange<Way> {};
TYPED_TEST_SUITE(OpenChangeListed, EveryHost, HostNames);

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

std::vector<std::string> names_of(const std::vector<LateComponent>& components) {
  std::vector<std::string> names;
  for (const LateComponent& component : components) names.push_back(component.name);
  return names;
}

TYPED_TEST(OpenChangeListed, IsToldUntilTheLastComponentHasTakenIt) {
  this->deploy();
  EXPECT_THAT(this->host().open_changes(), IsEmpty());
  this->make_late(std::move(Transaction().set_property("late", "gain", 2.0).by("the operator")));
  const auto open = this->host().open_changes();
  ASSERT_THAT(open, SizeIs(1));
  EXPECT_EQ("the operator", open.front().author);
  EXPECT_THAT(open.front().steps, SizeIs(2));
  EXPECT_EQ(OpenChangePhase::made, open.front().phase);
  EXPECT_EQ(this->first.instant_ns, open.front().instant_ns);
  EXPECT_LE(open.front().begun_ns, this->host().now_ns());
  EXPECT_LT(0, open.front().begun_ns);
  EXPECT_THAT(names_of(open.front().late), ElementsAre("late"));
  EXPECT_FALSE(open.front().late.front().state.state.empty());
  EXPECT_FALSE(open.front().late.front().left_behind);
  this->await_taken();
  EXPECT_THAT(this->host().open_changes(), IsEmpty());
}

TYPED_TEST(OpenChangeListed, TheComponentThatItWaitsForIsAbandonedAndRemoved) {
  this->deploy();
  this->make_late();
  const Abandoned done = this->host().abandon("late");
  EXPECT_EQ(TestFixture::is_virtual ? Abandoned::stopped : Abandoned::faulted, done);
  if (!TestFixture::is_virtual) {  // in virtual time the stop takes the change first
    EXPECT_EQ(ComponentState::faulted, this->state("late"));
    EXPECT_TRUE(this->host().open_changes().front().late.front().left_behind);
    EXPECT_EQ(ErrorCode::faulted, this->refusal([&] { this->host().abandon("late"); }).code());
  }
  EXPECT_NO_THROW(this->commit(Transaction().remove_component("late")));
  EXPECT_THAT(this->listed(), ::testing::Not(::testing::Contains("late")));
  this->late = nullptr;
}

TYPED_TEST(OpenChangeListed, AComponentForWhichNothingWaitsIsNotAbandoned) {
  this->deploy();
  EXPECT_EQ(ErrorCode::not_running, this->refusal([&] { this->host().abandon("p"); }).code());
  EXPECT_EQ(ErrorCode::unknown_component, this->refusal([&] { this->host().abandon("nobody"); }).code());
  EXPECT_EQ(ComponentState::running, this->state("p"));
}

TEST_F(OpenChangeBeside, AComponentThatAChangeRemovesIsAbandonedByItsName) {
  deploy();
  const auto removed = architecture.hold_component("late");
  make_late(std::move(Transaction().set_property("p", "gain", 2.0).remove_component("late")));
  EXPECT_EQ(nullptr, architecture.find_component("late"));
  EXPECT_EQ(Abandoned::faulted, host().abandon("late"));
  EXPECT_EQ(ComponentState::faulted, removed->task().state());
}

TEST_F(OpenChangeBeside, OneThatIsNotDecidedIsCalledOff) {
  deploy();
  way.until([&] { return core(*late).runs > 5; }, "the one that will be late");
  held->is_armed = true;
  wait_until([&] { return held->doors.entered.load(); }, "the late one to be in its state");
  auto change = std::async(std::launch::async, [&] {
    return refusal([&] {
      commit(Transaction().set_property("late", "gain", 2.0).set_property("b", "gain", 2.0),
             {.commit_ns = kLong});
    });
  });
  const auto is_awaited = [&] {
    const auto open = host().open_changes();
    return open.size() == 1 && open.front().phase == OpenChangePhase::waiting &&
           names_of(open.front().late) == std::vector<std::string>{"late"};
  };
  wait_until(is_awaited, "the vote of b alone");
  EXPECT_EQ(Abandoned::called_off, host().abandon("late"));
  const Error error = change.get();
  EXPECT_EQ(ErrorCode::wrong_revision, error.code());
  EXPECT_EQ("late", error.detail().component) << error.what();
  EXPECT_THAT(host().open_changes(), IsEmpty());
  EXPECT_EQ(ComponentState::running, state("late")) << "it is not given up";
}

TEST_F(OpenChangeBeside, AnAdoptThatHangsIsGivenUpWithItsChange) {
  deploy();
  const auto doors = std::make_shared<Doors>();
  auto fresh = std::make_unique<HookedCore>();
  fresh->adopting = [doors] { doors->pass(); };
  auto change = std::async(std::launch::async, [&, ready = std::move(fresh)]() mutable {
    return refusal([&] { commit(Transaction().replace_core("b", std::move(ready)), {.commit_ns = kLong}); });
  });
  wait_until([&] { return doors->entered.load(); }, "the adopt");
  EXPECT_EQ(Abandoned::called_off, host().abandon("b"));
  EXPECT_EQ(ErrorCode::faulted, change.get().code());
  EXPECT_EQ(ComponentState::faulted, state("b"));
  EXPECT_FALSE(doors->open) << "while the adopt hangs";
  doors->open = true;
}

TEST_F(OpenChangeBeside, AHungPreparationAndAHeldChangeLockKeepNobodyFromTheList) {
  deploy();
  const auto doors = std::make_shared<Doors>();
  auto slow = std::async(std::launch::async, [&] {
    return refusal([&] { commit(Transaction().replace_core("b", std::make_unique<HangingCore>(doors))); });
  });
  wait_until([&] { return doors->entered.load(); }, "the hook");
  Doors locked;
  auto holder = std::async(std::launch::async, [&] {
    const std::lock_guard change(architecture.change_lock());
    locked.pass();
  });
  wait_until([&] { return locked.entered.load(); }, "the change lock");
  const auto open = host().open_changes();
  ASSERT_THAT(open, SizeIs(1));
  EXPECT_EQ(OpenChangePhase::preparing, open.front().phase);
  EXPECT_THAT(open.front().hook, ::testing::StartsWith("configure of core"));
  EXPECT_LT(0, open.front().hook_age_ns);
  EXPECT_THAT(open.front().late, IsEmpty());
  EXPECT_EQ(Abandoned::called_off, host().abandon("b"));
  locked.open = true;
  EXPECT_EQ(ErrorCode::wrong_revision, slow.get().code());
  doors->open = true;
  wait_until([&] { return host().open_changes().empty(); }, "the end of the hook");
}

TEST_F(OpenChangeBeside, APreparedOneIsToldWhileItIsCommittedAndUntilItIsSettled) {
  deploy();
  way.until([&] { return core(*late).runs > 5; }, "the one that will be late");
  const auto agree = std::make_shared<Doors>();
  auto fresh = std::make_unique<HookedCore>();
  fresh->adopting = [agree] { agree->pass(); };
  Transaction change;
  change.set_property("late", "gain", 2.0).replace_core("b", std::move(fresh)).by("rule r");
  const auto armed = host().prepare(std::move(change));
  EXPECT_THAT(host().open_changes(), IsEmpty()) << "it is prepared, and nothing more";
  const time_ns_t before = host().now_ns();
  auto outcome = std::async(std::launch::async, [&] { return armed->commit(kLong); });
  wait_until([&] { return agree->entered.load(); }, "the adopt of b");
  const int runs = core(*late).runs;
  wait_until([&] { return core(*late).runs > runs + 5; }, "the late one to vote");
  auto open = host().open_changes();
  ASSERT_THAT(open, SizeIs(1));
  EXPECT_EQ(OpenChangePhase::waiting, open.front().phase);
  EXPECT_LE(before, open.front().begun_ns) << "when it was committed";
  EXPECT_THAT(names_of(open.front().late), ElementsAre("b"));
  held->is_armed = true;
  wait_until([&] { return held->doors.entered.load(); }, "the late one to be in its state");
  agree->open = true;
  wait_until([&] { return host().open_changes().front().phase == OpenChangePhase::made; }, "the decision");
  wait_until([&] { return names_of(host().open_changes().front().late) == std::vector<std::string>{"late"}; },
             "b");
  EXPECT_EQ("rule r", host().open_changes().front().author);
  let_it_go_on();
  EXPECT_EQ(PreparedOutcome::committed, outcome.get());
  armed->complete();
  EXPECT_THAT(host().open_changes(), IsEmpty());
}

TEST_F(OpenChangeBeside, APreparedOneThatIsNotMadeSaysWhyAfterOthersWereSettled) {
  deploy();
  auto fresh = std::make_unique<HookedCore>();
  fresh->adopting = [] { throw std::runtime_error("the new core is not ready"); };
  const auto armed = host().prepare(std::move(Transaction().replace_core("b", std::move(fresh))));
  EXPECT_EQ(PreparedOutcome::refused, armed->commit(kLong));
  EXPECT_THAT(host().open_changes(), IsEmpty());
  EXPECT_NO_THROW(commit(Transaction().set_property("p", "gain", 3.0))) << "settles what can be settled";
  EXPECT_THAT(refusal([&] { armed->complete(); }).what(), ::testing::HasSubstr("the new core is not ready"));
}

TEST_F(OpenChangeBeside, WhoLooksDisturbsNoChange) {
  deploy();
  std::atomic<bool> is_over{false};
  auto looking = std::async(std::launch::async, [&] {
    std::size_t most = 0;
    while (!is_over) most = std::max(most, host().open_changes().size());
    return most;
  });
  for (int round = 0; round < 10; ++round) {
    commit(Transaction().replace_core("b", "t/Counting").set_property("p", "gain", 1.0 + round));
    commit(Transaction().add_component("new", new_parts()).start("new"));
    const auto armed = host().prepare(std::move(Transaction().replace_core("b", "t/Core").stop("new")));
    EXPECT_EQ(PreparedOutcome::committed, armed->commit(kLong));
    armed->complete();
    commit(Transaction().remove_component("new"));
  }
  is_over = true;
  EXPECT_GE(1U, looking.get());
  EXPECT_THAT(host().open_changes(), IsEmpty());
}

}  // namespace mauve::testing::test_open_changes_listed
