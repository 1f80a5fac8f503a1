// SPDX-License-Identifier: LGPL-3.0-or-later
// One matrix: user code of a component that hangs, in each hook, and each call by which others protect the robot then. Each such call
// is answered while the hook hangs. In virtual time, where one thread executes all, the hook fails instead.
//
//   Hooks/HungHook.ARuleAboutAnotherIsMade/Adopt
#include "hung_hooks_fixtures.hpp"

namespace mauve::testing::test_hung_hooks {

using namespace hung_hooks;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

std::vector<std::string> names_of(const std::vector<LateComponent>& components) {
  std::vector<std::string> names;
  for (const LateComponent& component : components) names.push_back(component.name);
  return names;
}

class HungHook : public HookCase<OnThreads> {
 protected:
  void SetUp() override {
    add_parts();
    begin();
    watch.emplace(*doors);
  }
  void TearDown() override {
    if (watch) finish();
    armed.reset();
  }
  bool stop_by_force() { return host().stop("b", {.timeout_ns = kShort, .force = true}); }
  void expect_ended() {
    EXPECT_EQ(is_occupied() ? ComponentState::faulted : ComponentState::stopped, state("b"));
    EXPECT_EQ(ComponentState::stopped, state("p"));
    EXPECT_FALSE(architecture.component("p").task().has_thread());
    EXPECT_EQ(is_occupied(), architecture.component("b").task().has_thread()) << "it is left behind";
    EXPECT_EQ(0.0, value_of("b"));
    EXPECT_EQ(0.0, value_of("p"));
    EXPECT_EQ(nullptr, architecture.host());
  }

