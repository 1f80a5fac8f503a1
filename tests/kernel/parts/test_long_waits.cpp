// SPDX-License-Identifier: LGPL-3.0-or-later
// Waits that last longer than there are instants.
#include "mauve_rt/base/seam/futex.hpp"

#include "free_fsm.hpp"

namespace mauve::testing::test_long_waits {

using ::testing::HasSubstr;

TEST(LongWaits, AreRefusedWhereTheirSumWouldOverflow) {
  const auto two_of = [](time_ns_t length) {
    return [=](FreeFsm& fsm) {
      State& first = fsm.wait("First", length);
      State& second = fsm.wait("Second", length + 1);
      fsm.set_initial(first);
      fsm.next(first, second);
      fsm.next(second, first);
    };
  };
  std::string text;
  EXPECT_EQ(ErrorCode::bad_fsm, error_of(two_of(INT64_MAX / 2), &text));
  EXPECT_THAT(text, HasSubstr("state Second"));
  EXPECT_THAT(text, HasSubstr("kForever"));
  EXPECT_EQ(2 * s_to_ns(86'400) + 1, period_of(two_of(s_to_ns(86'400))));
}

TEST(LongWaits, AGuardAfterAWaitForEverIsRefused) {
  std::string text;
  EXPECT_EQ(ErrorCode::bad_fsm, error_of(
                                    [](FreeFsm& fsm) {
                                      State& run = fsm.run("Run");
                                      State& rest = fsm.wait("Rest", kForever);
                                      fsm.set_initial(run);
                                      fsm.next(run, rest);
                                      fsm.when_set(rest, run);
                                    },
                                    &text));
  EXPECT_THAT(text, HasSubstr("state Rest"));
}

TEST(LongWaits, TheGridKnowsNoOverflow) {
  const Grid grid{.reference_ns = 1'000'003, .period_ns = 1'000};
  for (const time_ns_t instant : {INT64_MIN, INT64_MIN + 1, time_ns_t{-7}, time_ns_t{0}, INT64_MAX - 2'000}) {
    const time_ns_t next = grid.first_not_before(instant);
    EXPECT_GE(next, instant);
    EXPECT_LT(static_cast<std::uint64_t>(next) - static_cast<std::uint64_t>(instant), 1'000U);
    EXPECT_EQ(0, grid.phase_error(next));
  }
  EXPECT_EQ(kForever, grid.first_not_before(INT64_MAX));
  EXPECT_EQ(kForever, later_by(5, kForever));
  EXPECT_EQ(INT64_MIN, later_by(-5, INT64_MIN));
}

TEST(LongWaits, AnInstantBeforeTheClockBeganHasPassed) {
  const Atomic<std::uint32_t> word{1};
  for (const time_ns_t until : {INT64_MIN, time_ns_t{-1}, time_ns_t{0}})
    EXPECT_FALSE(futex_wait_until(word, 1, until)) << "it would be asked again and again";
}

using ShortPatience = Deployed;

TEST_F(ShortPatience, OfLessThanNothingIsRefusedAtOnce) {
  Component& component = add("c", 1000);
  core(component).work = [] { sleep_for(ms_to_ns(300)); };
  deploy();
  wait_runs(component, 1);
  for (const time_ns_t patience : {INT64_MIN, time_ns_t{-1}, time_ns_t{0}}) {
    try {
      deployer.set_property("c", "gain", 2.0, {.commit_ns = patience, .phase_ns = patience});
      ADD_FAILURE() << "it is in a state";
    } catch (const Error& error) {
      EXPECT_EQ(ErrorCode::timeout, error.code()) << error.what();
    }
  }
}

TEST_F(ShortPatience, ForTheReleaseThatFollowsIsNone) {
  Component& component = add("c", 3'600'000);
  deploy();
  wait_runs(component, 1);
  for (const time_ns_t patience : {INT64_MIN, time_ns_t{-1}})
    EXPECT_FALSE(deployer
                     .commit(std::move(Transaction().set_property("c", "gain", 2.0)),
                             {.timeouts = {.commit_ns = s_to_ns(10), .phase_ns = patience}})
                     .is_complete);
}

}  // namespace mauve::testing::test_long_waits
