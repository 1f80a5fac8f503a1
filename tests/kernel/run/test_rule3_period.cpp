// SPDX-License-Identifier: LGPL-3.0-or-later
// Rule 3: the period of a machine, and the grid that it gives its component.
#include <map>
#include <numeric>
#include <random>

#include "free_fsm.hpp"

namespace mauve::testing::test_rule3_period {

using ::testing::ElementsAre;
using Rule3Grid = Simulated;

/// A random machine of waits and executions, as the lengths and edges of its states (length 0: an execution).
struct Graph {
  std::vector<time_ns_t> lengths;
  std::vector<std::vector<std::size_t>> edges;  // the last of each is the one without a guard

  void define(FreeFsm& fsm) const {
    std::vector<State*> states;
    for (std::size_t i = 0; i < lengths.size(); ++i) {
      const std::string name = "S" + std::to_string(i);
      states.push_back(lengths[i] == 0 ? &fsm.run(name) : &fsm.wait(name, lengths[i]));
    }
    fsm.set_initial(*states[0]);
    for (std::size_t i = 0; i < lengths.size(); ++i) {
      for (std::size_t k = 0; k + 1 < edges[i].size(); ++k) fsm.when_set(*states[i], *states[edges[i][k]]);
      fsm.next(*states[i], *states[edges[i].back()]);
    }
  }
  /// The lengths of all simple cycles that can be reached, one by one: another way than the kernel's.
  void walk(std::vector<std::size_t>& path, std::vector<time_ns_t>& cycles) const {
    for (const std::size_t next : edges[path.back()]) {
      const auto begin = std::find(path.begin(), path.end(), next);
      if (begin == path.end()) {
        path.push_back(next);
        walk(path, cycles);
        path.pop_back();
      } else {
        time_ns_t length = 0;
        for (auto state = begin; state != path.end(); ++state) length += lengths[*state];
        cycles.push_back(length);
      }
    }
  }
};

TEST(Rule3Period, IsTheGcdOfAllCyclesOfAnyMachine) {
  std::mt19937 random(5);
  const std::vector<time_ns_t> lengths{0, 0, 2, 3, 4, 6, 9, 10, 15};
  int refused = 0;
  int longer_than_one = 0;
  for (int round = 0; round < 3000; ++round) {
    Graph graph;
    const std::size_t size = 2 + random() % 6;
    for (std::size_t i = 0; i < size; ++i) {
      graph.lengths.push_back(lengths[random() % lengths.size()]);
      graph.edges.emplace_back();
      const std::size_t degree = graph.lengths[i] == 0 ? 1 + random() % 3 : 1;  // only executions have guards
      for (std::size_t k = 0; k < degree; ++k) graph.edges[i].push_back(random() % size);
    }
    std::vector<std::size_t> path{0};
    std::vector<time_ns_t> cycles;
    graph.walk(path, cycles);
    const Define how = [&graph](FreeFsm& fsm) { graph.define(fsm); };
    if (std::find(cycles.begin(), cycles.end(), 0) != cycles.end()) {
      ASSERT_EQ(ErrorCode::loop_without_wait, error_of(how)) << "round " << round;
      ++refused;
      continue;
    }
    time_ns_t gcd = 0;
    for (const time_ns_t length : cycles) gcd = std::gcd(gcd, length);
    ASSERT_EQ(gcd, period_of(how)) << "round " << round;
    if (cycles.size() > 1 && gcd > 1) ++longer_than_one;
  }
  EXPECT_GT(refused, 100);
  EXPECT_GT(longer_than_one, 100);
}

/// Waits of 3 and 7 units, or of 8 and 2 when the condition is set: g is 10 units either way.
void two_ways(FreeFsm& fsm) {
  State& run = fsm.run("Run");
  State& three = fsm.wait("Three", ms_to_ns(3));
  State& seven = fsm.wait("Seven", ms_to_ns(7));
  State& eight = fsm.wait("Eight", ms_to_ns(8));
  State& two = fsm.wait("Two", ms_to_ns(2));
  fsm.set_initial(run);
  fsm.when_set(run, eight);
  fsm.next(run, three);
  fsm.next(three, seven);
  fsm.next(seven, run);
  fsm.next(eight, two);
  fsm.next(two, run);
}

TEST_F(Rule3Grid, InitialStatesInstantsAreEpochAndOffsetAndMultiplesOfThePeriod) {
  Component& component = add_free(architecture, "c", two_ways, {.offset_ns = ms_to_ns(4)});
  core(component).work = [&component] { core(component).condition = core(component).runs % 2 == 0; };
  deploy();
  EXPECT_EQ(ms_to_ns(10), component.task().grid().period_ns);
  run_to(ms_to_ns(34));
  EXPECT_THAT(instants_ms(component), ElementsAre(4, 14, 24, 34));
  EXPECT_EQ(simulation.epoch_ns() + ms_to_ns(34), host().get_time("c"));
  const auto deployed = records_of(architecture.drain_trace(), TraceKind::deployment);
  ASSERT_EQ(1U, deployed.size());
  EXPECT_EQ(simulation.epoch_ns(), deployed[0].a);
  EXPECT_EQ(ms_to_ns(4), deployed[0].b);
  EXPECT_EQ(ms_to_ns(10), deployed[0].c);
}

TEST_F(Rule3Grid, ADeclaredDivisorMakesItFiner) {
  Component& component = add("c", 10, 0.0, {.offset_ns = ms_to_ns(1), .period_ns = ms_to_ns(5)});
  deploy();
  simulation.at(simulation.epoch_ns() + ms_to_ns(12), [this] {
    host().stop("c");
    host().start("c");
  });
  run_to(ms_to_ns(26));
  EXPECT_THAT(instants_ms(component), ElementsAre(1, 11, 16, 26)) << "it starts again on epoch + 1 + k * 5";
}

class Rule3Declared : public ::testing::Test {
 protected:
  static ErrorCode configure(time_ns_t wait_ns, time_ns_t declared_ns) {
    Architecture architecture;
    add_free(architecture, "c", varying({0}, wait_ns), {.period_ns = declared_ns});
    try {
      architecture.configure();
    } catch (const Error& error) {
      EXPECT_EQ("c", error.detail().component);
      EXPECT_FALSE(error.detail().remedy.empty());
      return error.code();
    }
    return ErrorCode::internal;
  }
};

TEST_F(Rule3Declared, ADivisorIsTakenAndNothingElse) {
  EXPECT_EQ(ErrorCode::internal, configure(ms_to_ns(12), ms_to_ns(12)));
  EXPECT_EQ(ErrorCode::internal, configure(ms_to_ns(12), ms_to_ns(4)));
  EXPECT_EQ(ErrorCode::bad_period, configure(ms_to_ns(12), ms_to_ns(5)));
  EXPECT_EQ(ErrorCode::bad_period, configure(ms_to_ns(12), ms_to_ns(24))) << "a multiple is no divisor";
}

TEST_F(Rule3Declared, UnderAHundredMicrosecondsItHasToBe) {
  EXPECT_EQ(ErrorCode::internal, configure(us_to_ns(100), 0));
  EXPECT_EQ(ErrorCode::bad_period, configure(us_to_ns(100) - 1, 0));
  EXPECT_EQ(ErrorCode::internal, configure(us_to_ns(100) - 1, us_to_ns(100) - 1));
  EXPECT_EQ(ErrorCode::internal, configure(us_to_ns(50), us_to_ns(25)));
}

}  // namespace mauve::testing::test_rule3_period
