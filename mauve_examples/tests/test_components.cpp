// SPDX-License-Identifier: LGPL-3.0-or-later
// The five components on real threads: one robot explores a room, its exploration core is replaced on the
// way.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <thread>

#include "robot_architecture.hpp"
#include "test_maps.hpp"

namespace mauve_examples::test_components {

using namespace std::chrono_literals;
using testing::RobotArchitecture;

TEST(Components, PeriodsAreThoseOfTheirMachines) {
  RobotArchitecture robot("room");
  robot.architecture().configure();
  const auto period_ms = [&](const char* name) {
    return robot.component(name).fsm().period_ns() / 1'000'000;
  };
  EXPECT_EQ(period_ms("robot"), 10);
  EXPECT_EQ(period_ms("control"), 20);
  EXPECT_EQ(period_ms("guidance"), 100);  // gcd of the cycles of 5, 2 and 1 units
  EXPECT_EQ(period_ms("mapping"), 100);
  EXPECT_EQ(period_ms("exploration"), 500);
}

TEST(Components, OneRobotExploresARoomWhileItsCoresAreReplaced) {
  RobotArchitecture robot("room");
  robot.architecture().configure();
  mauve::Deployer deployer(robot.architecture(), {.require_realtime = false, .trace = true});
  deployer.deploy();
  std::this_thread::sleep_for(2200ms);
  EXPECT_FALSE(robot.done());
  const auto there = robot.component("exploration").swap_core(std::make_unique<LocalExploration>());
  EXPECT_EQ(there.missed_releases, 0);
  std::this_thread::sleep_for(1200ms);
  const auto back = robot.component("exploration").swap_core(std::make_unique<Exploration>());
  EXPECT_EQ(back.missed_releases, 0);
  EXPECT_TRUE(robot.wait_done(60s));
  deployer.shutdown();
  robot.expect_no_faults();
  EXPECT_GT(robot.coverage(), 0.99);
}

TEST(Components, WithASilentPeerExplorationWaitsAndLocalExplorationDoesNot) {
  RobotArchitecture robot("room", "robot_2");
  robot.architecture().configure();
  mauve::Deployer deployer(robot.architecture(), {.require_realtime = false, .trace = true});
  deployer.deploy();
  std::this_thread::sleep_for(1700ms);
  EXPECT_EQ(robot.goals(), 0U);
  EXPECT_FALSE(robot.done());
  robot.component("exploration").swap_core(std::make_unique<LocalExploration>());
  const auto until = std::chrono::steady_clock::now() + 10s;
  while (robot.goals() == 0 && std::chrono::steady_clock::now() < until) std::this_thread::sleep_for(20ms);
  EXPECT_GT(robot.goals(), 0U);
  deployer.shutdown();
  robot.expect_no_faults();
}

TEST(Components, ReplacingTheRobotsOrTheMappingsCoreLosesNothing) {
  RobotArchitecture robot("arena");
  robot.architecture().configure();
  mauve::Deployer deployer(robot.architecture(), {.require_realtime = false, .trace = true});
  deployer.deploy();
  const auto until = std::chrono::steady_clock::now() + 30s;
  std::this_thread::sleep_for(200ms);  // until the first pose is there
  while (distance_m(robot.pose(), robot.start()) < 4.0 && std::chrono::steady_clock::now() < until) {
    std::this_thread::sleep_for(20ms);
  }
  const double covered = robot.coverage();
  robot.component("mapping").swap_core(std::make_unique<Mapping>());
  EXPECT_GE(robot.coverage(), covered);
  robot.component("robot").swap_core(std::make_unique<Robot>());
  EXPECT_GT(distance_m(robot.pose(), robot.start()), 2.0);
  deployer.shutdown();
  robot.expect_no_faults();
}

TEST(Components, ARobotStandsStillOnceCommandsNoLongerCome) {
  RobotArchitecture robot("arena");
  robot.architecture().configure();
  mauve::Simulation simulation;
  mauve::SimulatedHost& host = simulation.add(robot.architecture());
  simulation.deploy();
  const auto run_for = [&](mauve::time_ns_t time_ns) { simulation.run_until(simulation.now_ns() + time_ns); };
  run_for(mauve::ms_to_ns(100));
  host.stop("control");
  Twist forward;
  forward.linear.x = 0.1;
  const mauve::time_ns_t last_ns = simulation.now_ns() + mauve::s_to_ns(2);
  simulation.every(simulation.now_ns(), mauve::ms_to_ns(20), [&] {
    if (simulation.now_ns() <= last_ns) robot.command(forward, simulation.now_ns());
  });
  simulation.run_until(last_ns);
  const Pose2D last = robot.pose();
  EXPECT_GT(distance_m(last, robot.start()), 0.1);
  run_for(mauve::ms_to_ns(150));  // the robot waits 200 ms for a command
  EXPECT_GT(distance_m(robot.pose(), last), 0.01);
  run_for(mauve::ms_to_ns(350));  // and brakes for 50 ms
  const Pose2D stopped = robot.pose();
  run_for(mauve::s_to_ns(1));
  EXPECT_EQ(distance_m(robot.pose(), stopped), 0.0);
  EXPECT_LT(distance_m(stopped, last), 0.03);
  simulation.shutdown();
  robot.expect_no_faults();
}

/// Where a frame is in the map; looked up at a time at which the robot set it.
Pose2D in_map(const RobotArchitecture& robot, const char* frame, mauve::time_ns_t time_ns) {
  const mauve::TransformBuffer& frames = robot.frames();
  const mauve::TransformLookup found =
      frames.lookup(frames.find("map").value(), frames.find(frame).value(), time_ns);
  EXPECT_EQ(mauve::TransformOutcome::done, found.outcome) << frame;
  const mauve::Transform& transform = found.transform;
  return {transform.translation.x, transform.translation.y,
          2.0 * std::atan2(transform.rotation.z, transform.rotation.w)};
}

void expect_equal(const Pose2D& expected, const Pose2D& found) {
  EXPECT_NEAR(expected.x, found.x, 1e-9);
  EXPECT_NEAR(expected.y, found.y, 1e-9);
  EXPECT_NEAR(0.0, wrap_angle(expected.theta - found.theta), 1e-9);
}

TEST(Components, TheFramesOfARobotAreThoseOfItsPose) {
  RobotArchitecture robot("arena");
  robot.architecture().configure();
  mauve::Simulation simulation;
  mauve::SimulatedHost& host = simulation.add(robot.architecture());
  simulation.deploy();
  const auto expect_frames = [&] {
    expect_equal(robot.pose(), in_map(robot, "robot_1/base", mauve::kLatestCommon));
    expect_equal(robot.pose(), in_map(robot, "robot_1/scan", mauve::kLatestCommon));
    expect_equal(robot.start(), in_map(robot, "robot_1/odom", mauve::kLatestCommon));
    expect_equal(pose_from(robot.start(), robot.pose()), robot.odometry());
  };
  simulation.run_until(simulation.epoch_ns() + mauve::s_to_ns(20));
  EXPECT_GT(distance_m(robot.pose(), robot.start()), 1.0);
  expect_frames();
  mauve::Transaction change;
  change.replace_core("robot", std::make_unique<Robot>());
  host.commit(std::move(change));
  simulation.run_until(simulation.epoch_ns() + mauve::s_to_ns(22));
  expect_frames();
  simulation.shutdown();
  robot.expect_no_faults();
}

/// A robot in virtual time, and who sends it goals as a bridge to ROS does.
class Operator {
 public:
  explicit Operator(const char* map) : robot(map) {
    robot.architecture().configure();
    host_ = &simulation_.add(robot.architecture());
    simulation_.deploy();
  }

