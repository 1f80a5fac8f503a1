// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_examples/disc_collision.hpp"

#include <algorithm>

namespace mauve_examples {

bool disc_collides(const GridMap& map, double x_m, double y_m, double radius_m) noexcept {
  const Cell low = map.cell_at(x_m - radius_m, y_m - radius_m);
  const Cell high = map.cell_at(x_m + radius_m, y_m + radius_m);
  for (int row = low.row; row <= high.row; ++row) {
    const double cell_y_m = map.origin_y_m + row * map.resolution_m;
    const double gap_y_m = y_m - std::clamp(y_m, cell_y_m, cell_y_m + map.resolution_m);
    for (int column = low.column; column <= high.column; ++column) {
      if (map.is_free({column, row})) continue;
      const double cell_x_m = map.origin_x_m + column * map.resolution_m;
      const double gap_x_m = x_m - std::clamp(x_m, cell_x_m, cell_x_m + map.resolution_m);
      if (gap_x_m * gap_x_m + gap_y_m * gap_y_m < radius_m * radius_m) return true;
    }
  }
  return false;
}

}  // namespace mauve_examples
