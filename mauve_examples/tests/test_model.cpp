// SPDX-License-Identifier: LGPL-3.0-or-later
// The components generated from model.yaml, beside the same written by hand, in virtual time.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "robot_architecture.hpp"

namespace mauve_examples::test_model {

using mauve::ms_to_ns;
using mauve::State;

/// The fsms of the mission, written by hand.
struct HandWrittenFsms {
  struct RobotFsm : mauve::Fsm<RobotShell, RobotCore> {
    void define() override {
      State& move = execution("Move", "move", &RobotCore::move);
      State& sense = execution("Sense", "sense", &RobotCore::sense);
      State& pause = wait("Pause", ms_to_ns(10));
      set_initial(move);
      next(move, sense);
      next(sense, pause);
      next(pause, move);
    }
  };
  struct ControlFsm : mauve::Fsm<ControlShell, ControlCore> {
    void define() override {
      State& control = execution("Control", "control", &ControlCore::control);
      State& pause = wait("Pause", ms_to_ns(20));
      set_initial(control);
      next(control, pause);
      next(pause, control);
    }
  };
  struct GuidanceFsm : mauve::Fsm<GuidanceShell, GuidanceCore> {
    void define() override {
      const mauve::time_ns_t unit_ns = ms_to_ns(shell().unit_ms);
      State& idle = execution("Idle", "read_inputs", &GuidanceCore::read_inputs);
      State& planning = execution("Planning", "compute_path", &GuidanceCore::compute_path);
      State& following = execution("Following", "follow_path", &GuidanceCore::follow_path);
      State& w1 = wait("W1", unit_ns);
      State& w2 = wait("W2", 2 * unit_ns);
      State& w3 = wait("W3", 5 * unit_ns);
      set_initial(idle);
      transition(idle, "has_new_goal", &GuidanceCore::has_new_goal, planning);
      transition(idle, "has_path", &GuidanceCore::has_path, following);
      next(idle, w1);
      next(w1, idle);
      next(following, w2);
      next(w2, idle);
      next(planning, w3);
      next(w3, idle);
    }
  };
  struct MappingFsm : mauve::Fsm<MappingShell, MappingCore> {
    void define() override {
      State& integrate = execution("Integrate", "integrate", &MappingCore::integrate);
      State& pause = wait("Pause", ms_to_ns(100));
      set_initial(integrate);
      next(integrate, pause);
      next(pause, integrate);
    }
  };
  struct ExplorationFsm : mauve::Fsm<ExplorationShell, ExplorationCore> {
    void define() override {
      State& look = execution("Look", "look", &ExplorationCore::look);
      State& decide = execution("Decide", "decide", &ExplorationCore::decide);
      State& tell = execution("Tell", "tell", &ExplorationCore::tell);
      State& pause = wait("Pause", ms_to_ns(500));
      set_initial(look);
      next(look, decide);
      next(decide, tell);
      next(tell, pause);
      next(pause, look);
    }
  };
};

/// Fig. 2 of the paper, written by hand.
struct HandWrittenPsm : mauve::PeriodicFsm<GuidanceShell, GuidanceCore> {
  void define() override {
    period(5 * ms_to_ns(shell().unit_ms));
    const PeriodicState idle = periodic_state("Idle", "read_inputs", &GuidanceCore::read_inputs);
    const PeriodicState planning = periodic_state("Planning", "compute_path", &GuidanceCore::compute_path);
    const PeriodicState following = periodic_state("Following", "follow_path", &GuidanceCore::follow_path);
    set_initial(idle);
    transition(idle, "has_new_goal", &GuidanceCore::has_new_goal, planning);
    transition(idle, "has_path", &GuidanceCore::has_path, following);
    next(idle, idle);
    next(planning, idle);
    next(following, idle);
  }
};
struct GeneratedWithPsm : testing::GeneratedFsms {
  using GuidanceFsm = mauve_examples::GuidancePsm;
};
struct HandWrittenWithPsm : HandWrittenFsms {
  using GuidanceFsm = HandWrittenPsm;
};

/// Listing 1 of the paper and the map, written by hand.
namespace hand_written {
struct GuidanceShell : mauve::Shell {
  mauve::Property<double>& target_threshold = property(
      "target_threshold", 0.5,
      {.unit = "m", .description = "nearer than this a point is reached", .minimum = 0.05, .maximum = 5.0});
  mauve::Property<double>& path_step =
      property("path_step", 1.0,
               {.unit = "m", .description = "between points of the path", .minimum = 0.1, .maximum = 20.0});
  mauve::Property<std::string>& map = property(
      "map", "", {.description = "YAML file: how large the world is", .structural = mauve::ReadBy::core});
  mauve::Property<std::int64_t>& unit_ms = property("unit_ms", 100,
                                                    {.unit = "ms",
                                                     .description = "of the waits: 1, 2 and 5 units",
                                                     .minimum = 1,
                                                     .maximum = 10000,
                                                     .structural = mauve::ReadBy::fsm});
  mauve::Property<std::int64_t>& number = property("number", 1,
                                                   {.unit = "",
                                                    .description = "of this robot: lower ones go first",
                                                    .minimum = 1,
                                                    .maximum = 16,
                                                    .structural = mauve::ReadBy::core});

