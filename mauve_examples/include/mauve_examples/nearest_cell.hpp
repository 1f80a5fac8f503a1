// SPDX-License-Identifier: LGPL-3.0-or-later
// The nearest cell with a property, for robots and goals that stand where planners do not go.
#pragma once

#include <algorithm>
#include <cstdlib>
#include <optional>

#include "mauve_examples/grid_geometry.hpp"

namespace mauve_examples {

/// The cell nearest to the centre one, at most `reach` cells away along each axis, that lies in the grid and
/// satisfies accept(cell). [rt]
template <typename Accept>
std::optional<Cell> nearest_cell(const GridGeometry& grid, Cell centre, int reach, Accept&& accept) {
  std::optional<Cell> best;
  int best_squared = 0;
  for (int ring = 0; ring <= reach; ++ring) {
    // A ring's nearest cell is `ring` away: no farther ring can beat what is nearer than that.
    if (best && best_squared <= ring * ring) break;
    for (int dy = -ring; dy <= ring; ++dy) {
      const int step = std::abs(dy) == ring || ring == 0 ? 1 : 2 * ring;
      for (int dx = -ring; dx <= ring; dx += step) {
        const Cell cell{centre.column + dx, centre.row + dy};
        const int squared = dx * dx + dy * dy;
        if (best && squared >= best_squared) continue;
        if (!grid.contains(cell) || !accept(cell)) continue;
        best = cell;
        best_squared = squared;
      }
    }
  }
  return best;
}

/// A length in whole cells, at least one. [rt]
inline int cells_of(const GridGeometry& grid, double length_m) noexcept {
  return std::max(1, static_cast<int>(std::lround(length_m / grid.resolution_m)));
}

}  // namespace mauve_examples
