// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_examples/reachability.hpp"

#include "mauve_examples/disc_collision.hpp"
#include "mauve_examples/nearest_cell.hpp"

namespace mauve_examples {

std::vector<std::uint8_t> standable_cells(const GridMap& map, double radius_m) {
  std::vector<std::uint8_t> standable(map.cell_count(), 0);
  for (std::size_t i = 0; i < standable.size(); ++i) {
    if (map.cells[i] != kFree) continue;
    const Point centre = map.centre(map.cell(i));
    standable[i] = disc_collides(map, centre.x, centre.y, radius_m) ? 0 : 1;
  }
  return standable;
}

std::vector<std::size_t> spread(const GridGeometry& grid, const std::vector<std::uint8_t>& standable,
                                const std::vector<std::size_t>& seeds, std::vector<std::uint8_t>& reached) {
  std::vector<std::size_t> order;
  for (const std::size_t seed : seeds) {
    if (standable[seed] == 0 || reached[seed] != 0) continue;
    reached[seed] = 1;
    order.push_back(seed);
  }
  const auto stands = [&](Cell cell) { return grid.contains(cell) && standable[grid.index(cell)] != 0; };
  for (std::size_t done = 0; done < order.size(); ++done) {
    const Cell cell = grid.cell(order[done]);
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        const Cell next{cell.column + dx, cell.row + dy};
        if (!stands(next) || reached[grid.index(next)] != 0) continue;
        if (!stands({next.column, cell.row}) || !stands({cell.column, next.row})) continue;
        reached[grid.index(next)] = 1;
        order.push_back(grid.index(next));
      }
    }
  }
  return order;
}

std::vector<std::uint8_t> reachable_cells(const GridMap& map, std::span<const Pose2D> starts,
                                          double radius_m) {
  constexpr double kSnap_m = 0.5;
  const std::vector<std::uint8_t> standable = standable_cells(map, radius_m);
  std::vector<std::size_t> seeds;
  for (const Pose2D& start : starts) {
    const auto seed = nearest_cell(map, map.cell_at(start.x, start.y), cells_of(map, kSnap_m),
                                   [&](Cell cell) { return standable[map.index(cell)] != 0; });
    if (seed) seeds.push_back(map.index(*seed));
  }
  std::vector<std::uint8_t> reached(map.cell_count(), 0);
  spread(map, standable, seeds, reached);
  return reached;
}

}  // namespace mauve_examples
