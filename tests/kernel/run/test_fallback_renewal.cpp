// SPDX-License-Identifier: LGPL-3.0-or-later
// A fallback core is made ready for other parts beside changes, also where its configure lasts.
#include <future>

#include "free_fsm.hpp"
#include "transaction_fixtures.hpp"

namespace mauve::testing::test_fallback_renewal {

using ::testing::HasSubstr;

constexpr TransactionOptions kPatient{.timeouts = {.commit_ns = s_to_ns(20), .phase_ns = 0}};

/// Its configure lasts while `hangs`, and says what it has read.
struct SpareCore : TestCore {
  explicit SpareCore(std::shared_ptr<Doors> shared) : doors(std::move(shared)) {
    set_implementation("t/Spare");
  }
  bool configure_hook() override {
    ++configured;
    if (hangs) doors->pass();
    gain_read = exposed_shell().gain;
    exposed_shell().output.write({9.0});
    return true;
  }
  std::shared_ptr<Doors> doors;
  std::atomic<bool> hangs{false};
  std::atomic<int> configured{0};
  std::atomic<double> gain_read{0};
};

class FallbackRenewal : public Deployed {
 protected:
  struct Guarded {
    Component& component;
    SpareCore& spare;
  };
  Guarded add_guarded(const std::string& name) {
    Component& component = add(name);
    component.replace_core(make_failing());
    auto spare = std::make_unique<SpareCore>(doors);
    SpareCore& its = *spare;
    component.set_fallback(std::move(spare));
    return {component, its};
  }
  /// One that faults as soon as the test says so.
  std::unique_ptr<TestCore> make_failing() const {
    auto made = std::make_unique<TestCore>();
    made->work = [fails = fails] {
      if (*fails) throw std::runtime_error("as the test says");
    };
    return made;
  }
  void commit(Transaction& transaction) { deployer.commit(std::move(transaction), kPatient); }
  void replace_fsm(const std::string& component) {
    Transaction change;
    change.replace_fsm(component, new_part<FsmBase, TestFsm>());
    commit(change);
  }
  /// Returns when the renewal hangs; another thread waits a little for it.
  void hang(Guarded& guarded) {
    guarded.spare.hangs = true;
    asked = std::async(std::launch::async, [&] { replace_fsm(guarded.component.name()); });
    wait_until([&] { return doors->entered.load(); }, "the configure of the fallback core");
  }
  void end_hang(Guarded& guarded) {
    guarded.spare.hangs = false;
    doors->open = true;
    asked.get();
    await_ready(guarded);
  }
  /// Each change may have asked for a renewal.
  void await_ready(const Guarded& guarded) {
    const auto is_ready = [&] {
      architecture.wait_disposed(0);
      return architecture.disposing().since_ns == 0 && !guarded.component.is_renewing();
    };
    wait_until(is_ready, "the fallback core to be ready");
  }
  void expect_to_fall_back(Guarded& guarded) {
    *fails = true;
    wait_until([&] { return guarded.spare.runs > 2 || guarded.component.task().is_parked(); },
               "the fallback");
    EXPECT_EQ(ComponentState::running, guarded.component.task().state());
    EXPECT_EQ(&guarded.spare, &guarded.component.core());
    *fails = false;
  }

