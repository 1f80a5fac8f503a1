// SPDX-License-Identifier: LGPL-3.0-or-later
// Rules 1 and 2: only waits advance the clock; instants do not drift.
#include <random>

#include "free_fsm.hpp"

namespace mauve::testing::test_rule1_clock {

using ::testing::ElementsAre;
using Rule1Clock = Simulated;
using Rule2Instants = Simulated;

TEST_F(Rule1Clock, AChainOfExecutionsRunsWithinOneInstantHoweverLongItTakes) {
  Component& component = add_free(architecture, "c", [](FreeFsm& fsm) {
    State& first = fsm.run("First", ms_to_ns(1));
    State& second = fsm.run("Second", ms_to_ns(2));
    State& third = fsm.run("Third", us_to_ns(500));
    State& pause = fsm.wait("Pause", ms_to_ns(10));
    fsm.set_initial(first);
    fsm.next(first, second);
    fsm.next(second, third);
    fsm.next(third, pause);
    fsm.next(pause, first);
  });
  deploy();
  run_to(ms_to_ns(15));
  EXPECT_THAT(instants_ms(component), ElementsAre(0, 0, 0, 10, 10, 10));
  const auto begun = records_of(architecture.drain_trace(), TraceKind::state_begin);
  ASSERT_EQ(6U, begun.size());
  EXPECT_EQ(simulation.epoch_ns() + ms_to_ns(1), begun[1].time_ns);
  EXPECT_EQ(simulation.epoch_ns() + ms_to_ns(3), begun[2].time_ns);
}

TEST_F(Rule1Clock, EachWaitAdvancesItByItsLength) {
  Component& component = add_free(architecture, "c", [](FreeFsm& fsm) {
    State& run = fsm.run("Run");
    State& a = fsm.wait("A", ms_to_ns(3));
    State& b = fsm.wait("B", ms_to_ns(4));
    State& c = fsm.wait("C", ms_to_ns(1));
    fsm.set_initial(run);
    fsm.when_set(run, c);
    fsm.next(run, a);
    fsm.next(a, b);
    fsm.next(b, run);
    fsm.next(c, run);
  });
  core(component).work = [&component] { core(component).condition = core(component).runs == 3; };
  deploy();
  run_to(ms_to_ns(22));
  EXPECT_THAT(instants_ms(component), ElementsAre(0, 7, 14, 15, 22));
}

TEST_F(Rule1Clock, WhatIsWrittenInAnInstantCarriesIt) {
  auto& out = architecture.add_resource<SharedData<Number>>("out");
  Component& component = add("c", 10, 4.0);
  architecture.connect("c", "output", "out", "write");
  core(component).work = [&component] { core(component).exposed_shell().output.write({1.0}); };
  deploy();
  run_to(ms_to_ns(13));
  Number value;
  time_ns_t time = 0;
  ReaderState seen;
  out.read.read(value, time, seen);
  EXPECT_EQ(simulation.epoch_ns() + ms_to_ns(10), time);
}

TEST(Rule1Loops, OfExecutionsAreNamedWhereverTheyAre) {
  std::string text;
  const Define how = [](FreeFsm& fsm) {
    State& start = fsm.run("Start");
    State& pause = fsm.wait("Pause", ms_to_ns(1));
    State& a = fsm.run("Alpha");
    State& b = fsm.run("Beta");
    State& c = fsm.run("Gamma");
    fsm.set_initial(start);
    fsm.next(start, pause);
    fsm.when_set(a, start);
    fsm.next(pause, a);
    fsm.next(a, b);
    fsm.next(b, c);
    fsm.when_set(c, b);
    fsm.next(c, start);
  };
  EXPECT_EQ(ErrorCode::loop_without_wait, error_of(how, &text));
  EXPECT_THAT(text, ::testing::HasSubstr("Beta -> Gamma -> Beta"));
  EXPECT_THAT(text, ::testing::Not(::testing::HasSubstr("Alpha")));
}

TEST(Rule1Loops, AnEventWaitBreaksALoopToo) {
  TestShell shell;
  EXPECT_EQ(ErrorCode::internal, error_of([&shell](FreeFsm& fsm) {
              State& run = fsm.run("Run");
              State& event = fsm.wait_event("Event", shell.input, ms_to_ns(10), ms_to_ns(1));
              fsm.set_initial(run);
              fsm.next(run, event);
              fsm.next(event, run);
            }));
}

TEST(Rule1Waits, ArePositive) {
  for (const time_ns_t length : {time_ns_t{0}, time_ns_t{-1}, INT64_MIN}) {
    EXPECT_EQ(ErrorCode::bad_fsm, error_of([=](FreeFsm& fsm) { fsm.wait("W", length); })) << length;
  }
}

TEST_F(Rule2Instants, DoNotDriftOverTenThousandPeriodsWhateverExecutionTakes) {
  Component& component = add_free(architecture, "c", [](FreeFsm& fsm) {
    State& run = fsm.run("Run", us_to_ns(10));
    State& more = fsm.run("More", us_to_ns(890));
    State& pause = fsm.wait("Pause", ms_to_ns(1));
    State& rest = fsm.wait("Rest", ms_to_ns(1));
    fsm.set_initial(run);
    fsm.when_set(run, more);
    fsm.next(run, pause);
    fsm.next(more, rest);
    fsm.next(pause, run);
    fsm.next(rest, run);
  });
  std::mt19937 random(11);
  std::vector<time_ns_t> entries;
  core(component).work = [&] {
    core(component).condition = random() % 2 == 0;
    const time_ns_t now = core(component).instants.back();
    if (entries.empty() || entries.back() != now) entries.push_back(now);
  };
  deploy();
  run_to(s_to_ns(10));
  ASSERT_EQ(10'001U, entries.size());
  for (std::size_t k = 0; k < entries.size(); ++k) {
    ASSERT_EQ(simulation.epoch_ns() + static_cast<time_ns_t>(k) * ms_to_ns(1), entries[k]);
  }
  EXPECT_EQ(0U, component.task().statistics().overruns);
}

}  // namespace mauve::testing::test_rule1_clock
