// SPDX-License-Identifier: LGPL-3.0-or-later
// What an fsm says of its states: methods, ports, and the expressions of its waits.
#include "fixtures.hpp"

namespace mauve::testing::test_described_fsm {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

struct UnitShell : TestShell {
  Property<std::int64_t>& unit_ns = property("unit_ns", 250'000, {.unit = "ns"});
  Property<std::int64_t>& unit_us = property("unit_us", 300, {.unit = "us"});
  Property<std::int64_t>& unit_ms = property("unit_ms", 10, {.unit = "ms"});
  Property<std::int64_t>& unit_s = property("unit_s", 2, {.unit = "s"});
  Property<std::int64_t>& distance = property("distance", 2, {.unit = "m"});
  Property<double>& real = property("real", 2.0, {.unit = "ms"});
};

struct UnitFsm : Fsm<UnitShell, TestCore> {
  void define() override {
    State& run = execution("Run", "act", &TestCore::act);
    State& w5 = wait("W5", mauve::times(5, shell().unit_ms));
    State& plain = wait("Plain", 5 * ms_to_ns(shell().unit_ms));
    State& event =
        wait_event("Event", shell().input, mauve::times(3, shell().unit_s), mauve::times(1, shell().unit_us));
    set_initial(run);
    transition(run, "is_set", &TestCore::is_set, w5);
    next(run, plain);
    transition(w5, "is_set", &TestCore::is_set, event);
    next(w5, run);
    next(plain, run);
    next(event, run);
  }
};

TEST(DescribedFsm, SaysMethodsPortsAndExpressions) {
  UnitShell shell;
  UnitFsm fsm;
  ASSERT_TRUE(fsm.bind_shell(shell));
  fsm.configure();
  const std::vector<DescribedState> states = fsm.describe_states();
  ASSERT_EQ(4U, states.size());
  const auto& [run, w5, plain, event] = std::tie(states[0], states[1], states[2], states[3]);
  EXPECT_EQ("act", run.action);
  EXPECT_THAT(run.guards, ElementsAre("is_set"));
  EXPECT_THAT(run.successors, ElementsAre("W5", "Plain"));
  EXPECT_EQ("5 * unit_ms", w5.duration_text);
  EXPECT_EQ(ms_to_ns(50), w5.duration_ns);
  EXPECT_EQ("", w5.action);
  EXPECT_THAT(w5.guards, ElementsAre("is_set"));
  EXPECT_EQ("", plain.duration_text) << "a plain number of ns";
  EXPECT_EQ(ms_to_ns(50), plain.duration_ns);
  EXPECT_THAT(plain.guards, IsEmpty());
  EXPECT_EQ("", plain.event_port);
  EXPECT_EQ("input", event.event_port);
  EXPECT_EQ("3 * unit_s", event.duration_text);
  EXPECT_EQ(s_to_ns(6), event.duration_ns);
  EXPECT_EQ("1 * unit_us", event.min_interarrival_text);
  EXPECT_EQ(us_to_ns(300), event.min_interarrival_ns);
}

struct UnitPsm : PeriodicFsm<UnitShell, TestCore> {
  void define() override {
    period(mauve::times(2, shell().unit_ns));
    set_initial(periodic_state("Run", "act", &TestCore::act));
  }
};

TEST(DescribedFsm, APsmSaysTheExpressionOfItsPeriod) {
  UnitShell shell;
  UnitPsm fsm;
  ASSERT_TRUE(fsm.bind_shell(shell));
  fsm.configure();
  EXPECT_EQ("2 * unit_ns", fsm.describe_states()[0].duration_text);
  EXPECT_EQ(500'000, fsm.period_ns());
}

template <typename Call>
Error refusal(Call&& call) {
  try {
    call();
  } catch (const Error& error) {
    return error;
  }
  return {ErrorCode::internal, "not refused"};
}

TEST(Times, OfAPropertyThatIsNoTimeAreRefused) {
  UnitShell shell;
  const Error metres = refusal([&] { mauve::times(2, shell.distance); });
  EXPECT_EQ(ErrorCode::invalid_argument, metres.code());
  EXPECT_THAT(metres.what(),
              HasSubstr("property distance: the property is no length of time; expected an int "
                        "property whose unit is ns, us, ms or s, found int of unit m"));
  const Error real = refusal([&] { mauve::times(2, shell.real); });
  EXPECT_EQ(ErrorCode::invalid_argument, real.code());
  EXPECT_THAT(real.what(), HasSubstr("found float of unit ms"));
  EXPECT_THAT(refusal([&] { mauve::times(2, shell.period_ms); }).what(), HasSubstr("found int of no unit"));
}

TEST(Times, ThatOverflowAreRefused) {
  UnitShell shell;
  for (const std::int64_t factor : {INT64_MAX, INT64_MAX / 10, INT64_MIN}) {
    const Error error = refusal([&] { mauve::times(factor, shell.unit_ms); });
    EXPECT_EQ(ErrorCode::out_of_range, error.code()) << factor;
    EXPECT_THAT(error.what(), HasSubstr(std::to_string(factor) + " * unit_ms")) << factor;
  }
}

struct NoLengthFsm : Fsm<UnitShell, TestCore> {
  void define() override { wait("W0", mauve::times(0, shell().unit_ms)); }
};

TEST(Times, OfNoLengthAreRefusedByTheirExpression) {
  UnitShell shell;
  NoLengthFsm fsm;
  ASSERT_TRUE(fsm.bind_shell(shell));
  const Error error = refusal([&] { fsm.configure(); });
  EXPECT_EQ(ErrorCode::bad_fsm, error.code());
  EXPECT_THAT(error.what(), HasSubstr("state W0"));
  EXPECT_THAT(error.what(), HasSubstr("found 0 * unit_ms, which is 0"));
}

TEST(OutputPolicy, HasTheNameThatShellsInPythonGiveIt) {
  EXPECT_EQ("hold", to_string(OutputPolicy::hold));
  EXPECT_EQ("set_zero", to_string(OutputPolicy::set_zero));
}

}  // namespace mauve::testing::test_described_fsm
