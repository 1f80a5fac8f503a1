// SPDX-License-Identifier: LGPL-3.0-or-later
// Worst-case execution times of a core's methods, and what the states of its component take of them.
#include "hosts.hpp"

namespace mauve::testing::test_core_times {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Pair;

/// Run asks a guard after its action, and Pause when it has ended; Bounded has a bound, Own a worst case of the fsm.
struct GuardedFsm : TestFsm {
  void define() override {
    State& run = execution("Run", "act", &TestCore::act);
    State& bounded = execution("Bounded", "act", &TestCore::act, ms_to_ns(5));
    State& own = execution("Own", "act", &TestCore::act);
    own.wcet_ns = us_to_ns(70);
    State& pause = wait("Pause", ms_to_ns(2));
    set_initial(run);
    transition(run, "is_set", &TestCore::is_set, bounded);
    next(run, bounded);
    next(bounded, own);
    next(own, pause);
    transition(pause, "is_set", &TestCore::is_set, run);
    next(pause, run);
  }
};

/// A core of another class.
struct OtherCore : TestCore {};

template <typename Way>
class CoreTimesOfStates : public Hosted<Way> {
 protected:
  CoreTimesOfStates() {
    auto& registry = this->registry;
    registry.template fsm<GuardedFsm>("t/Guarded", "t/Shell");
    registry.template core<TestCore>("t/Timed", "t/Shell",
                                     {.wcet_ns = {{"act", us_to_ns(300)}, {"is_set", us_to_ns(2)}}});
    registry.template core<OtherCore>("t/Slower", "t/Shell",
                                      {.wcet_ns = {{"act", us_to_ns(900)}, {"is_set", us_to_ns(1)}}});
    registry.template core<OtherCore>("t/Partly", "t/Shell", {.wcet_ns = {{"act", us_to_ns(300)}}});
    registry.template core<OtherCore>("t/TooSlow", "t/Shell",
                                      {.wcet_ns = {{"act", ms_to_ns(6)}, {"is_set", us_to_ns(1)}}});
  }
  Component& add_guarded(const std::string& core, TaskSettings settings = {}) {
    settings.cpus = {kComponentsCpu};
    Component& component =
        this->architecture.add_component("c", "t/Shell", core, "t/Guarded", std::move(settings));
    component.allow({Component::any_core, "t/Fsm", "t/Guarded"}, true);
    return component;
  }
  static DescribedState state_of(const std::vector<DescribedState>& states, const std::string& name) {
    for (const DescribedState& state : states)
      if (state.name == name) return state;
    ADD_FAILURE() << "no state " << name;
    return {};
  }
  static time_ns_t wcet_of(const Component& component, const std::string& name) {
    return state_of(component.described_states(), name).wcet_ns;
  }
  /// Of all execution states.
  static std::vector<time_ns_t> wcets(const std::vector<DescribedState>& states) {
    return {state_of(states, "Run").wcet_ns, state_of(states, "Bounded").wcet_ns,
            state_of(states, "Own").wcet_ns};
  }
};
TYPED_TEST_SUITE(CoreTimesOfStates, EveryHost, HostNames);

TYPED_TEST(CoreTimesOfStates, AreSummedOverTheActionAndTheGuardsOfAState) {
  Component& component = this->add_guarded("t/Timed");
  const auto wanted = ElementsAre(us_to_ns(302), us_to_ns(300), us_to_ns(70));
  const auto previewed = component.previewed_states();
  EXPECT_THAT(this->wcets(previewed), wanted) << "before it is configured";
  EXPECT_EQ("t/Timed", this->state_of(previewed, "Run").wcet_core);
  EXPECT_EQ("", this->state_of(previewed, "Own").wcet_core) << "the fsm declares it";
  this->deploy();
  EXPECT_THAT(this->wcets(component.described_states()), wanted);
}

TYPED_TEST(CoreTimesOfStates, OfAWaitAreThoseOfItsGuards) {
  Component& component = this->add_guarded("t/Timed");
  const auto previewed = component.previewed_states();
  EXPECT_EQ(us_to_ns(2), this->state_of(previewed, "Pause").wcet_ns);
  EXPECT_EQ("t/Timed", this->state_of(previewed, "Pause").wcet_core);
  this->deploy();
  EXPECT_EQ(us_to_ns(2), this->wcet_of(component, "Pause"));
}

TYPED_TEST(CoreTimesOfStates, OfAWaitYieldToTheSettings) {
  Component& component =
      this->add_guarded("t/Timed", {.states = {{.name = "Pause", .wcet_ns = us_to_ns(9)}}});
  EXPECT_EQ(us_to_ns(9), this->state_of(component.previewed_states(), "Pause").wcet_ns);
  this->deploy();
  EXPECT_EQ(us_to_ns(9), this->wcet_of(component, "Pause"));
  EXPECT_EQ(us_to_ns(302), this->wcet_of(component, "Run"));
}

TYPED_TEST(CoreTimesOfStates, AWaitTakesNoOtherTime) {
  this->add_guarded("t/Timed", {.states = {{.name = "Pause", .max_execution_ns = us_to_ns(9)}}});
  EXPECT_THAT(this->refusal([this] { this->architecture.configure(); }).what(), HasSubstr("found Pause"));
}

TYPED_TEST(CoreTimesOfStates, YieldToTheSettingsAndTheFsm) {
  Component& component = this->add_guarded("t/Timed", {.states = {{.name = "Run", .wcet_ns = us_to_ns(10)},
                                                                  {.name = "Own", .wcet_ns = us_to_ns(20)}}});
  this->deploy();
  EXPECT_THAT(this->wcets(component.described_states()),
              ElementsAre(us_to_ns(10), us_to_ns(300), us_to_ns(20)));
  EXPECT_EQ("", this->state_of(component.described_states(), "Run").wcet_core);
}

TYPED_TEST(CoreTimesOfStates, MissingOnesAreNoZeros) {
  Component& component = this->add_guarded("t/Partly");
  this->deploy();
  const auto states = component.described_states();
  EXPECT_THAT(this->wcets(states), ElementsAre(0, us_to_ns(300), us_to_ns(70)));
  EXPECT_THAT(this->state_of(states, "Run").methods_without_wcet, ElementsAre("is_set"));
  EXPECT_THAT(this->state_of(states, "Bounded").methods_without_wcet, IsEmpty());
  EXPECT_THAT(this->state_of(states, "Pause").methods_without_wcet, ElementsAre("is_set"));
}

TYPED_TEST(CoreTimesOfStates, AreNotDeclaredWhereTheCoreDeclaresNone) {
  Component& component = this->add_guarded("t/Core");
  this->deploy();
  const auto states = component.described_states();
  EXPECT_THAT(this->wcets(states), ElementsAre(0, 0, us_to_ns(70)));
  EXPECT_THAT(this->state_of(states, "Run").methods_without_wcet, IsEmpty());
}

TYPED_TEST(CoreTimesOfStates, FollowAReplacementOfTheCore) {
  Component& component = this->add_guarded("t/Timed");
  this->deploy();
  this->run_for(ms_to_ns(10));
  Transaction other;
  other.replace_core("c", "t/Slower");
  this->commit(other);
  EXPECT_EQ(us_to_ns(901), this->wcet_of(component, "Run"));
  EXPECT_EQ("t/Slower", this->state_of(component.described_states(), "Run").wcet_core);
  Transaction back;
  back.replace_core("c", "t/Core");
  this->commit(back);
  EXPECT_EQ(0, this->wcet_of(component, "Run"));
}

TYPED_TEST(CoreTimesOfStates, FollowAFallback) {
  Component& component = this->add_guarded("t/Timed");
  component.set_fallback(this->registry.make_core("t/Slower"));
  std::atomic<bool> is_broken{false};
  this->core(component).work = [&is_broken] {
    if (is_broken.load()) throw std::runtime_error("broken");
  };
  this->deploy();
  this->run_for(ms_to_ns(10));
  EXPECT_EQ(us_to_ns(302), this->wcet_of(component, "Run"));
  is_broken.store(true);
  this->way.until([&] { return component.task().has_fallen_back(); }, "the fallback");
  EXPECT_EQ(us_to_ns(901), this->wcet_of(component, "Run"));
  EXPECT_EQ("t/Slower", component.shown().core);
  EXPECT_EQ("t/Timed", component.faulted_core());
  this->way.shutdown();
}

TYPED_TEST(CoreTimesOfStates, FollowAReplacementOfTheFsm) {
  Component& component = this->add_guarded("t/Timed");
  this->deploy();
  Transaction other;
  other.replace_fsm("c", "t/Fsm");
  this->commit(other);
  EXPECT_EQ(us_to_ns(300), this->wcet_of(component, "Run")) << "this fsm asks no guard after it";
}

TYPED_TEST(CoreTimesOfStates, AboveABoundAreRefused) {
  Component& component = this->add_guarded("t/TooSlow");
  const auto is_clear = HasSubstr(
      "component 'c': state Bounded, wcet_ns: the worst-case execution time of a state is longer than its "
      "bound; expected at most max_execution_ns, which is 5000000 ns, found 6000000, declared by core "
      "t/TooSlow; lower wcet_ns, or raise max_execution_ns");
  const Error previewed = this->refusal([&] { component.previewed_states(); });
  EXPECT_EQ(ErrorCode::out_of_range, previewed.code());
  EXPECT_THAT(previewed.what(), is_clear);
  EXPECT_THAT(this->refusal([&] { this->architecture.configure(); }).what(), is_clear);
}

TYPED_TEST(CoreTimesOfStates, AboveABoundRefuseAReplacement) {
  Component& component = this->add_guarded("t/Timed");
  this->deploy();
  Transaction other;
  other.replace_core("c", "t/TooSlow");
  EXPECT_THAT(this->refused(other).what(), HasSubstr("found 6000000, declared by core t/TooSlow"));
  EXPECT_EQ(us_to_ns(302), this->wcet_of(component, "Run")) << "the old core runs on";
}

TEST(DeclaredCoreTimes, AreAboveZero) {
  PluginRegistry registry;
  const auto why = [&registry](time_ns_t time_ns) {
    try {
      registry.core<TestCore>("t/Core", "t/Shell", {.wcet_ns = {{"act", time_ns}}});
    } catch (const Error& error) {
      EXPECT_EQ(ErrorCode::out_of_range, error.code());
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_THAT(why(0), HasSubstr("core t/Core, wcet_ns of act: a method's worst-case execution time is out of "
                                "range; expected 1 to"));
  EXPECT_THAT(why(-5), HasSubstr("found -5"));
  EXPECT_THAT(why(kLongest + 1), HasSubstr("expected 1 to " + std::to_string(kLongest) + " ns"));
  EXPECT_TRUE(registry.names("core").empty());
  EXPECT_EQ("", why(1));
}

TEST(DeclaredCoreTimes, GoWithEachInstanceOfTheCore) {
  PluginRegistry registry;
  registry.core<TestCore>("t/Core", "t/Shell", {.wcet_ns = {{"act", 7}}});
  const auto core = registry.make_core("t/Core");
  EXPECT_THAT(core->wcet_ns(), ElementsAre(Pair("act", 7)));
  EXPECT_THAT(core->another()->wcet_ns(), ElementsAre(Pair("act", 7)));
  const auto own = new_part<CoreBase, TestCore>();
  own->set_wcet_ns({{"act", 9}});
  EXPECT_THAT(own->another()->wcet_ns(), ElementsAre(Pair("act", 9))) << "of a core that no registry made";
}

}  // namespace mauve::testing::test_core_times