  std::optional<Watch> watch;
  std::unique_ptr<PreparedTransaction> armed;  // its end waits for changes
};
INSTANTIATE_TEST_SUITE_P(Hooks, HungHook, ::testing::ValuesIn(all_hooks()), name_of);

TEST_P(HungHook, AStopIsAnswered) {
  misbehave();
  if (is_occupied()) {
    EXPECT_EQ(ErrorCode::timeout, refusal([&] { host().stop("b", kShort); }).code());
    EXPECT_EQ(ComponentState::stopping, state("b")) << "it stays pending";
  } else {
    host().stop("b", s_to_ns(10));
    EXPECT_EQ(ComponentState::stopped, state("b"));
    EXPECT_EQ(0.0, value_of("b"));
  }
  host().stop("p", s_to_ns(10));
  EXPECT_EQ(ComponentState::stopped, state("p"));
  EXPECT_EQ(0.0, value_of("p"));
}

TEST_P(HungHook, AStopByForceMakesTheOutputsSafe) {
  misbehave();
  EXPECT_EQ(is_occupied(), host().stop("b", {.timeout_ns = is_occupied() ? kShort : kLong, .force = true}));
  EXPECT_EQ(is_occupied() ? ComponentState::faulted : ComponentState::stopped, state("b"));
  EXPECT_EQ(is_occupied(), architecture.component("b").task().is_left_behind());
  EXPECT_EQ(0.0, value_of("b"));
  EXPECT_EQ(7.0, value_of("p"));
  if (hook() == Hook::adopt) {
    EXPECT_EQ(ErrorCode::wrong_revision, change.take()) << "its change is answered";
  }
}

TEST_P(HungHook, ARemovalIsMade) {
  misbehave();
  if (is_occupied()) stop_by_force();
  commit(Transaction().remove_component("b"));
  EXPECT_EQ(nullptr, architecture.find_component("b"));
  EXPECT_EQ(0.0, value_of("b"));
  EXPECT_EQ(is_occupied() ? 1U : 0U, architecture.threads_left_behind());
  commit(Transaction().remove_resource("b_out"));
  EXPECT_EQ(nullptr, architecture.find_resource("b_out"));
}

TEST_P(HungHook, ARuleAboutItIsAnswered) {
  armed = host().prepare(std::move(Transaction().stop("b")));
  misbehave();
  const auto outcome = armed->commit(is_occupied() ? kShort : kLong);
  EXPECT_EQ(is_occupied() ? PreparedOutcome::timed_out : PreparedOutcome::committed, outcome);
  EXPECT_EQ(is_occupied() ? ComponentState::running : ComponentState::stopped, state("b"));
}

TEST_P(HungHook, ARuleAboutAnotherIsMade) {
  armed = host().prepare(std::move(Transaction().stop("p")));
  misbehave();
  EXPECT_EQ(PreparedOutcome::committed, armed->commit(kLong));
  EXPECT_EQ(ComponentState::stopped, state("p"));
  EXPECT_EQ(0.0, value_of("p"));
}

TEST_P(HungHook, ACommittedRuleIsCompleted) {
  armed = host().prepare(std::move(Transaction().stop("p")));
  misbehave();
  EXPECT_EQ(PreparedOutcome::committed, armed->commit(kLong));
  EXPECT_THAT(armed->complete().steps, SizeIs(1));
}

TEST_P(HungHook, ASignalEndsTheHost) {
  misbehave();
  static_cast<Deployer&>(host()).end();  // as Deployer::end_all() at SIGTERM
  expect_ended();
}

TEST_P(HungHook, AShutdownEnds) {
  misbehave();
  way.shutdown();
  expect_ended();
}

TEST_P(HungHook, AProbationOfAnotherIsReverted) {
  const auto fails = std::make_shared<std::atomic<bool>>(false);
  auto trial = std::make_unique<TestCore>();
  trial->work = [fails] {
    if (*fails) throw std::runtime_error("the trial fails");
  };
  CoreBase* const old = &architecture.component("p").core();
  commit(Transaction().replace_core("p", std::move(trial), ProbationOptions{.duration_ns = s_to_ns(600)}));
  misbehave();
  *fails = true;
  const auto is_reverted = [&] {
    host().settle_probations();
    for (const ProbationRecord& record : host().probations()) {
      if (record.component == "p") return record.verdict == ProbationVerdict::reverted;
    }
    return false;
  };
  way.until(is_reverted, "the verdict");
  EXPECT_EQ(old, &architecture.component("p").core());
  const int runs = core(architecture.component("p")).runs;
  way.until([&] { return core(architecture.component("p")).runs > runs + 2; }, "the old core");
  EXPECT_EQ(ComponentState::running, state("p"));
}

TEST_P(HungHook, AnotherChangeIsMade) {
  misbehave();
  commit(Transaction().set_property("p", "gain", 3.0));
  EXPECT_EQ(3.0, architecture.component("p").shell_as<TestShell>().gain.value());
}

TEST_P(HungHook, AStructuralChangeOfOthersIsMade) {
  misbehave();
  Transaction structural;
  structural.add_resource("new", std::make_unique<LatestValue<Number>>())
      .connect("p", "held", "new", "write");
  commit(structural);
  commit(Transaction().remove_component("p").remove_resource("new"));
  EXPECT_EQ(nullptr, architecture.find_component("p"));
}

TEST_P(HungHook, TheListSaysWhatLasts) {
  misbehave();
  const bool hangs_in_state = is_occupied() && !change.is_asked();
  if (hangs_in_state) request_property();
  const auto phase = [&] {
    const auto open = host().open_changes();
    return open.size() == 1 ? std::optional(open.front().phase) : std::nullopt;
  };
  const auto late = [&] {
    const auto open = host().open_changes();
    return open.empty() ? std::vector<std::string>{} : names_of(open.front().late);
  };
  if (is_occupied()) {
    const auto expected = hook() == Hook::take ? OpenChangePhase::made : OpenChangePhase::waiting;
    way.until([&] { return phase() == expected && late() == std::vector<std::string>{"b"}; }, "the late one");
  } else if (is_preparing()) {
    EXPECT_EQ(OpenChangePhase::preparing, phase());
    EXPECT_THAT(late(), IsEmpty());
  } else if (hook() == Hook::cleanup || hook() == Hook::cleanup_beside_fallback) {
    EXPECT_THAT(architecture.disposing().what, HasSubstr("component b"));
  }
  if (hook() == Hook::shadow) {
    EXPECT_THAT(host().shadows(), SizeIs(1));
  }
  EXPECT_THAT(to_string(host().describe()), HasSubstr("p"));
  EXPECT_THAT(host().probations(), SizeIs(hook() == Hook::probation ? 1 : 0));
  if (hangs_in_state) {
    EXPECT_EQ(Abandoned::called_off, host().abandon("b"));
    EXPECT_EQ(ErrorCode::wrong_revision, change.take());
  }
}

// ---- in virtual time the hook fails

class FailedHook : public HookCase<InVirtualTime> {
 protected:
  void SetUp() override {
    add_parts();
    begin();
  }
  void TearDown() override { finish(); }
  bool is_faulted() const { return is_occupied() && hook() != Hook::adopt && hook() != Hook::probation; }
};

std::string virtual_name(const ::testing::TestParamInfo<Hook>& hook) { return name_of(hook) + "_virtual"; }
INSTANTIATE_TEST_SUITE_P(Hooks, FailedHook, ::testing::ValuesIn(all_hooks()), virtual_name);

TEST_P(FailedHook, IsReportedAsItIs) {
  misbehave();
  EXPECT_EQ(is_faulted() ? ComponentState::faulted : ComponentState::running, state("b"));
  const ErrorCode expected = hook() == Hook::configure         ? ErrorCode::prepare_failed
                             : hook() == Hook::configure_added ? ErrorCode::configure_failed
                             : hook() == Hook::adopt           ? ErrorCode::adopt_refused
                             : hook() == Hook::promote         ? ErrorCode::not_running
                                                               : ErrorCode::internal;
  if (change.is_asked()) {
    EXPECT_EQ(expected, change.take());
  }
  if (hook() == Hook::probation) {
    EXPECT_EQ(ProbationVerdict::reverted, host().probations().front().verdict);
  }
  if (hook() == Hook::shadow) {
    EXPECT_EQ(ShadowVerdict::faulted, host().shadows().front().verdict);
  }
  EXPECT_EQ(is_faulted() ? 0.0 : 7.0, value_of("b"));
  EXPECT_THAT(host().open_changes(), IsEmpty());
}

TEST_P(FailedHook, AStopIsAnswered) {
  for (const bool is_forced : {false, true}) {
    if (is_forced && !is_faulted()) host().start("b");
    if (!is_forced) misbehave();
    const auto stop = [&] { return host().stop("b", {.force = is_forced}); };
    if (is_faulted()) {
      EXPECT_EQ(ErrorCode::not_running, refusal(stop).code());
    } else {
      EXPECT_FALSE(stop());
      EXPECT_EQ(ComponentState::stopped, state("b"));
    }
    EXPECT_EQ(0.0, value_of("b"));
  }
}

TEST_P(FailedHook, ARemovalIsMade) {
  misbehave();
  commit(Transaction().remove_component("b"));
  EXPECT_EQ(nullptr, architecture.find_component("b"));
  commit(Transaction().remove_resource("b_out"));
}

TEST_P(FailedHook, RulesAreMade) {
  const auto it = host().prepare(std::move(Transaction().stop("b")));
  const auto another = host().prepare(std::move(Transaction().stop("p")));
  misbehave();
  EXPECT_EQ(is_faulted() ? PreparedOutcome::stale : PreparedOutcome::committed, it->commit(0));
  EXPECT_EQ(PreparedOutcome::committed, another->commit(0));
  another->complete();
  EXPECT_EQ(ComponentState::stopped, state("p"));
}

TEST_P(FailedHook, AShutdownEnds) {
  misbehave();
  way.shutdown();
  EXPECT_EQ(is_faulted() ? ComponentState::faulted : ComponentState::stopped, state("b"));
  EXPECT_EQ(ComponentState::stopped, state("p"));
  EXPECT_EQ(0.0, value_of("b"));
}

TEST_P(FailedHook, AnotherChangeIsMade) {
  auto trial = std::make_unique<TestCore>();
  bool fails = false;
  trial->work = [&fails] {
    if (fails) throw std::runtime_error("the trial fails");
  };
  commit(Transaction().replace_core("p", std::move(trial), ProbationOptions{.duration_ns = s_to_ns(600)}));
  misbehave();
  fails = true;
  const auto is_reverted = [&] {
    return host().probations().back().component == "p" &&
           host().probations().back().verdict == ProbationVerdict::reverted;
  };
  way.until(is_reverted, "the verdict");
  commit(Transaction().set_property("p", "gain", 3.0));
  EXPECT_EQ(3.0, architecture.component("p").shell_as<TestShell>().gain.value());
}

}  // namespace mauve::testing::test_hung_hooks
