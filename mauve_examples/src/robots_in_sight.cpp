// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_examples/robots_in_sight.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "mauve_examples/disc_collision.hpp"
#include "mauve_examples/ray_caster.hpp"

namespace mauve_examples {

void robots_in_sight(const Scan& scan, const Pose2D& pose, Sightings& found) noexcept {
  struct Side {
    Direction sum{0.0, 0.0};  // of its beams
    double nearest_m{std::numeric_limits<double>::infinity()};
  };
  std::array<Side, kMaxSightings + 1> sides;
  const Direction heading{std::cos(pose.theta), std::sin(pose.theta)};
  for (std::size_t i = 0; i < kBeamCount; ++i) {
    const std::uint8_t number = scan.robots[i];
    if (number == 0 || number > kMaxSightings) continue;
    const Direction beam = beam_table().direction(i, heading);
    Side& side = sides[number];
    side.sum = {side.sum.x + beam.x, side.sum.y + beam.y};
    side.nearest_m = std::min(side.nearest_m, static_cast<double>(scan.ranges_m[i]));
  }
  found.clear();
  for (std::size_t number = 1; number < sides.size(); ++number) {
    const Side& side = sides[number];
    const double length = std::hypot(side.sum.x, side.sum.y);
    if (!(length > 0.0)) continue;
    const double away_m = side.nearest_m + kRobotRadius_m;
    found.push_back({static_cast<std::uint8_t>(number),
                     {pose.x + away_m * side.sum.x / length, pose.y + away_m * side.sum.y / length, 0.0}});
  }
}

Twist keep_apart(const Twist& wanted, const Scan& scan, const ApartOptions& options) noexcept {
  Twist command = wanted;
  for (std::size_t i = 0; i < kBeamCount && command.linear.x > 0.0; ++i) {
    if (scan.robots[i] == 0) continue;
    const double bearing_rad =
        2.0 * std::numbers::pi * static_cast<double>(std::min(i, kBeamCount - i)) / kBeamCount;
    const double approach = std::cos(std::max(0.0, bearing_rad - options.turning_rad));
    if (approach <= 0.0) continue;
    const double gap_m = static_cast<double>(scan.ranges_m[i]) - kRobotRadius_m - options.gap_m;
    // The way until it stands, delay and braking, towards the other: v * delay + v^2 / (2 * braking) <= room.
    const double room_m = std::max(0.0, 0.5 * gap_m / approach);
    const double delay_mps = options.braking_mps2 * options.delay_s;
    const double limit_mps =
        std::sqrt(delay_mps * delay_mps + 2.0 * options.braking_mps2 * room_m) - delay_mps;
    command.linear.x = std::min(command.linear.x, limit_mps);
  }
  return command;
}

}  // namespace mauve_examples
