// SPDX-License-Identifier: LGPL-3.0-or-later
// Section II-C of the paper: Guidance as periodic state machine (Fig. 2) and as clock-based one (Fig. 4). What
// the first cannot do and the second can is read from their traces.
#include <map>

#include "fixtures.hpp"

namespace mauve::testing::test_elements_guidance {

using types::Float64;

constexpr time_ns_t kUnit = ms_to_ns(2);
constexpr int kPathLength = 3;

struct GuidanceShell : Shell {
  ReadPort<Float64>& goal = read_port<Float64>("goal");
  WritePort<Float64>& target =
      write_port<Float64>("target", {.on_commit = OutputPolicy::hold, .on_stop = OutputPolicy::hold});
};

/// Listing 2 of the paper on a line: a path is so many steps to the goal.
class GuidanceCore : public Core<GuidanceShell> {
 public:
  std::atomic<int> reached{0};  // goals

  void read_inputs() { goal_ = shell().goal.read(); }
  bool has_new_goal() const { return goal_.status != DataStatus::none && goal_.value.data != planned_goal_; }
  bool has_path() const { return steps_left_ > 0; }
  void compute_path() {
    planned_goal_ = goal_.value.data;
    steps_left_ = kPathLength;
  }
  void follow_path() {
    --steps_left_;
    shell().target.write({planned_goal_ - steps_left_});
    if (steps_left_ == 0) reached.fetch_add(1);
  }

 private:
  Sample<Float64> goal_;
  double planned_goal_{0.0};
  int steps_left_{0};
};

/// Fig. 2. The one period must leave time to plan: 5 units.
struct GuidancePsm : PeriodicFsm<GuidanceShell, GuidanceCore> {
  void define() override {
    period(5 * kUnit);
    const PeriodicState idle = periodic_state("Idle", "read_inputs", &GuidanceCore::read_inputs);
    const PeriodicState planning = periodic_state("Planning", "compute_path", &GuidanceCore::compute_path);
    const PeriodicState following = periodic_state("Following", "follow_path", &GuidanceCore::follow_path);
    set_initial(idle);
    transition(idle, "has_new_goal", &GuidanceCore::has_new_goal, planning);
    transition(idle, "has_path", &GuidanceCore::has_path, following);
    next(planning, idle);
    next(following, idle);
  }
};

/// Fig. 4.
struct GuidanceFsm : Fsm<GuidanceShell, GuidanceCore> {
  void define() override {
    State& idle = execution("Idle", "read_inputs", &GuidanceCore::read_inputs);
    State& planning = execution("Planning", "compute_path", &GuidanceCore::compute_path);
    State& following = execution("Following", "follow_path", &GuidanceCore::follow_path);
    State& w1 = wait("W1", 1 * kUnit);
    State& w2 = wait("W2", 2 * kUnit);
    State& w5 = wait("W5", 5 * kUnit);
    set_initial(idle);
    transition(idle, "has_new_goal", &GuidanceCore::has_new_goal, planning);
    transition(idle, "has_path", &GuidanceCore::has_path, following);
    next(idle, w1);
    next(following, w2);
    next(planning, w5);
    next(w1, idle);
    next(w2, idle);
    next(w5, idle);
  }
};

/// What was executed at one instant of the logical clock.
struct Activation {
  time_ns_t instant_ns;  // counted from the epoch
  std::vector<std::string> states;
};

/// How far apart are activations, by the states of the earlier one.
using Distances = std::map<std::vector<std::string>, std::set<time_ns_t>>;

Distances distances_of(const std::vector<Activation>& activations) {
  Distances found;
  for (std::size_t i = 0; i + 1 < activations.size(); ++i) {
    found[activations[i].states].insert(activations[i + 1].instant_ns - activations[i].instant_ns);
  }
  return found;
}

class GuidanceTrace : public Deployed {
 protected:
  /// Lets Guidance come to two goals, one after the other, and gives back its trace.
  template <typename FsmType>
  std::vector<Activation> run() {
    // However late the machine makes it, no instant is skipped: the trace does not depend on the machine.
    const TaskSettings settings{.overrun = OverrunPolicy::catch_up, .max_backlog = INT64_MAX};
    Component& guidance =
        architecture.add_component<GuidanceShell, GuidanceCore, FsmType>("guidance", settings);
    auto& goal = architecture.add_resource<SharedData<Float64>>("goal");
    architecture.add_resource<SharedData<Float64>>("target");
    architecture.connect("guidance", "goal", "goal", "read");
    architecture.connect("guidance", "target", "target", "write");
    deploy();
    period_ns = guidance.fsm().period_ns();
    const auto& core = guidance.core_as<GuidanceCore>();
    for (int number = 1; number <= 2; ++number) {
      const std::uint64_t releases = guidance.task().statistics().releases.load();
      wait_until([&] { return guidance.task().statistics().releases.load() > releases + 2; }, "Idle");
      goal.write.write({10.0 * number}, monotonic_now_ns());
      wait_until([&] { return core.reached.load() == number; }, "the goal to be reached");
    }
    deployer.shutdown();
    return read(deployer.drain_trace());
  }

