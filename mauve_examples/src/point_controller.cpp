// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_examples/point_controller.hpp"

#include <algorithm>
#include <cmath>

#include "mauve_examples/grid_geometry.hpp"
#include "mauve_examples/unicycle.hpp"

namespace mauve_examples {

double Pid::step(double error, double step_s) noexcept {
  const double slope = has_last_ && step_s > 0.0 ? (error - last_error_) / step_s : 0.0;
  last_error_ = error;
  has_last_ = true;
  // The integral alone never asks for more than the limit: it must not wind up while the robot cannot follow.
  const double bound = gains_.integral > 0.0 ? limit_ / gains_.integral : 0.0;
  integral_ = std::clamp(integral_ + error * step_s, -bound, bound);
  const double output = gains_.proportional * error + gains_.integral * integral_ + gains_.derivative * slope;
  return std::clamp(output, -limit_, limit_);
}

void Pid::reset() noexcept {
  integral_ = 0.0;
  has_last_ = false;
}

void PointController::set_options(const ControlOptions& options) noexcept {
  options_ = options;
  heading_.set_gains(options.heading, options.max_turn_rate_radps);
  distance_.set_gains(options.distance, options.max_speed_mps);
}

Twist PointController::step(const Pose2D& pose, const Point& target, double step_s) noexcept {
  Twist command;
  const double distance = distance_m(pose, target);
  if (distance < options_.arrival_m) {
    reset();
    return command;
  }
  const double bearing_rad = wrap_angle(std::atan2(target.y - pose.y, target.x - pose.x) - pose.theta);
  command.angular.z = heading_.step(bearing_rad, step_s);
  // The cube stops the robot well before a right angle: curves stay tight where walls are near.
  const double ahead = std::max(0.0, std::cos(bearing_rad));
  command.linear.x = std::max(0.0, distance_.step(distance, step_s)) * ahead * ahead * ahead;
  return command;
}

void PointController::reset() noexcept {
  heading_.reset();
  distance_.reset();
}

}  // namespace mauve_examples