  mauve::ReadPort<Pose2D>& pose = read_port<Pose2D>("pose").in_frame("map");
  mauve::ReadPort<Scan>& scan = read_port<Scan>("scan");
  mauve::ReadPort<Point>& goal = read_port<Point>("goal").in_frame("map");
  mauve::ReadPort<mauve::ActionGoal>& drive_to_status =
      read_port<mauve::ActionGoal>("drive_to_status").optional();
  mauve::ReadPort<DriveTo::Goal>& drive_to_goal = read_port<DriveTo::Goal>("drive_to_goal").optional();
  mauve::WritePort<mauve::ActionGoal>& drive_to_decide =
      write_port<mauve::ActionGoal>("drive_to_decide").optional();
  mauve::WritePort<DriveTo::Feedback>& drive_to_feedback =
      write_port<DriveTo::Feedback>("drive_to_feedback").optional();
  mauve::WritePort<DriveTo::Result>& drive_to_result =
      write_port<DriveTo::Result>("drive_to_result").optional();
  mauve::WritePort<Point>& target = write_port<Point>("target", {.on_commit = mauve::OutputPolicy::hold,
                                                                 .on_stop = mauve::OutputPolicy::hold})
                                        .in_frame("map");
  mauve::CallPort<void(MapReader)>& map_get = call_port<void(MapReader)>("map_get", kMapReaderType);
  mauve::CallPort<mauve::CallOf<mauve::LookupTransform>>& lookup =
      call_port<mauve::LookupTransform>("lookup");
};
}  // namespace hand_written

/// A robot that explores the room for 40 s: all that its threads record.
template <typename Fsms>
std::vector<std::string> trace() {
  testing::RobotArchitectureOf<Fsms> robot("room");
  robot.architecture().configure();
  mauve::Simulation simulation;
  simulation.add(robot.architecture());
  simulation.deploy();
  std::vector<std::string> all;
  for (int second = 1; second <= 40; ++second) {
    simulation.run_until(simulation.epoch_ns() + mauve::s_to_ns(second));
    const mauve::TraceDrain drain = robot.architecture().drain_trace();
    EXPECT_TRUE(std::ranges::all_of(drain.dropped, [](std::uint64_t lost) { return lost == 0; }));
    const std::vector<std::string> names = mauve::TraceNames::all();
    for (const mauve::TraceRecord& record : drain.records) {
      all.push_back(std::to_string(record.time_ns) + " component " + std::to_string(record.component) +
                    " kind " + std::to_string(record.kind) + " " + names.at(record.name) + " " +
                    std::to_string(record.a) + " " + std::to_string(record.b) + " " +
                    std::to_string(record.c));
    }
  }
  EXPECT_GT(robot.coverage(), 0.3);
  simulation.shutdown();
  return all;
}

TEST(Model, GeneratedComponentsRunAsTheHandWrittenOnesRecordByRecord) {
  const std::vector<std::string> generated = trace<testing::GeneratedFsms>();
  EXPECT_GT(generated.size(), 30'000U);
  EXPECT_EQ(trace<HandWrittenFsms>(), generated);
}

TEST(Model, TheGeneratedPeriodicMachineRunsAsTheHandWrittenOne) {
  const std::vector<std::string> generated = trace<GeneratedWithPsm>();
  EXPECT_NE(trace<testing::GeneratedFsms>(), generated);
  EXPECT_EQ(trace<HandWrittenWithPsm>(), generated);
}

TEST(Model, TheGeneratedShellDeclaresWhatListing1Does) {
  const GuidanceShell generated;
  const hand_written::GuidanceShell expected;
  ASSERT_EQ(expected.ports().size(), generated.ports().size());
  for (std::size_t i = 0; i < expected.ports().size(); ++i) {
    const mauve::PortBase& port = *generated.ports()[i];
    const mauve::PortBase& by_hand = *expected.ports()[i];
    EXPECT_EQ(by_hand.name(), port.name());
    EXPECT_EQ(by_hand.kind(), port.kind());
    EXPECT_EQ(by_hand.type(), port.type());
    EXPECT_EQ(by_hand.is_required(), port.is_required());
    EXPECT_EQ(by_hand.frames(), port.frames()) << port.name();
    EXPECT_EQ(by_hand.output().on_commit, port.output().on_commit) << port.name();
    EXPECT_EQ(by_hand.output().on_stop, port.output().on_stop) << port.name();
  }
  ASSERT_EQ(expected.properties().size(), generated.properties().size());
  for (std::size_t i = 0; i < expected.properties().size(); ++i) {
    const mauve::PropertyBase& property = *generated.properties()[i];
    const mauve::PropertyBase& by_hand = *expected.properties()[i];
    EXPECT_EQ(by_hand.name(), property.name());
    EXPECT_EQ(by_hand.boxed(), property.boxed());
    EXPECT_EQ(by_hand.options(), property.options()) << property.name();
  }
}

}  // namespace mauve_examples::test_model
