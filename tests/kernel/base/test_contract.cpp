// SPDX-License-Identifier: LGPL-3.0-or-later
// A broken contract names itself: on an ordinary thread, in a component, and where no exception may pass.
#include "mauve_rt/base/contract.hpp"
#include "mauve_rt/base/pi_mutex.hpp"

#include "fixtures.hpp"

namespace mauve::testing::test_contract {

using ::testing::HasSubstr;
using ::testing::MatchesRegex;

void expect_below(int value, int limit) { MAUVE_EXPECTS(value < limit); }
void ensure_below(int value, int limit) { MAUVE_ENSURES(value < limit); }
void audit_below(int value, int limit) { MAUVE_AUDIT(value < limit); }
void expect_noexcept(int value) noexcept { MAUVE_EXPECTS(value != 3); }

std::string text_of(void (*broken)(int, int)) {
  ::testing::internal::CaptureStderr();
  std::string text = "nothing was thrown";
  try {
    broken(2, 2);
  } catch (const Error& failure) {
    EXPECT_EQ(ErrorCode::internal, failure.code());
    text = failure.what();
  }
  EXPECT_EQ("mauve_rt: " + text + "\n", ::testing::internal::GetCapturedStderr());
  return text;
}

TEST(Contract, PassesWhereTheConditionHolds) {
  EXPECT_NO_THROW(expect_below(1, 2));
  EXPECT_NO_THROW(ensure_below(1, 2));
  EXPECT_NO_THROW(audit_below(1, 2));
  EXPECT_NO_THROW(expect_noexcept(2));
}

TEST(Contract, GivesAnOrdinaryThreadAnErrorWithFileLineAndCondition) {
  EXPECT_THAT(text_of(expect_below),
              MatchesRegex("test_contract.cpp:[0-9]+: broken precondition: value < limit; .*"));
  EXPECT_THAT(text_of(ensure_below),
              MatchesRegex("test_contract.cpp:[0-9]+: broken postcondition: value < limit; .*"));
}

TEST(Contract, ChecksAuditsOnlyWhereTheBuildAsksForThem) {
#ifdef MAUVE_AUDITS
  EXPECT_THAT(text_of(audit_below),
              MatchesRegex("test_contract.cpp:[0-9]+: broken audit: value < limit; .*"));
#else
  int evaluations = 0;
  MAUVE_AUDIT(++evaluations == 0);
  EXPECT_EQ(0, evaluations);
  EXPECT_NO_THROW(audit_below(2, 2));
#endif
}

TEST(Contract, TakesAConditionWithCommas) {
  const auto is_one_of = [](int value, int first, int second) { return value == first || value == second; };
  EXPECT_NO_THROW(MAUVE_EXPECTS(is_one_of(2, 1, 2)));
  EXPECT_NO_THROW(MAUVE_AUDIT(is_one_of(2, 1, 2)));
}

TEST(ContractDeathTest, EndsTheProcessWithFileLineAndConditionWhereNoExceptionMayPass) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_DEATH(expect_noexcept(3), "test_contract.cpp:[0-9]+: broken precondition: value != 3");
}

class ContractOfAComponent : public Deployed {};

TEST_F(ContractOfAComponent, FaultsTheComponentAndLeavesItsNeighboursAlone) {
  Component& broken = add("broken", 1);
  Component& neighbour = add("neighbour", 1);
  TestCore& failing = core(broken);
  failing.work = [&failing] { MAUVE_EXPECTS(failing.runs < 3); };
  deploy();
  wait_until([&] { return broken.task().state() == ComponentState::faulted && broken.task().is_parked(); },
             "the fault");
  const Fault fault = broken.task().fault();
  EXPECT_THAT(fault.what, HasSubstr("broken precondition: failing.runs < 3"));
  EXPECT_THAT(fault.what, HasSubstr("test_contract.cpp:"));
  EXPECT_EQ("Run", fault.where);
  wait_runs(neighbour, core(neighbour).runs + 3);
  EXPECT_EQ(ComponentState::running, neighbour.task().state());
}

TEST(ContractOfALock, KnowsWhichThreadHoldsIt) {
  PiMutex outer;
  PiMutex inner;
  EXPECT_FALSE(outer.is_held_here());
  outer.lock();
  inner.lock();
  EXPECT_TRUE(outer.is_held_here());
  EXPECT_TRUE(inner.is_held_here());
  std::thread([&] { EXPECT_FALSE(outer.is_held_here()); }).join();
  outer.unlock();  // in any order
  EXPECT_FALSE(outer.is_held_here());
  EXPECT_TRUE(inner.is_held_here());
  inner.unlock();
}

TEST(ContractOfALock, TellsAChangeThatHoldsItFromOneThatIsPausedOrAnothers) {
  ChangeLock lock;
  EXPECT_FALSE(lock.is_held_here());
  const std::lock_guard change(lock);
  EXPECT_TRUE(lock.is_held_here());
  std::thread([&] { EXPECT_FALSE(lock.is_held_here()); }).join();
  {
    const ChangeLock::Pause pause(lock);
    EXPECT_FALSE(lock.is_held_here());
    EXPECT_THROW(lock.wait_for_others(), Error);
    std::thread([&] {
      const ChangeLock::Inside inside(lock);
      EXPECT_FALSE(lock.is_held_here()) << "inside the change of another thread";
    }).join();
  }
  EXPECT_TRUE(lock.is_held_here());
}

}  // namespace mauve::testing::test_contract