  void run_for(mauve::time_ns_t time_ns) {
    const mauve::time_ns_t end_ns = simulation_.now_ns() + time_ns;
    while (simulation_.now_ns() < end_ns) {
      simulation_.run_until(std::min(end_ns, simulation_.now_ns() + mauve::ms_to_ns(100)));
      take_events();
    }
  }
  /// Until the goal has ended, for at most this time.
  void run_to_its_end(mauve::time_ns_t time_ns) {
    const mauve::time_ns_t end_ns = simulation_.now_ns() + time_ns;
    while (!mauve::is_final(state) && simulation_.now_ns() < end_ns) run_for(mauve::ms_to_ns(100));
  }
  void order(const char* frame, double x, double y, double tolerance_m = 0.0) {
    DriveTo::Goal goal;
    goal.tolerance_m = tolerance_m;
    goal.pose.header.frame_id = frame;
    goal.pose.pose.position.x = x;
    goal.pose.pose.position.y = y;
    goal_ = sender_.ask(goal);
    state = mauve::GoalState::unknown;
  }
  void cancel() { EXPECT_TRUE(sender_.cancel(goal_)); }
  void replace_guidance() {
    mauve::Transaction change;
    change.replace_core("guidance", std::make_unique<Guidance>());
    host_->commit(std::move(change));
  }
  double covered_m() { return distance_m(robot.pose(), robot.start()); }
  void end() {
    simulation_.shutdown();
    robot.expect_no_faults();
  }