  std::shared_ptr<Doors> doors{std::make_shared<Doors>()};
  std::shared_ptr<std::atomic<bool>> fails{std::make_shared<std::atomic<bool>>(false)};
  std::future<void> asked;
};

TEST_F(FallbackRenewal, OtherChangesOfTheComponentGoOnAndTheFallbackFitsTheLastOfThem) {
  auto& out = architecture.add_resource<SharedData<Number>>("out");
  auto guarded = add_guarded("c");
  architecture.connect("c", "output", "out", "write");
  deploy();
  wait_runs(guarded.component, 3);
  hang(guarded);
  for (int i = 0; i < 5; ++i) {
    Transaction change;
    change.replace_fsm("c", new_part<FsmBase, TestFsm>()).set_property("c", "gain", 3.0 + i);
    commit(change);
  }
  end_hang(guarded);
  EXPECT_EQ(7.0, guarded.spare.gain_read);
  EXPECT_GE(guarded.spare.configured, 3) << "with the component, while it hung, and for the last fsm";
  Number value{.value = -1};
  time_ns_t time_ns = 0;
  ReaderState reader;
  out.read.read(value, time_ns, reader);
  EXPECT_NE(9.0, value.value) << "what the configure writes goes nowhere";
  expect_to_fall_back(guarded);
}

/// The renewal waits for a hook that uses the parts that were in. By then the fallback was in, and was replaced.
class LateFallbackRenewal : public FallbackRenewal, public ::testing::WithParamInterface<bool> {};
INSTANTIATE_TEST_SUITE_P(All, LateFallbackRenewal, ::testing::Bool(), [](const auto& tested) {
  return std::string(tested.param ? "ComesBeforeTheConfigure" : "ComesAfterTheConfigure");
});

TEST_P(LateFallbackRenewal, ACleanupKeepsTheCoreThatReplacedTheFallback) {
  auto guarded = add_guarded("c");
  deploy();
  wait_runs(guarded.component, 3);
  expect_to_fall_back(guarded);
  architecture.hold_parts(guarded.component);
  Transaction change;
  auto next = make_failing();
  const TestCore* const third = next.get();
  change.replace_core("c", std::move(next));
  commit(change);
  deployer.stop("c");
  guarded.component.cleanup();
  if (GetParam()) {
    architecture.release_parts(guarded.component);
    await_ready(guarded);
  }
  guarded.component.configure();
  if (!GetParam()) {
    architecture.release_parts(guarded.component);
    await_ready(guarded);
  }
  EXPECT_EQ(third, &guarded.component.core()) << "and not the declared one, which was replaced";
  deployer.start("c");
  wait_runs(guarded.component, 3);
  guarded.spare.runs = 0;
  expect_to_fall_back(guarded);
}

TEST_F(FallbackRenewal, NoOtherComponentWaitsForIt) {
  auto hung = add_guarded("hung");
  auto guarded = add_guarded("c");
  deploy();
  wait_runs(hung.component, 3);
  wait_runs(guarded.component, 3);
  hang(hung);
  replace_fsm("c");
  wait_until([&] { return !guarded.component.is_renewing() && guarded.spare.configured == 2; },
             "the renewal");
  EXPECT_THAT(architecture.disposing().what, HasSubstr("fallback core, of component hung"));
  end_hang(hung);
  expect_to_fall_back(guarded);
  expect_to_fall_back(hung);
}

TEST_F(FallbackRenewal, TheComponentIsNotCleanedUpInItsPlace) {
  auto guarded = add_guarded("c");
  deploy();
  wait_runs(guarded.component, 3);
  hang(guarded);
  deployer.stop("c");
  try {
    guarded.component.cleanup();
    ADD_FAILURE() << "should have been refused";
  } catch (const Error& error) {
    EXPECT_EQ(ErrorCode::timeout, error.code());
  }
  EXPECT_TRUE(guarded.component.is_configured());
  end_hang(guarded);
  guarded.component.cleanup();
  guarded.component.configure();
  deployer.start("c");
  expect_to_fall_back(guarded);
}

TEST_F(FallbackRenewal, OneThatWasRemovedMeanwhileEndsWithIt) {
  auto guarded = add_guarded("c");
  const std::weak_ptr<Component> removed = architecture.find_component("c");
  deploy();
  wait_runs(guarded.component, 3);
  hang(guarded);
  Transaction change;
  change.remove_component("c");
  commit(change);
  EXPECT_EQ(nullptr, architecture.find_component("c"));
  EXPECT_FALSE(removed.expired()) << "its fallback core is being configured";
  doors->open = true;
  asked.get();
  wait_until([&] { return removed.expired(); }, "its end");
}

/// Changes of the component, its faults and renewals, at once.
TEST_F(FallbackRenewal, ComesBesideFaultsAndChanges) {
  auto guarded = add_guarded("c");
  deploy();
  std::atomic<bool> is_over{false};
  const auto change_gain = [&] {
    for (int i = 0; !is_over; ++i) {
      Transaction change;
      change.set_property("c", "gain", 1.0 + i % 3);
      try {
        commit(change);
      } catch (const Error&) {  // a fault came before it
      }
    }
  };
  std::thread other(change_gain);
  int made = 0;
  for (int i = 0; i < 60; ++i) {
    auto broken = std::make_unique<TestCore>();
    broken->work = [&own = *broken] {
      if (own.runs == 2) throw std::runtime_error("at its second activation");
    };
    Transaction change;
    change.replace_core("c", std::move(broken));
    if (i % 2 != 0) change.replace_fsm("c", new_part<FsmBase, TestFsm>());
    if (guarded.component.task().is_parked()) change.start("c");
    try {
      commit(change);
      ++made;
    } catch (const Error&) {  // a fault came before it
    }
  }
  is_over = true;
  other.join();
  EXPECT_GT(made, 10);
  wait_until(
      [&] { return guarded.component.task().has_fallen_back() || guarded.component.task().is_parked(); },
      "the last fault");
  Transaction change;
  change.replace_core("c", make_failing());
  if (guarded.component.task().is_parked()) change.start("c");
  commit(change);
  await_ready(guarded);
  guarded.spare.runs = 0;
  expect_to_fall_back(guarded);
}

}  // namespace mauve::testing::test_fallback_renewal
