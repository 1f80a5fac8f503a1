// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_examples/unicycle.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace mauve_examples {

namespace {

/// Moves a velocity towards the wanted one, within its limit and by at most max_change.
double approach(double velocity, double wanted, double limit, double max_change) noexcept {
  // A command that is no number is no command.
  const double target = std::isfinite(wanted) ? std::clamp(wanted, -limit, limit) : 0.0;
  return velocity + std::clamp(target - velocity, -max_change, max_change);
}

}  // namespace

double wrap_angle(double angle_rad) noexcept {
  const double wrapped = std::remainder(angle_rad, 2.0 * std::numbers::pi);
  return wrapped <= -std::numbers::pi ? std::numbers::pi : wrapped;
}

Pose2D pose_from(const Pose2D& origin, const Pose2D& pose) noexcept {
  const double cosine = std::cos(origin.theta);
  const double sine = std::sin(origin.theta);
  const double x = pose.x - origin.x;
  const double y = pose.y - origin.y;
  return {x * cosine + y * sine, y * cosine - x * sine, wrap_angle(pose.theta - origin.theta)};
}

void Unicycle::step(const Twist& command, const UnicycleLimits& limits, double step_s) noexcept {
  speed_mps = approach(speed_mps, command.linear.x, limits.speed_mps, limits.acceleration_mps2 * step_s);
  turn_rate_radps = approach(turn_rate_radps, command.angular.z, limits.turn_rate_radps,
                             limits.turn_acceleration_radps2 * step_s);
  const double turn_rad = turn_rate_radps * step_s;
  const double length_m = speed_mps * step_s;
  // The chord of the arc: sin(x)/x tends to 1 for small turns.
  const double half_rad = 0.5 * turn_rad;
  const double chord_m = std::abs(half_rad) < 1e-6 ? length_m : length_m * std::sin(half_rad) / half_rad;
  pose.x += chord_m * std::cos(pose.theta + half_rad);
  pose.y += chord_m * std::sin(pose.theta + half_rad);
  pose.theta = wrap_angle(pose.theta + turn_rad);
}

}  // namespace mauve_examples
