// SPDX-License-Identifier: LGPL-3.0-or-later
// Drives a unicycle to a point: one PID for the heading, one for the distance.
#pragma once

#include "mauve_examples/types.hpp"

namespace mauve_examples {

struct PidGains {
  double proportional{0.0};
  double integral{0.0};
  double derivative{0.0};
};

/// A PID controller with a bounded integral and output. Not thread-safe.
class Pid {
 public:
  /// [rt]
  void set_gains(const PidGains& gains, double limit) noexcept {
    gains_ = gains;
    limit_ = limit;
  }
  /// The output for the error after another step_s. [rt]
  double step(double error, double step_s) noexcept;
  /// Forgets the past. [rt]
  void reset() noexcept;

 private:
  PidGains gains_;
  double limit_{0.0};
  double integral_{0.0};
  double last_error_{0.0};
  bool has_last_{false};
};

struct ControlOptions {
  PidGains heading{4.0, 0.0, 0.1};
  PidGains distance{2.0, 0.0, 0.0};
  double max_speed_mps{1.0};
  double max_turn_rate_radps{2.5};
  double arrival_m{0.05};  // nearer than this the robot is there
};

/// Velocity commands towards a target: turns on the spot when it lies behind, slows while turning.
class PointController {
 public:
  /// [rt]
  void set_options(const ControlOptions& options) noexcept;
  /// The command for the next step_s. [rt]
  Twist step(const Pose2D& pose, const Point& target, double step_s) noexcept;
  /// Forgets the past, as when control was interrupted. [rt]
  void reset() noexcept;

 private:
  ControlOptions options_;
  Pid heading_;
  Pid distance_;
};

}  // namespace mauve_examples
