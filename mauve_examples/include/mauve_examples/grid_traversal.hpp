// SPDX-License-Identifier: LGPL-3.0-or-later
// The cells that a straight line passes through, in order.
#pragma once

#include <cmath>
#include <limits>

#include "mauve_examples/grid_geometry.hpp"

namespace mauve_examples {

/// A unit vector.
struct Direction {
  double x{1.0};
  double y{0.0};
};

/// Calls visit(cell, entry_m) for every cell the line touches, the start's first with entry 0, until visit
/// returns false or the next cell would be entered beyond length_m. Cells may lie outside the grid. [rt]
/// Source: J. Amanatides, A. Woo, "A Fast Voxel Traversal Algorithm for Ray Tracing", Eurographics 1987.
template <typename Visit>
void traverse(const GridGeometry& grid, const Point& start, const Direction& direction, double length_m,
              Visit&& visit) {
  Cell cell = grid.cell_at(start.x, start.y);
  const double resolution_m = grid.resolution_m;
  const int step_x = direction.x > 0.0 ? 1 : -1;
  const int step_y = direction.y > 0.0 ? 1 : -1;

  // Distances along the line to the next border of each axis, and between two borders.
  const auto next_border_m = [resolution_m](double start_m, double origin_m, int index, int step,
                                            double slope) {
    if (slope == 0.0) return std::numeric_limits<double>::infinity();
    const double border_m = origin_m + (index + (step > 0 ? 1 : 0)) * resolution_m;
    return (border_m - start_m) / slope;
  };
  double border_x_m = next_border_m(start.x, grid.origin_x_m, cell.column, step_x, direction.x);
  double border_y_m = next_border_m(start.y, grid.origin_y_m, cell.row, step_y, direction.y);
  const double delta_x_m = direction.x == 0.0 ? 0.0 : resolution_m / std::abs(direction.x);
  const double delta_y_m = direction.y == 0.0 ? 0.0 : resolution_m / std::abs(direction.y);

  double entry_m = 0.0;
  while (entry_m <= length_m) {
    if (!visit(cell, entry_m)) return;
    if (border_x_m < border_y_m) {
      entry_m = border_x_m;
      border_x_m += delta_x_m;
      cell.column += step_x;
    } else {
      entry_m = border_y_m;
      border_y_m += delta_y_m;
      cell.row += step_y;
    }
  }
}

/// Whether every cell between two points satisfies the predicate clear(cell). [rt]
template <typename Clear>
bool line_is_clear(const GridGeometry& grid, const Point& from, const Point& to, Clear&& clear) {
  const double length_m = distance_m(from, to);
  const Direction direction =
      length_m > 0.0 ? Direction{(to.x - from.x) / length_m, (to.y - from.y) / length_m} : Direction{};
  bool all_clear = true;
  traverse(grid, from, direction, length_m, [&](Cell cell, double) { return all_clear = clear(cell); });
  return all_clear;
}

}  // namespace mauve_examples
