// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_examples/ray_caster.hpp"

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
  for (std::size_t i = 0; i < kBeamCount; ++i) {
    const double range_m = cast_ray(map, from, beams.direction(i, heading), static_cast<double>(max_range_m));
    scan.ranges_m[i] = static_cast<float>(range_m);
  }
}

}  // namespace mauve_examples
