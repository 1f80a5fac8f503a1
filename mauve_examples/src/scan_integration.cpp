// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_examples/scan_integration.hpp"

#include <cmath>

#include "mauve_examples/ray_caster.hpp"

namespace mauve_examples {

void integrate_scan(const Scan& scan, const Pose2D& pose, OccupancyGrid& map) noexcept {
  const GridGeometry& grid = map.geometry();
  const Point from{pose.x, pose.y, 0.0};
  const Direction heading{std::cos(pose.theta), std::sin(pose.theta)};
  // A range ends on the border of the cell it hit; a hundredth of a cell further is inside it.
  const double into_cell_m = 0.01 * grid.resolution_m;
  for (std::size_t i = 0; i < kBeamCount; ++i) {
    const Direction direction = beam_table().direction(i, heading);
    const auto range_m = static_cast<double>(scan.ranges_m[i]);
    const bool ended = std::isfinite(range_m);
    const bool hit = ended && scan.robots[i] == 0;  // a robot will not stay where it is
    const double length_m = ended ? range_m : static_cast<double>(scan.max_range_m);
    const Cell end = grid.cell_at(from.x + (length_m + into_cell_m) * direction.x,
                                  from.y + (length_m + into_cell_m) * direction.y);
    traverse(grid, from, direction, length_m, [&](Cell cell, double) {
      if (cell == end) return false;
      map.observe_free(cell);
      return true;
    });
    if (hit) map.observe_hit(end);
  }
}

}  // namespace mauve_examples
