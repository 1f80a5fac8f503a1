// SPDX-License-Identifier: LGPL-3.0-or-later
// Bounds are watched: each job above its bound is counted, and a change withdraws the bounds.
#include "mauve_rt/deploy/job_watch.hpp"
#include "mauve_rt/deploy/trace_collector.hpp"

#include "simulated.hpp"

namespace mauve::testing::test_job_watch {

using ::testing::IsEmpty;
using ::testing::SizeIs;

class JobWatchTest : public Simulated {
 protected:
  /// Of the jobs of each period.
  static JobBound bound_of(const std::string& component, time_ns_t bound_ns) {
    return {.component = component, .after = "Pause", .until = "Pause", .bound_ns = bound_ns};
  }
  bool watch(const std::vector<JobBound>& bounds) {
    return jobs.watch(bounds, architecture.revision(), simulation.now_ns());
  }
  void run_and_take(time_ns_t after_epoch_ns) {
    run_to(after_epoch_ns);
    jobs.take(host().drain_trace());
  }

  JobWatch jobs{architecture};
};

TEST_F(JobWatchTest, JobsWithinTheirBoundAreCounted) {
  add("c", 10, 3.0);
  deploy();
  ASSERT_TRUE(watch({bound_of("c", ms_to_ns(3))}));
  run_and_take(ms_to_ns(55));
  const auto figures = jobs.figures();
  ASSERT_THAT(figures, SizeIs(1));
  EXPECT_EQ(figures[0].jobs, 5U) << "the first job follows no wait";
  EXPECT_EQ(figures[0].longest_ns, ms_to_ns(3));
  EXPECT_EQ(figures[0].violations, 0U);
  EXPECT_THAT(jobs.take_violations(), IsEmpty());
}

TEST_F(JobWatchTest, TheFirstJobIsThatOfTheInitialState) {
  add("c", 10, 3.0);
  deploy();
  JobBound first = bound_of("c", ms_to_ns(1));
  first.after = "Run";
  ASSERT_TRUE(watch({first}));
  run_and_take(ms_to_ns(55));
  run_and_take(ms_to_ns(60));
  EXPECT_EQ(jobs.figures().at(0).violations, 1U);
}

TEST_F(JobWatchTest, EachViolationIsCountedAndTheWorstOneIsShown) {
  Component& component = add("c", 10, 3.0);
  Component& urgent = add("urgent", 30, 2.0, {.priority = 90, .offset_ns = 0});
  deploy();
  ASSERT_TRUE(watch({bound_of("c", ms_to_ns(3) - 1), bound_of("urgent", ms_to_ns(2))}));
  run_and_take(ms_to_ns(55));
  EXPECT_THAT(jobs.take_violations(), IsEmpty()) << "records of others may come with the next drain";
  run_and_take(ms_to_ns(56));
  const auto found = jobs.take_violations();
  ASSERT_THAT(found, SizeIs(1));
  EXPECT_EQ(found[0].job.component, "c");
  EXPECT_EQ(found[0].count, 5U);
  EXPECT_EQ(found[0].instant_ns, simulation.epoch_ns() + ms_to_ns(30)) << "it waited for the urgent one";
  EXPECT_EQ(found[0].response_ns, ms_to_ns(5));
  TraceDrain shown;
  shown.records = found[0].records;
  EXPECT_EQ(records_of(shown, TraceKind::state_begin, urgent.task().number()).size(), 1U);
  EXPECT_EQ(records_of(shown, TraceKind::state_end, component.task().number()).back().time_ns,
            found[0].instant_ns + ms_to_ns(5));
  EXPECT_THAT(jobs.take_violations(), IsEmpty()) << "they are taken";
  EXPECT_EQ(jobs.figures().at(0).violations, 5U);
  EXPECT_EQ(jobs.figures().at(1).violations, 0U);
}

TEST_F(JobWatchTest, AChangeWithdrawsTheBounds) {
  add("c", 10, 3.0);
  deploy();
  ASSERT_TRUE(watch({bound_of("c", ms_to_ns(1))}));
  run_and_take(ms_to_ns(15));
  const std::uint64_t before = architecture.revision();
  host().set_property("c", "gain", 4.0);
  run_and_take(ms_to_ns(55));
  EXPECT_FALSE(jobs.holds());
  EXPECT_THAT(jobs.figures(), IsEmpty());
  EXPECT_THAT(jobs.take_violations(), IsEmpty()) << "the drain before the change is not judged, either";
  EXPECT_FALSE(jobs.watch({bound_of("c", ms_to_ns(1))}, before, 0)) << "these bounds are of another revision";
  EXPECT_TRUE(watch({bound_of("c", ms_to_ns(5))}));
  run_and_take(ms_to_ns(75));
  EXPECT_EQ(jobs.figures().at(0).jobs, 2U) << "jobs from then on";
}

TEST_F(JobWatchTest, AnotherComponentsAdoptIsNoViolation) {
  add("c", 10, 3.0);
  deploy();
  ASSERT_TRUE(watch({bound_of("c", ms_to_ns(1))}));
  run_to(ms_to_ns(15));
  TraceDrain drain = host().drain_trace();
  TraceRecord vote = drain.records.back();
  vote.kind = static_cast<std::uint16_t>(TraceKind::armed);
  drain.records.push_back(vote);
  jobs.take(drain);
  EXPECT_FALSE(jobs.holds()) << "a change that was refused leaves no other mark";
}

TEST_F(JobWatchTest, AJobOfWhichRecordsAreLostIsNotJudged) {
  add("c", 10, 3.0);
  deploy();
  ASSERT_TRUE(watch({bound_of("c", ms_to_ns(1))}));
  run_to(ms_to_ns(15));
  TraceDrain drain = host().drain_trace();
  std::erase_if(drain.records, [](const TraceRecord& record) {
    return record.kind == static_cast<std::uint16_t>(TraceKind::state_begin);
  });
  jobs.take(drain);
  EXPECT_EQ(jobs.figures().at(0).jobs, 0U);
  run_and_take(ms_to_ns(25));
  run_and_take(ms_to_ns(26));
  EXPECT_EQ(jobs.figures().at(0).jobs, 1U);
}

using JobWatchOnThreads = Deployed;

TEST_F(JobWatchOnThreads, AComponentThatSpinsTooLongIsFound) {
  Component& component = add("slow", 20);
  core(component).work = [] {
    const time_ns_t until_ns = monotonic_now_ns() + ms_to_ns(3);
    while (monotonic_now_ns() < until_ns) {
    }
  };
  JobWatch jobs(architecture);
  TraceCollector collector(architecture, ms_to_ns(5), &jobs, false);
  deploy();
  wait_until([&] { return component.task().state() == ComponentState::running; }, "the component");
  const JobBound bound{.component = "slow", .after = "Pause", .until = "Pause", .bound_ns = ms_to_ns(2)};
  ASSERT_TRUE(jobs.watch({bound}, architecture.revision(), monotonic_now_ns()));
  std::vector<BoundViolation> found;
  wait_until(
      [&] {
        if (found.empty()) found = jobs.take_violations();
        return !found.empty();
      },
      "a violation");
  EXPECT_GE(found.at(0).response_ns, ms_to_ns(3));
  deployer.stop("slow");
  wait_until([&] { return !jobs.holds(); }, "the bounds to be withdrawn");
}

}  // namespace mauve::testing::test_job_watch
