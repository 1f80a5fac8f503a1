// SPDX-License-Identifier: LGPL-3.0-or-later
// Arcs of a differential drive and splines of a joint, held against what they have to satisfy.
#include <cmath>
#include <numbers>

#include "mauve_rt/elements/differential_drive.hpp"
#include "mauve_rt/elements/joint_spline.hpp"

#include "fixtures.hpp"

namespace mauve::testing::test_elements_motion {

using std::numbers::pi;

constexpr DifferentialDrive kDrive{.wheel_radius_m = 0.1, .wheel_separation_m = 0.5};
constexpr double kPrecision = 1e-12;

TEST(DifferentialDriveArcs, AreExactHoweverFewSteps) {
  // A quarter of a circle of 2 m to the left: the wheels roll on 1.75 m and 2.25 m.
  const WheelPair turns{1.75 * pi / 2 / 0.1, 2.25 * pi / 2 / 0.1};
  for (const int steps : {1, 7}) {
    types::Pose2D pose{.x = 1.0, .y = 2.0, .theta = pi / 2};
    for (int i = 0; i < steps; ++i) kDrive.move(pose, {turns.left / steps, turns.right / steps});
    EXPECT_NEAR(1.0 - 2.0, pose.x, kPrecision);
    EXPECT_NEAR(2.0 + 2.0, pose.y, kPrecision);
    EXPECT_NEAR(pi, std::abs(pose.theta), kPrecision);
  }
}

TEST(DifferentialDriveArcs, OfNoTurnAreLinesAndOfNoWayAreTurns) {
  types::Pose2D pose{.theta = pi / 6};
  kDrive.move(pose, {20.0, 20.0});
  EXPECT_NEAR(2.0 * std::cos(pi / 6), pose.x, kPrecision);
  EXPECT_NEAR(2.0 * 0.5, pose.y, kPrecision);
  kDrive.move(pose, {-2.5 * pi / 6, 2.5 * pi / 6});
  EXPECT_NEAR(pi / 3, pose.theta, kPrecision);
  EXPECT_NEAR(2.0 * 0.5, pose.y, kPrecision);
  // Where sin(x) / x gives way to 1 nothing jumps.
  for (const double turn : {0.9e-8, 1.1e-8}) {
    types::Pose2D straight;
    kDrive.move(straight, {10.0 - 5.0 * turn, 10.0 + 5.0 * turn});
    EXPECT_NEAR(1.0, straight.x, kPrecision);
  }
}

TEST(DifferentialDriveWheels, TurnAsTheRobotMoves) {
  const WheelPair wheels = kDrive.wheels(0.7, -1.2);
  EXPECT_NEAR(0.7, kDrive.forward(wheels), kPrecision);
  EXPECT_NEAR(-1.2, kDrive.yaw(wheels), kPrecision);
  EXPECT_NEAR((0.7 + 1.2 * 0.25) / 0.1, wheels.left, kPrecision);
}

TEST(JointSpline, MeetsBothEndsInAllThatItsOrderSays) {
  const JointMotion from{.position = 0.3, .velocity = -0.8, .acceleration = 2.0};
  const JointMotion to{.position = -1.1, .velocity = 0.4, .acceleration = -3.0};
  constexpr double kDurationS = 0.7;
  for (const SplineOrder order : {SplineOrder::linear, SplineOrder::cubic, SplineOrder::quintic}) {
    const JointMotion begin = interpolate(from, to, kDurationS, 0.0, order);
    const JointMotion end = interpolate(from, to, kDurationS, kDurationS, order);
    EXPECT_NEAR(from.position, begin.position, kPrecision);
    EXPECT_NEAR(to.position, end.position, kPrecision);
    if (order == SplineOrder::linear) {
      EXPECT_NEAR(-1.4 / 0.7, begin.velocity, kPrecision);
      EXPECT_NEAR(0.0, begin.acceleration, kPrecision);
    } else {
      EXPECT_NEAR(from.velocity, begin.velocity, kPrecision);
      EXPECT_NEAR(to.velocity, end.velocity, kPrecision);
    }
    if (order == SplineOrder::quintic) {
      EXPECT_NEAR(from.acceleration, begin.acceleration, kPrecision);
      EXPECT_NEAR(to.acceleration, end.acceleration, kPrecision);
    }
    // Velocity and acceleration are the derivatives of the position.
    constexpr double kStepS = 1e-4;
    const auto at = [&](double s) { return interpolate(from, to, kDurationS, s, order); };
    for (const double s : {0.1, 0.3, 0.6}) {
      EXPECT_NEAR((at(s + kStepS).position - at(s - kStepS).position) / (2 * kStepS), at(s).velocity, 1e-5);
      EXPECT_NEAR((at(s + kStepS).velocity - at(s - kStepS).velocity) / (2 * kStepS), at(s).acceleration,
                  1e-4);
    }
  }
}

}  // namespace mauve::testing::test_elements_motion
