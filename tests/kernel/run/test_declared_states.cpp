// SPDX-License-Identifier: LGPL-3.0-or-later
// Times of states that who uses an fsm declares, in the place of the fsm's own.
#include "hosts.hpp"

namespace mauve::testing::test_declared_states {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

/// Declares times itself.
struct OwnTimesFsm : TestFsm {
  void define() override {
    State& run = execution("Run", "act", &TestCore::act, ms_to_ns(7));
    run.simulated_execution_ns = us_to_ns(30);
    run.wcet_ns = ms_to_ns(2);
    State& more = execution("More", "act", &TestCore::act);
    State& pause = wait("Pause", ms_to_ns(2));
    set_initial(run);
    transition(run, "is_set", &TestCore::is_set, pause);
    next(run, more);
    next(more, pause);
    next(pause, run);
  }
};

template <typename Way>
class DeclaredStates : public Hosted<Way> {
 protected:
  DeclaredStates() { this->registry.template fsm<OwnTimesFsm>("t/OwnTimes", "t/Shell"); }

  static DescribedState state_of(const Component& component, const std::string& name) {
    for (DescribedState& state : component.described_states())
      if (state.name == name) return state;
    ADD_FAILURE() << "no state " << name;
    return {};
  }
  Error refused_at_configure(std::vector<DeclaredState> states) {
    this->add("c", 2, {.states = std::move(states)});
    return this->refusal([this] { this->architecture.configure(); });
  }
};
TYPED_TEST_SUITE(DeclaredStates, EveryHost, HostNames);

TYPED_TEST(DeclaredStates, StandInThePlaceOfTheFsmsOwn) {
  Component& component = this->add("c", 2, {.states = {{"Run", ms_to_ns(3), {}}}});
  component.allow({"t/OwnTimes"}, true);
  this->deploy();
  EXPECT_EQ(ms_to_ns(3), this->state_of(component, "Run").max_execution_ns);
  EXPECT_EQ(0, this->state_of(component, "Run").simulated_execution_ns) << "as the fsm says";
  Transaction other;
  other.replace_fsm("c", "t/OwnTimes");
  this->commit(other);
  EXPECT_EQ(ms_to_ns(3), this->state_of(component, "Run").max_execution_ns) << "also of a new fsm";
  EXPECT_EQ(us_to_ns(30), this->state_of(component, "Run").simulated_execution_ns) << "as the fsm says";
  EXPECT_EQ(0, this->state_of(component, "More").max_execution_ns);
}

TYPED_TEST(DeclaredStates, WorstCaseStandsInThePlaceOfTheFsmsOwn) {
  Component& component = this->add("c", 2, {.states = {{.name = "Run", .wcet_ns = ms_to_ns(3)}}});
  component.allow({"t/OwnTimes"}, true);
  this->deploy();
  EXPECT_EQ(ms_to_ns(3), this->state_of(component, "Run").wcet_ns);
  EXPECT_EQ(0, this->state_of(component, "Run").max_execution_ns) << "a worst case is no bound";
  EXPECT_EQ(0, this->state_of(component, "Pause").wcet_ns);
  Transaction other;
  other.replace_fsm("c", "t/OwnTimes");
  this->commit(other);
  EXPECT_EQ(ms_to_ns(3), this->state_of(component, "Run").wcet_ns) << "also of a new fsm";
  EXPECT_EQ(0, this->state_of(component, "More").wcet_ns);
}

TYPED_TEST(DeclaredStates, DescribeTheMachine) {
  Component& component = this->add("c");
  component.allow({"t/OwnTimes"}, true);
  EXPECT_TRUE(component.described_states().empty()) << "not configured";
  this->deploy();
  Transaction other;
  other.replace_fsm("c", "t/OwnTimes");
  this->commit(other);
  const auto states = component.described_states();
  ASSERT_EQ(3U, states.size());
  EXPECT_TRUE(states[0].is_initial);
  EXPECT_THAT(states[0].successors, ElementsAre("Pause", "More"));
  EXPECT_EQ(ms_to_ns(7), states[0].max_execution_ns);
  EXPECT_EQ(ms_to_ns(2), states[0].wcet_ns);
  EXPECT_TRUE(states[2].is_wait);
  EXPECT_FALSE(states[2].is_event_wait);
  EXPECT_EQ(ms_to_ns(2), states[2].duration_ns);
  EXPECT_THAT(states[2].successors, ElementsAre("Run"));
}

TYPED_TEST(DeclaredStates, BoundFaultsWhatLastsLonger) {
  std::atomic<bool> is_slow{false};
  Component& component = this->add("c", 2, {.states = {{"Run", ms_to_ns(1), ms_to_ns(0)}}});
  this->core(component).work = [&is_slow] {
    if (is_slow.load()) std::this_thread::sleep_for(std::chrono::milliseconds(20));
  };
  if (TestFixture::is_virtual) GTEST_SKIP() << "in virtual time a state takes what it declares";
  this->deploy();
  this->run_for(ms_to_ns(10));
  is_slow.store(true);
  this->way.until([&] { return this->state("c") == ComponentState::faulted; }, "the fault");
  this->way.shutdown();
}

TYPED_TEST(DeclaredStates, NothingEnforcesTheWorstCase) {
  Component& component = this->add("c", 2, {.states = {{.name = "Run", .wcet_ns = 1}}});
  if (!TestFixture::is_virtual) {
    this->core(component).work = [] { std::this_thread::sleep_for(std::chrono::milliseconds(5)); };
  }
  this->deploy();
  this->run_for(ms_to_ns(30));
  EXPECT_EQ(ComponentState::running, this->state("c"));
  EXPECT_EQ("", component.task().fault().what);
  EXPECT_LT(0, this->core(component).runs);
  this->way.shutdown();
}

TYPED_TEST(DeclaredStates, WorstCaseTakesNoVirtualTime) {
  if (!TestFixture::is_virtual) GTEST_SKIP() << "on threads a state takes what it takes";
  Component& component = this->add("c", 2, {.states = {{.name = "Run", .wcet_ns = ms_to_ns(3)}}});
  this->deploy();
  this->run_for(ms_to_ns(20));
  EXPECT_EQ(0U, component.task().statistics().overruns.load());
}

TYPED_TEST(DeclaredStates, TimeInVirtualTimeIsNoBound) {
  if (!TestFixture::is_virtual) GTEST_SKIP() << "on threads a state takes what it takes";
  Component& bounded = this->add("bounded", 2, {.states = {{"Run", ms_to_ns(1), {}}}});
  this->add("costly", 2, {.states = {{"Run", {}, ms_to_ns(3)}}});
  this->deploy();
  this->run_for(ms_to_ns(20));
  EXPECT_EQ(0U, bounded.task().statistics().overruns.load()) << "a bound costs no time";
  EXPECT_LT(0U, this->architecture.component("costly").task().statistics().overruns.load());
  EXPECT_EQ(ComponentState::running, this->state("costly"));
}

TYPED_TEST(DeclaredStates, UnknownOnesAreRefused) {
  const Error unknown = this->refused_at_configure({{"Rum", ms_to_ns(1), {}}});
  EXPECT_EQ(ErrorCode::bad_fsm, unknown.code());
  EXPECT_THAT(unknown.what(), HasSubstr("component 'c'"));
  EXPECT_THAT(unknown.what(), HasSubstr("no such execution state; expected one of Run, found Rum"));
}

TYPED_TEST(DeclaredStates, AWaitHasNoTimes) {
  EXPECT_THAT(this->refused_at_configure({{"Pause", ms_to_ns(1), {}}}).what(), HasSubstr("found Pause"));
}

TYPED_TEST(DeclaredStates, AWaitWithoutAGuardHasNoWorstCase) {
  EXPECT_THAT(this->refused_at_configure({{.name = "Pause", .wcet_ns = 1}}).what(), HasSubstr("found Pause"));
}

TYPED_TEST(DeclaredStates, TimesThatCannotBeAreRefused) {
  const auto why = [&](std::vector<DeclaredState> states) {
    return std::string(this->refusal([&] { this->add("c", 2, {.states = std::move(states)}); }).what());
  };
  EXPECT_THAT(why({{"Run", 0, {}}}), HasSubstr("state Run, max_execution_ns"));
  EXPECT_THAT(why({{"Run", -1, {}}}), HasSubstr("expected 1 to"));
  EXPECT_THAT(why({{"Run", {}, -1}}),
              HasSubstr("state Run, simulated_execution_ns: a state's time is out of range; expected 0 to"));
  EXPECT_THAT(why({{.name = "Run", .wcet_ns = 0}}), HasSubstr("state Run, wcet_ns"));
  EXPECT_THAT(why({{.name = "Run", .wcet_ns = -1}}), HasSubstr("expected 1 to"));
  EXPECT_THAT(why({{"Run", 1, {}}, {"Run", 2, {}}}), HasSubstr("declared twice"));
}

TYPED_TEST(DeclaredStates, WorstCaseAboveTheBoundIsRefused) {
  const Error declared = this->refusal(
      [this] { this->add("c", 2, {.states = {{.name = "Run", .max_execution_ns = 10, .wcet_ns = 11}}}); });
  EXPECT_EQ(ErrorCode::out_of_range, declared.code());
  EXPECT_THAT(
      declared.what(),
      HasSubstr("component 'c': state Run, wcet_ns: the worst-case execution time of a state is longer "
                "than its bound; expected at most max_execution_ns, which is 10 ns, found 11; lower"));
  Component& component = this->add("c", 2, {.states = {{"Run", 10, {}, 10}}});
  component.allow({"t/OwnTimes"}, true);
  this->architecture.configure();
}

/// The bound of the one comes from the fsm's code, of the other from the declaration.
TYPED_TEST(DeclaredStates, WorstCaseAboveTheFsmsOwnBoundIsRefused) {
  Component& component = this->add("c", 2, {.states = {{.name = "Run", .wcet_ns = ms_to_ns(8)}}});
  component.allow({"t/OwnTimes"}, true);
  this->deploy();
  Transaction other;
  other.replace_fsm("c", "t/OwnTimes");
  const Error above = this->refusal([&] { this->commit(other); });
  EXPECT_THAT(above.what(),
              HasSubstr("expected at most max_execution_ns, which is 7000000 ns, found 8000000"));
  EXPECT_EQ(ms_to_ns(8), this->state_of(component, "Run").wcet_ns) << "the old fsm goes on";
}

TEST(Deadline, IsCheckedAndKept) {
  const auto refused = [](time_ns_t deadline_ns) {
    try {
      check_settings({.deadline_ns = deadline_ns}, "c");
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ("", refused(0));
  EXPECT_EQ("", refused(1));
  EXPECT_THAT(refused(-1), HasSubstr("deadline_ns"));
}

}  // namespace mauve::testing::test_declared_states
