// SPDX-License-Identifier: LGPL-3.0-or-later
// Kinematics of a robot with two driven wheels on one axis.
#pragma once

#include <cmath>
#include <numbers>

#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/elements/types.hpp"

namespace mauve {

/// Angles or angular velocities of the wheels: rad or rad/s.
struct WheelPair {
  double left{0.0};
  double right{0.0};
};

/// All functions [rt].
struct DifferentialDrive {
  double wheel_radius_m{0.0};
  double wheel_separation_m{0.0};

  /// The wheels' velocities for a forward velocity in m/s and a yaw rate in rad/s.
  WheelPair wheels(double forward_m_s, double yaw_rad_s) const MAUVE_RT {
    const double difference_m_s = yaw_rad_s * wheel_separation_m / 2.0;
    return {(forward_m_s - difference_m_s) / wheel_radius_m, (forward_m_s + difference_m_s) / wheel_radius_m};
  }
  /// The way of the axis's centre for turns of the wheels; their velocities for velocities.
  double forward(const WheelPair& turns) const MAUVE_RT {
    return wheel_radius_m * (turns.left + turns.right) / 2.0;
  }
  double yaw(const WheelPair& turns) const MAUVE_RT {
    return wheel_radius_m * (turns.right - turns.left) / wheel_separation_m;
  }
  /// Moves the pose along the arc that the wheels have rolled. Exact while the ratio of their velocities is constant; theta stays
  /// within pi.
  void move(types::Pose2D& pose, const WheelPair& turns) const MAUVE_RT {
    const double way_m = forward(turns);
    const double half = yaw(turns) / 2.0;
    // The chord of the arc, in the direction of its middle; below the limit sin(x) / x is 1 in double precision.
    const double chord_m = std::abs(half) < 1e-8 ? way_m : way_m * MAUVE_RT_TRUSTED(std::sin(half)) / half;
    pose.x += chord_m * MAUVE_RT_TRUSTED(std::cos(pose.theta + half));
    pose.y += chord_m * MAUVE_RT_TRUSTED(std::sin(pose.theta + half));
    pose.theta = MAUVE_RT_TRUSTED(std::remainder(pose.theta + 2.0 * half, 2.0 * std::numbers::pi));
  }
};

}  // namespace mauve
