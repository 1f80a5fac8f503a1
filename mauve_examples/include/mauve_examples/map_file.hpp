// SPDX-License-Identifier: LGPL-3.0-or-later
// Maps of the ROS map server: a YAML file that names a PGM or PNG image, read in trinary mode.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "mauve_examples/grid_geometry.hpp"
#include "mauve_examples/map_error.hpp"

namespace mauve_examples {

/// A world known cell by cell: -1 unknown, 0 free, 100 occupied; row 0 has the lowest y.
struct GridMap : GridGeometry {
  std::vector<std::int8_t> cells;

  std::int8_t at(Cell cell) const noexcept { return cells[index(cell)]; }
  /// Whether a cell is known to be free; what lies outside the map is not. [rt]
  bool is_free(Cell cell) const noexcept { return contains(cell) && at(cell) == kFree; }
};

/// More cells than this are refused: the planners' arrays would not fit a robot's locked memory. About 100 x
/// 100 m at 5 cm.
inline constexpr std::size_t kMaxMapCells = std::size_t{4} << 20;

/// Reads a map as nav2_map_server does in trinary mode; an image path is relative to the YAML file. [non-rt]
/// Throws MapError when a file is missing, truncated or of another format, when a value is out of its range,
/// when the origin is turned, when the mode is not trinary and when no cell is free.
GridMap load_map(const std::filesystem::path& yaml_path);

}  // namespace mauve_examples
