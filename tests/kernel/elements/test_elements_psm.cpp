// SPDX-License-Identifier: LGPL-3.0-or-later
// PeriodicFsm: one action in each period, one period in each transition.
#include "fixtures.hpp"

namespace mauve::testing::test_elements_psm {

class FreePsm;
using Define = std::function<void(FreePsm&)>;

/// A periodic machine whose definition the test gives.
class FreePsm : public PeriodicFsm<TestShell, TestCore> {
 public:
  using PeriodicState = PeriodicFsm::PeriodicState;

  explicit FreePsm(Define how) : how_(std::move(how)) {}
  void define() override { how_(*this); }
  PeriodicState run(const std::string& name) { return periodic_state(name, "act", &TestCore::act); }
  void when_set(const PeriodicState& from, const PeriodicState& to) {
    transition(from, "is_set", &TestCore::is_set, to);
  }
  using PeriodicFsm::next;
  using PeriodicFsm::period;
  using PeriodicFsm::set_initial;

 private:
  Define how_;
};

constexpr time_ns_t kPeriod = ms_to_ns(7);

TEST(PeriodicFsmDefinition, AStateIsAnActionAndTheWaitBeforeIt) {
  FreePsm fsm([](FreePsm& psm) {
    psm.period(kPeriod);
    const auto a = psm.run("A");
    const auto b = psm.run("B");
    psm.set_initial(a);
    psm.when_set(a, b);
  });
  fsm.configure();
  const State& a = fsm.initial();
  EXPECT_EQ("A", a.name);
  ASSERT_EQ(1U, a.transitions.size());
  const State& await_b = *a.transitions[0].to;
  EXPECT_EQ("AwaitB", await_b.name);
  EXPECT_TRUE(await_b.is_wait);
  EXPECT_EQ(kPeriod, await_b.duration_ns);
  EXPECT_EQ("B", await_b.next->name);
  // Where no guard holds, the machine stays in the state.
  EXPECT_EQ("AwaitA", a.next->name);
  EXPECT_EQ("A", a.next->next->name);
}

TEST(Rule3Period, OfAPsmIsItsOwnWhateverTheCycles) {
  FreePsm ring([](FreePsm& psm) {
    psm.period(kPeriod);
    const auto a = psm.run("A");
    const auto b = psm.run("B");
    psm.set_initial(a);
    psm.next(a, b);
    psm.next(b, a);
  });
  ring.configure();
  EXPECT_EQ(kPeriod, ring.period_ns());
  ring.cleanup();
  ring.configure();
  EXPECT_EQ(kPeriod, ring.period_ns());
}

ErrorCode error_of(Define how) {
  try {
    FreePsm(std::move(how)).configure();
  } catch (const Error& error) {
    return error.code();
  }
  return ErrorCode::internal;
}

TEST(PeriodicFsmDefinition, HasOnePeriodGivenBeforeTheStates) {
  EXPECT_EQ(ErrorCode::bad_fsm, error_of([](FreePsm& psm) { psm.set_initial(psm.run("A")); }));
  EXPECT_EQ(ErrorCode::bad_fsm, error_of([](FreePsm& psm) { psm.period(0); }));
  EXPECT_EQ(ErrorCode::bad_fsm, error_of([](FreePsm& psm) {
              psm.period(kPeriod);
              psm.set_initial(psm.run("A"));
              psm.period(2 * kPeriod);
            }));
  EXPECT_EQ(ErrorCode::duplicate_name, error_of([](FreePsm& psm) {
              psm.period(kPeriod);
              psm.set_initial(psm.run("A"));
              psm.run("A");
            }));
}

}  // namespace mauve::testing::test_elements_psm
