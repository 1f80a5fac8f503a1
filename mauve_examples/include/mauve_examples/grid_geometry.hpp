// SPDX-License-Identifier: LGPL-3.0-or-later
// Where the cells of a map lie: size, resolution and origin, shared by every grid of the mission.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>

#include "mauve_examples/types.hpp"

namespace mauve_examples {

/// States of a cell, as in nav_msgs/msg/OccupancyGrid.
inline constexpr std::int8_t kUnknown = -1;
inline constexpr std::int8_t kFree = 0;
inline constexpr std::int8_t kOccupied = 100;

struct Cell {
  int column{0};
  int row{0};
  bool operator==(const Cell&) const = default;
};

/// A regular grid; row 0 has the lowest y. All functions [rt].
struct GridGeometry {
  int width{0};
  int height{0};
  double resolution_m{0.0};
  double origin_x_m{0.0};  // of the lower left corner of cell (0, 0)
  double origin_y_m{0.0};

  bool operator==(const GridGeometry&) const = default;

  std::size_t cell_count() const noexcept {
    return static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  }
  bool contains(Cell cell) const noexcept {
    return cell.column >= 0 && cell.row >= 0 && cell.column < width && cell.row < height;
  }
  bool contains(const Point& point) const noexcept {
    const double column = (point.x - origin_x_m) / resolution_m;
    const double row = (point.y - origin_y_m) / resolution_m;
    return column >= 0.0 && row >= 0.0 && column < width && row < height;
  }
  std::size_t index(Cell cell) const noexcept {
    return static_cast<std::size_t>(cell.row) * static_cast<std::size_t>(width) +
           static_cast<std::size_t>(cell.column);
  }
  Cell cell(std::size_t index) const noexcept {
    const auto columns = static_cast<std::size_t>(width);
    return {static_cast<int>(index % columns), static_cast<int>(index / columns)};
  }
  /// The cell a point lies in; outside the grid when the point is.
  Cell cell_at(double x_m, double y_m) const noexcept {
    return {static_cast<int>(std::floor((x_m - origin_x_m) / resolution_m)),
            static_cast<int>(std::floor((y_m - origin_y_m) / resolution_m))};
  }
  Point centre(Cell cell) const noexcept {
    return {origin_x_m + (cell.column + 0.5) * resolution_m, origin_y_m + (cell.row + 0.5) * resolution_m,
            0.0};
  }

  int tile_columns() const noexcept { return (width + kTileSide - 1) / kTileSide; }
  int tile_rows() const noexcept { return (height + kTileSide - 1) / kTileSide; }
  std::size_t tile_count() const noexcept {
    return static_cast<std::size_t>(tile_columns()) * static_cast<std::size_t>(tile_rows());
  }
  std::size_t tile_index(Cell cell) const noexcept {
    return static_cast<std::size_t>(cell.row / kTileSide) * static_cast<std::size_t>(tile_columns()) +
           static_cast<std::size_t>(cell.column / kTileSide);
  }
};

/// Straight distance between two places. [rt]
template <typename A, typename B>
double distance_m(const A& a, const B& b) noexcept {
  return std::hypot(a.x - b.x, a.y - b.y);
}

}  // namespace mauve_examples
