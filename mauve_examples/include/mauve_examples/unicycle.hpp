// SPDX-License-Identifier: LGPL-3.0-or-later
// How the simulated robot moves: a unicycle with limits on its velocities and accelerations.
#pragma once

#include "mauve_examples/types.hpp"

namespace mauve_examples {

/// The same angle within (-pi, pi]. [rt]
double wrap_angle(double angle_rad) noexcept;
/// The pose as seen from another one of the same frame. [rt]
Pose2D pose_from(const Pose2D& origin, const Pose2D& pose) noexcept;

struct UnicycleLimits {
  double speed_mps{1.0};
  double turn_rate_radps{2.5};
  double acceleration_mps2{2.0};
  double turn_acceleration_radps2{10.0};
};

/// Pose and velocities of a robot that drives along its heading and turns about its centre.
struct Unicycle {
  Pose2D pose;
  double speed_mps{0.0};
  double turn_rate_radps{0.0};

  /// Follows the command for step_s within the limits, along an exact arc. [rt]
  void step(const Twist& command, const UnicycleLimits& limits, double step_s) noexcept;
};

}  // namespace mauve_examples