  RobotArchitecture robot;
  mauve::GoalState state{mauve::GoalState::unknown};
  std::vector<DriveTo::Feedback> feedback;
  DriveTo::Result result;

 private:
  void take_events() {
    for (const auto& event : sender_.events()) {
      EXPECT_EQ(goal_, event.goal);
      if (event.feedback) {
        feedback.push_back(*event.feedback);
      } else {
        state = event.state;
      }
      if (event.result) result = *event.result;
    }
  }

  mauve::Simulation simulation_;
  mauve::SimulatedHost* host_{nullptr};
  mauve::GoalSender<DriveTo> sender_{robot.drive_to(), [this] { return simulation_.now_ns(); }};
  std::uint64_t goal_{0};
};

TEST(Components, AnOperatorsGoalIsReadInAnyFrameAndGoesFirst) {
  Operator user("arena");
  user.run_for(mauve::s_to_ns(20));
  const double far_m = user.covered_m();
  ASSERT_GT(far_m, 2.0);
  user.order("robot_1/odom", 0.0, 0.0, 0.3);  // to the start, which is the origin of the odometry
  user.run_to_its_end(mauve::s_to_ns(40));
  EXPECT_EQ(mauve::GoalState::succeeded, user.state);
  EXPECT_TRUE(user.result.reached);
  EXPECT_LE(user.result.distance_m, 0.3);
  EXPECT_LE(user.covered_m(), 0.4);
  ASSERT_GT(user.feedback.size(), 5U);
  EXPECT_NEAR(far_m, user.feedback.front().distance_m, 1.0);
  EXPECT_LT(user.feedback.back().distance_m, 1.0);
  EXPECT_GT(user.feedback.back().elapsed_s, 1.0);
  user.run_for(mauve::s_to_ns(20));
  EXPECT_GT(user.covered_m(), 1.0) << "it explores on";
  user.end();
}

TEST(Components, AReplacedGuidanceGoesOnWithTheGoal) {
  Operator user("arena");
  user.run_for(mauve::s_to_ns(20));
  const Pose2D base = user.robot.pose();
  user.order("robot_1/base", -3.0, 0.0);  // behind it, where it came from
  user.run_for(mauve::s_to_ns(2));
  ASSERT_FALSE(user.feedback.empty());
  user.replace_guidance();
  user.run_to_its_end(mauve::s_to_ns(40));
  EXPECT_EQ(mauve::GoalState::succeeded, user.state);
  EXPECT_TRUE(std::ranges::is_sorted(user.feedback, {}, &DriveTo::Feedback::elapsed_s));
  const Point behind{base.x - 3.0 * std::cos(base.theta), base.y - 3.0 * std::sin(base.theta), 0.0};
  EXPECT_LE(distance_m(user.robot.pose(), behind), 0.6) << "3 m behind where it was at the beginning";
  user.end();
}

TEST(Components, ACanceledGoalEndsAndTheRobotExploresOn) {
  Operator user("arena");
  user.run_for(mauve::s_to_ns(20));
  user.order("robot_1/odom", 0.0, 0.0);
  user.run_for(mauve::s_to_ns(1));
  EXPECT_EQ(mauve::GoalState::executing, user.state);
  user.cancel();
  user.run_to_its_end(mauve::s_to_ns(2));
  EXPECT_EQ(mauve::GoalState::canceled, user.state);
  EXPECT_GT(user.result.distance_m, 0.5);
  const double covered = user.robot.coverage();
  user.run_for(mauve::s_to_ns(20));
  EXPECT_GT(user.robot.coverage(), covered);
  user.end();
}

TEST(Components, AGoalThatCannotBeReachedIsAborted) {
  Operator user("room");
  user.run_for(mauve::s_to_ns(1));
  user.order("nowhere", 0.0, 0.0);
  user.run_to_its_end(mauve::s_to_ns(1));
  EXPECT_EQ(mauve::GoalState::aborted, user.state) << "an unknown frame";
  EXPECT_TRUE(std::isnan(user.result.distance_m));
  user.order("map", 1000.0, 0.0);
  user.run_to_its_end(mauve::s_to_ns(1));
  EXPECT_EQ(mauve::GoalState::aborted, user.state) << "outside of the map";
  user.order("map", 0.0, 0.0, 0.05);  // inside of the pillar
  user.run_for(mauve::s_to_ns(9));
  EXPECT_EQ(mauve::GoalState::executing, user.state) << "a path may be free later";
  user.run_to_its_end(mauve::s_to_ns(60));
  EXPECT_EQ(mauve::GoalState::aborted, user.state);
  EXPECT_GT(user.result.distance_m, 0.05);
  user.order("", 0.0, 0.0, 1e3);  // in the map
  user.run_to_its_end(mauve::s_to_ns(1));
  EXPECT_EQ(mauve::GoalState::succeeded, user.state);
  user.end();
}

TEST(Components, ARobotWithoutDeclaredFramesIsRefused) {
  RobotArchitecture robot("arena", "", false);
  try {
    robot.architecture().configure();
    FAIL() << "configured";
  } catch (const mauve::Error& error) {
    EXPECT_THAT(error.what(), ::testing::HasSubstr("port odometry"));
    EXPECT_THAT(error.what(), ::testing::HasSubstr("`frames` of the component"));
  }
}

TEST(Components, ARobotThatDoesNotFitIsRefused) {
  RobotArchitecture robot("room");
  robot.component("robot").set_property("start_x", 0.0);
  robot.component("robot").set_property("start_y", 0.0);  // inside the pillar
  EXPECT_THROW(robot.architecture().configure(), mauve::Error);
}

TEST(Components, ExplorationOfOtherPeersIsNotTakenOver) {
  RobotArchitecture robot("room", "robot_2");
  robot.architecture().configure();
  RobotArchitecture stranger("room", "robot_3");
  stranger.architecture().configure();
  auto& mine = robot.component("exploration").core();
  EXPECT_FALSE(mine.adopt(stranger.component("exploration").core()));
  EXPECT_TRUE(mine.adopt(mine));
  RobotArchitecture elsewhere("arena", "robot_2");
  elsewhere.architecture().configure();
  EXPECT_FALSE(mine.adopt(elsewhere.component("exploration").core()));
}

}  // namespace mauve_examples::test_components
