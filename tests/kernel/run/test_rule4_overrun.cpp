// SPDX-License-Identifier: LGPL-3.0-or-later
// Rule 4: overruns, to the nanosecond. Every wait is 10 ms.
#include "free_fsm.hpp"

namespace mauve::testing::test_rule4_overrun {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class Rule4Overrun : public Simulated {
 protected:
  static constexpr time_ns_t kPeriod = ms_to_ns(10);

  /// The executions take these multiples of a tenth of a period, then no time.
  Component& overrun(const std::vector<std::int64_t>& tenths, OverrunPolicy policy = OverrunPolicy::skip,
                     std::int64_t max_backlog = 10) {
    std::vector<time_ns_t> lengths;
    for (const std::int64_t tenth : tenths) lengths.push_back(tenth * kPeriod / 10);
    Component& component = add_free(architecture, "c", varying(lengths, kPeriod),
                                    {.overrun = policy, .max_backlog = max_backlog});
    deploy();
    return component;
  }
  struct Overrun {
    std::int64_t missed_ms, found_ms, skipped;
    bool operator==(const Overrun&) const = default;
  };
  std::vector<Overrun> overruns() {
    std::vector<Overrun> all;
    for (const TraceRecord& record : records_of(architecture.drain_trace(), TraceKind::overrun)) {
      all.push_back({(record.a - simulation.epoch_ns()) / ms_to_ns(1),
                     (record.b - simulation.epoch_ns()) / ms_to_ns(1), record.c});
    }
    return all;
  }
};

TEST_F(Rule4Overrun, SkipOfTwoAndAHalfPeriods) {
  Component& component = overrun({25});
  run_to(ms_to_ns(50));
  EXPECT_THAT(instants_ms(component), ElementsAre(0, 30, 40, 50)) << "instants 1 and 2 skipped, release at 3";
  EXPECT_THAT(overruns(), ElementsAre(Overrun{10, 25, 2}));
  EXPECT_EQ(1U, component.task().statistics().overruns);
  EXPECT_EQ(2U, component.task().statistics().skipped);
  EXPECT_EQ(4U, component.task().statistics().releases);
}

TEST_F(Rule4Overrun, ExactlyOnTimeIsOnTime) {
  Component& component = overrun({10, 10, 10});
  run_to(ms_to_ns(40));
  EXPECT_THAT(instants_ms(component), ElementsAre(0, 10, 20, 30, 40));
  EXPECT_TRUE(overruns().empty());
  EXPECT_EQ(0U, component.task().statistics().overruns);
}

TEST_F(Rule4Overrun, SkipToAnInstantThatIsJustReached) {
  Component& component = overrun({30});
  run_to(ms_to_ns(40));
  EXPECT_THAT(instants_ms(component), ElementsAre(0, 30, 40)) << "the smallest clock + k * g >= now is now";
  EXPECT_THAT(overruns(), ElementsAre(Overrun{10, 30, 2}));
}

TEST_F(Rule4Overrun, SkipAgainAndAgainKeepsTheGrid) {
  Component& component = overrun({11, 25, 10, 19, 41});
  run_to(ms_to_ns(150));
  EXPECT_THAT(instants_ms(component), ElementsAre(0, 20, 50, 60, 80, 130, 140, 150));
  EXPECT_THAT(overruns(),
              ElementsAre(Overrun{10, 11, 1}, Overrun{30, 45, 2}, Overrun{70, 79, 1}, Overrun{90, 121, 4}));
  EXPECT_EQ(8U, component.task().statistics().skipped);
}

TEST_F(Rule4Overrun, SkipGoesBySmallerStepsWhenAPeriodIsDeclared) {
  Component& component =
      add_free(architecture, "c", varying({ms_to_ns(12)}, kPeriod), {.period_ns = ms_to_ns(5)});
  deploy();
  run_to(ms_to_ns(25));
  EXPECT_THAT(instants_ms(component), ElementsAre(0, 15, 25));
}

TEST_F(Rule4Overrun, CatchUpReleasesEveryInstantAtOnceUntilItIsOnTimeAgain) {
  Component& component = overrun({25, 1, 1}, OverrunPolicy::catch_up);
  run_to(ms_to_ns(40));
  EXPECT_THAT(instants_ms(component), ElementsAre(0, 10, 20, 30, 40));
  const TraceDrain drain = architecture.drain_trace();
  std::vector<std::int64_t> actual_ms;
  for (const TraceRecord& release : records_of(drain, TraceKind::release))
    actual_ms.push_back((release.b - simulation.epoch_ns()) / ms_to_ns(1));
  EXPECT_THAT(actual_ms, ElementsAre(0, 25, 26, 30, 40));
  EXPECT_EQ(2U, component.task().statistics().overruns) << "of the instants at 10 and 20";
  EXPECT_EQ(0U, component.task().statistics().skipped);
}

TEST_F(Rule4Overrun, CatchUpOwesAtMostMaxBacklog) {
  Component& component = overrun({39}, OverrunPolicy::catch_up, 3);
  run_to(ms_to_ns(50));
  EXPECT_EQ(ComponentState::running, component.task().state()) << "the instants 1, 2 and 3 are owed";
  EXPECT_THAT(instants_ms(component), ElementsAre(0, 10, 20, 30, 40, 50));
}

TEST_F(Rule4Overrun, CatchUpOwingMoreFaults) {
  Component& component = overrun({41}, OverrunPolicy::catch_up, 3);
  run_to(ms_to_ns(50));
  EXPECT_EQ(ComponentState::faulted, component.task().state()) << "the instants 1, 2, 3 and 4 are owed";
  EXPECT_THAT(component.task().fault().what, HasSubstr("max_backlog"));
  EXPECT_EQ("Pause", component.task().fault().where);
  EXPECT_EQ(simulation.epoch_ns() + ms_to_ns(41), component.task().fault().when_ns);
  EXPECT_THAT(overruns(), ElementsAre(Overrun{10, 41, 0}));
}

TEST_F(Rule4Overrun, CatchUpUnderSteadyOverloadFaultsOnceTheBacklogIsTooLong) {
  Component& component = overrun(std::vector<std::int64_t>(40, 15), OverrunPolicy::catch_up);
  run_to(s_to_ns(1));
  EXPECT_EQ(ComponentState::faulted, component.task().state());
  // After n executions 15 n ms have passed and instant n was due at 10 n: 11 are owed from n = 20 on.
  EXPECT_EQ(20U, instants_ms(component).size());
}

TEST_F(Rule4Overrun, FaultFaults) {
  Component& component = overrun({10, 11}, OverrunPolicy::fault);
  run_to(ms_to_ns(50));
  EXPECT_EQ(ComponentState::faulted, component.task().state());
  EXPECT_THAT(instants_ms(component), ElementsAre(0, 10));
  EXPECT_THAT(overruns(), ElementsAre(Overrun{20, 21, 0}));
  EXPECT_EQ(simulation.epoch_ns() + ms_to_ns(21), component.task().fault().when_ns);
}

}  // namespace mauve::testing::test_rule4_overrun