  time_ns_t period_ns{0};

 private:
  static std::vector<Activation> read(const TraceDrain& drain) {
    const std::vector<std::string> names = TraceNames::all();
    std::vector<Activation> activations;
    time_ns_t epoch_ns = 0;
    EXPECT_EQ(0U, drain.dropped.at(0));
    for (const TraceRecord& record : drain.records) {
      switch (static_cast<TraceKind>(record.kind)) {
        case TraceKind::deployment:
          epoch_ns = record.a;
          break;
        case TraceKind::release:
          activations.push_back({record.a - epoch_ns, {}});
          break;
        case TraceKind::state_begin:
          if (activations.empty()) {
            ADD_FAILURE() << names.at(record.name) << " without a release";
          } else {
            activations.back().states.push_back(names.at(record.name));
          }
          break;
        default:
          break;
      }
    }
    // The last release may have been followed by the stop.
    if (!activations.empty() && activations.back().states.empty()) activations.pop_back();
    return activations;
  }
};

using States = std::vector<std::string>;

/// What follows the goal's arrival: from the first activation that plans on. `before`: those that belong to it
/// and come before Planning.
std::vector<Activation> from_planning(const std::vector<Activation>& all, std::size_t before) {
  for (std::size_t i = before; i < all.size(); ++i) {
    if (std::ranges::find(all[i].states, "Planning") != all[i].states.end())
      return {all.begin() + static_cast<std::ptrdiff_t>(i - before), all.end()};
  }
  ADD_FAILURE() << "Guidance never plans";
  return {};
}

TEST_F(GuidanceTrace, PsmExecutesOneActionInAPeriodAndHasOnePeriod) {
  const std::vector<Activation> activations = run<GuidancePsm>();
  EXPECT_EQ(5 * kUnit, period_ns);

  // Limitation 1: never two actions in one period; from I to P and from I to F it takes one.
  EXPECT_THAT(activations, ::testing::Each(::testing::Field(&Activation::states, ::testing::SizeIs(1))));
  const std::vector<Activation> course = from_planning(activations, 1);
  ASSERT_LE(8U, course.size());
  const States expected[] = {{"Idle"}, {"Planning"},  {"Idle"}, {"Following"},
                             {"Idle"}, {"Following"}, {"Idle"}, {"Following"}};
  for (std::size_t i = 0; i < std::size(expected); ++i) {
    EXPECT_EQ(expected[i], course[i].states) << i;
    EXPECT_EQ(static_cast<time_ns_t>(i) * 5 * kUnit, course[i].instant_ns - course[0].instant_ns) << i;
  }

  // Limitation 2: the same period in every state.
  const std::set<time_ns_t> one_period{5 * kUnit};
  EXPECT_EQ((Distances{{{"Idle"}, one_period}, {{"Planning"}, one_period}, {{"Following"}, one_period}}),
            distances_of(activations));
}

TEST_F(GuidanceTrace, ClockBasedFsmGoesOnAtOnceAndHasAPeriodForEachCycle) {
  const std::vector<Activation> activations = run<GuidanceFsm>();
  EXPECT_EQ(kUnit, period_ns);

  // Limitation 1 removed: P and F are executed in the instant of the I that leads to them.
  const std::vector<Activation> course = from_planning(activations, 0);
  ASSERT_LE(4U, course.size());
  EXPECT_EQ((States{"Idle", "Planning"}), course[0].states);
  const time_ns_t first_goal = course[0].instant_ns;
  for (int i = 1; i <= kPathLength; ++i) {
    const Activation& step = course[static_cast<std::size_t>(i)];
    EXPECT_EQ((States{"Idle", "Following"}), step.states) << i;
    EXPECT_EQ((5 + 2 * (i - 1)) * kUnit, step.instant_ns - first_goal) << i;
  }

  // Limitation 2 removed: I-P-I takes 5 units, I-F-I takes 2, I-I takes 1.
  EXPECT_EQ((Distances{{{"Idle", "Planning"}, {5 * kUnit}},
                       {{"Idle", "Following"}, {2 * kUnit}},
                       {{"Idle"}, {1 * kUnit}}}),
            distances_of(activations));
}

}  // namespace mauve::testing::test_elements_guidance
