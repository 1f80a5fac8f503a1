// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_examples/ray_caster.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace mauve_examples {

BeamTable::BeamTable() noexcept {
  for (std::size_t i = 0; i < kBeamCount; ++i) {
    const double angle_rad =
        2.0 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(kBeamCount);
    beams_[i] = {std::cos(angle_rad), std::sin(angle_rad)};
  }
}

const BeamTable& beam_table() noexcept {
  static const BeamTable table;
  return table;
}

double cast_ray(const GridMap& map, const Point& from, const Direction& direction,
                double max_range_m) noexcept {
  double range_m = std::numeric_limits<double>::infinity();
  traverse(map, from, direction, max_range_m, [&](Cell cell, double entry_m) {
    if (map.is_free(cell)) return true;
    range_m = entry_m;
    return false;
  });
  return range_m;
}

void range_scan(const GridMap& map, const Pose2D& pose, float max_range_m, Scan& scan) noexcept {
  const Point from{pose.x, pose.y, 0.0};
  const Direction heading{std::cos(pose.theta), std::sin(pose.theta)};
  const BeamTable& beams = beam_table();
  scan.max_range_m = max_range_m;
  scan.robots.fill(0);
  for (std::size_t i = 0; i < kBeamCount; ++i) {
    const double range_m = cast_ray(map, from, beams.direction(i, heading), static_cast<double>(max_range_m));
    scan.ranges_m[i] = static_cast<float>(range_m);
  }
}

void scan_robots(std::span<const RobotBody> robots, const Pose2D& pose, Scan& scan) noexcept {
  const Direction heading{std::cos(pose.theta), std::sin(pose.theta)};
  const BeamTable& beams = beam_table();
  for (const RobotBody& robot : robots) {
    const double x_m = robot.x - pose.x;
    const double y_m = robot.y - pose.y;
    const double beyond = x_m * x_m + y_m * y_m - robot.radius * robot.radius;
    const double reach_m = static_cast<double>(scan.max_range_m) + robot.radius;
    if (x_m * x_m + y_m * y_m > reach_m * reach_m) continue;
    for (std::size_t i = 0; i < kBeamCount; ++i) {
      const Direction beam = beams.direction(i, heading);
      const double along_m = x_m * beam.x + y_m * beam.y;  // to the point of the beam nearest to the centre
      const double half_squared = along_m * along_m - beyond;
      if (half_squared < 0.0 || along_m < 0.0) continue;
      const auto range_m = static_cast<float>(std::max(0.0, along_m - std::sqrt(half_squared)));
      if (range_m >= scan.ranges_m[i] || range_m > scan.max_range_m) continue;
      scan.ranges_m[i] = range_m;
      scan.robots[i] = robot.number;
    }
  }
}

}  // namespace mauve_examples
