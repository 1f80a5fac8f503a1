// SPDX-License-Identifier: LGPL-3.0-or-later
// How robots move: kinematics, collisions, control.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <span>

#include "mauve_examples/disc_collision.hpp"
#include "mauve_examples/point_controller.hpp"
#include "mauve_examples/ray_caster.hpp"
#include "mauve_examples/robots_in_sight.hpp"
#include "mauve_examples/unicycle.hpp"
#include "test_maps.hpp"

namespace mauve_examples::test_motion {

constexpr double kPi = std::numbers::pi;

Twist velocity(double forward_mps, double turn_radps) {
  Twist command;
  command.linear.x = forward_mps;
  command.angular.z = turn_radps;
  return command;
}

TEST(Angles, AreWrappedIntoTheHalfOpenCircle) {
  EXPECT_NEAR(wrap_angle(3.0 * kPi), kPi, 1e-12);
  EXPECT_NEAR(wrap_angle(-kPi), kPi, 1e-12);
  EXPECT_NEAR(wrap_angle(-0.5), -0.5, 1e-12);
  EXPECT_NEAR(wrap_angle(7.0), 7.0 - 2.0 * kPi, 1e-12);
}

TEST(Unicycle, KeepsItsLimits) {
  Unicycle robot;
  const UnicycleLimits limits{};
  for (int i = 0; i < 200; ++i) {
    const Unicycle before = robot;
    robot.step(velocity(5.0, -9.0), limits, 0.01);
    EXPECT_LE(robot.speed_mps - before.speed_mps, limits.acceleration_mps2 * 0.01 + 1e-12);
    EXPECT_LE(before.turn_rate_radps - robot.turn_rate_radps, limits.turn_acceleration_radps2 * 0.01 + 1e-12);
  }
  EXPECT_DOUBLE_EQ(robot.speed_mps, limits.speed_mps);
  EXPECT_DOUBLE_EQ(robot.turn_rate_radps, -limits.turn_rate_radps);
}

TEST(Unicycle, DrivesCircles) {
  Unicycle robot;
  const UnicycleLimits limits{1.0, 2.5, 1e9, 1e9};
  for (int i = 0; i < 628; ++i) robot.step(velocity(0.5, 1.0), limits, 2.0 * kPi / 628.0);
  EXPECT_NEAR(robot.pose.x, 0.0, 1e-9);
  EXPECT_NEAR(robot.pose.y, 0.0, 1e-9);
  EXPECT_NEAR(robot.pose.theta, 0.0, 1e-9);
}

TEST(Unicycle, TakesNonsenseForAStop) {
  Unicycle robot;
  robot.step(velocity(std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()), {},
             0.01);
  EXPECT_EQ(robot.speed_mps, 0.0);
  EXPECT_EQ(robot.turn_rate_radps, 0.0);
}

TEST(DiscCollision, IsExactAtSidesAndCorners) {
  const GridMap map = testing::drawn({"...", ".#.", "..."});
  EXPECT_FALSE(disc_collides(map, 0.79, 1.5, 0.2));
  EXPECT_TRUE(disc_collides(map, 0.81, 1.5, 0.2));
  const double corner = 1.0 - 0.2 / std::numbers::sqrt2;
  EXPECT_FALSE(disc_collides(map, corner - 0.001, corner - 0.001, 0.2));
  EXPECT_TRUE(disc_collides(map, corner + 0.001, corner + 0.001, 0.2));
}

TEST(DiscCollision, CountsUnknownCellsAndTheMapsEnd) {
  const GridMap map = testing::drawn({"..", ". "});
  EXPECT_TRUE(disc_collides(map, 0.1, 1.5, 0.2));
  EXPECT_TRUE(disc_collides(map, 0.9, 0.5, 0.2));
  EXPECT_FALSE(disc_collides(map, 0.5, 1.5, 0.2));
}

TEST(DiscCollision, CountsCellsThatAreNotFree) {
  GridMap map = testing::drawn({".."});
  EXPECT_FALSE(disc_collides(map, 0.9, 0.5, 0.2));
  map.cells[1] = 1;  // of a map in mode scale or raw
  EXPECT_TRUE(disc_collides(map, 0.9, 0.5, 0.2));
}

TEST(PointController, ArrivesFromEverySideWithoutOvershooting) {
  for (const double heading_rad : {0.0, 1.0, kPi / 2.0, 2.5, kPi, -2.0}) {
    Unicycle robot;
    robot.pose.theta = heading_rad;
    PointController controller;
    controller.set_options({});
    double closest_m = 10.0;
    for (int i = 0; i < 1000; ++i) {
      const Twist command = controller.step(robot.pose, {3.0, 1.0, 0.0}, 0.02);
      EXPECT_LE(std::abs(command.linear.x), 1.0);
      for (int step = 0; step < 2; ++step) robot.step(command, {}, 0.01);
      closest_m = std::min(closest_m, std::hypot(robot.pose.x - 3.0, robot.pose.y - 1.0));
    }
    EXPECT_LT(closest_m, 0.08) << heading_rad;
    EXPECT_LT(std::hypot(robot.pose.x - 3.0, robot.pose.y - 1.0), 0.1) << heading_rad;
    EXPECT_EQ(robot.speed_mps, 0.0);
  }
}

TEST(PointController, TurnsOnTheSpotForWhatLiesBehind) {
  PointController controller;
  controller.set_options({});
  const Twist command = controller.step({0.0, 0.0, 0.0}, {-2.0, 0.1, 0.0}, 0.02);
  EXPECT_EQ(command.linear.x, 0.0);
  EXPECT_GT(command.angular.z, 1.0);
}

Scan scan_of(const GridMap& map, const Pose2D& pose, std::initializer_list<RobotBody> robots) {
  Scan scan;
  range_scan(map, pose, 5.0F, scan);
  scan_robots(std::span(robots.begin(), robots.size()), pose, scan);
  return scan;
}

TEST(RobotsInSight, AreSeenWhereTheyStand) {
  const GridMap map = testing::drawn({"......", "......", "......", "......"});
  const Pose2D pose{1.0, 2.0, 0.7};
  Sightings found;
  robots_in_sight(scan_of(map, pose, {{2, 3.0, 2.5, 0.2}, {5, 1.0, 1.3, 0.2}}), pose, found);
  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(found[0].number, 2);
  EXPECT_LT(std::hypot(found[0].at.x - 3.0, found[0].at.y - 2.5), 0.02);
  EXPECT_EQ(found[1].number, 5);
  EXPECT_LT(std::hypot(found[1].at.x - 1.0, found[1].at.y - 1.3), 0.02);
}

TEST(RobotsInSight, NotBehindAWallNorTooFarAway) {
  const GridMap map = testing::drawn({"..#...", "..#...", "..#...", "..#..."});
  const Pose2D pose{1.0, 2.0, 0.0};
  Sightings found;
  robots_in_sight(scan_of(map, pose, {{2, 4.0, 2.0, 0.2}}), pose, found);
  EXPECT_TRUE(found.empty());
  const GridMap hall = testing::drawn({"............", "............"});
  robots_in_sight(scan_of(hall, {1.0, 1.0, 0.0}, {{2, 7.0, 1.0, 0.2}}), {1.0, 1.0, 0.0}, found);
  EXPECT_TRUE(found.empty());
}

TEST(KeepApart, SlowsTowardsARobotAndNotAwayFromIt) {
  const GridMap map = testing::drawn({"......", "......", "......", "......"});
  const Pose2D pose{1.0, 2.0, 0.0};
  const auto speed_mps = [&](double x_m, double y_m) {
    return keep_apart(velocity(1.0, 0.5), scan_of(map, pose, {{2, x_m, y_m, 0.2}}), {}).linear.x;
  };
  EXPECT_EQ(speed_mps(1.45, 2.0), 0.0);
  EXPECT_GT(speed_mps(1.9, 2.0), 0.1);
  EXPECT_LT(speed_mps(1.9, 2.0), speed_mps(2.4, 2.0));
  EXPECT_EQ(speed_mps(4.5, 2.0), 1.0);
  EXPECT_EQ(speed_mps(0.55, 2.0), 1.0);
  EXPECT_EQ(keep_apart(velocity(1.0, 0.5), scan_of(map, pose, {{2, 1.45, 2.0, 0.2}}), {}).angular.z, 0.5);
}

TEST(Pid, TheIntegralDoesNotWindUp) {
  Pid pid;
  pid.set_gains({0.0, 1.0, 0.0}, 1.0);
  for (int i = 0; i < 10'000; ++i) EXPECT_LE(pid.step(5.0, 0.1), 1.0);
  // Bounded by the output's limit, it is unwound as soon.
  for (int i = 0; i < 5; ++i) pid.step(-5.0, 0.1);
  EXPECT_LT(pid.step(-5.0, 0.1), 0.0);
}

}  // namespace mauve_examples::test_motion
