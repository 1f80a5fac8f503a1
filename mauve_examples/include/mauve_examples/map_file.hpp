// SPDX-License-Identifier: LGPL-3.0-or-later
// Maps of the ROS map server: a YAML file that names a PGM, PNG or BMP image, in mode trinary, scale or raw.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "mauve_examples/grid_geometry.hpp"
#include "mauve_examples/map_error.hpp"

namespace mauve_examples {

/// A world known cell by cell: -1 unknown, 0 free, 1 to 100 how occupied; row 0 has the lowest y.
struct GridMap : GridGeometry {
  std::vector<std::int8_t> cells;

  std::int8_t at(Cell cell) const noexcept { return cells[index(cell)]; }
  /// Whether a cell is known to be free; what lies outside the map is not. [rt]
  bool is_free(Cell cell) const noexcept { return contains(cell) && at(cell) == kFree; }
};

/// More cells than this are refused: the planners' arrays would not fit a robot's locked memory. About 100 x
/// 100 m at 5 cm.
inline constexpr std::size_t kMaxMapCells = std::size_t{4} << 20;

/// Reads a map with the cells that nav2_map_server of Jazzy (since 1.3.7) publishes. [non-rt]
/// An image path is relative to the YAML file. A map whose origin has a yaw becomes an upright grid of equal
/// resolution: each cell takes the cell of the file below its centre, or is unknown. More is optional than for the
/// map server: negate (0), occupied_thresh (0.65), free_thresh (0.25) and the yaw (0).
/// Throws MapError for
/// - a file that is missing, truncated or no map, or a value out of its range;
/// - images other than PGM (P2, P5), PNG, and BMP without compression of 1, 4, 8, 24 or 32 bits a pixel;
/// - more than kMaxMapCells cells, a turned map's corners included;
/// - cells smaller than 1 mm or larger than 10 m;
/// - thresholds other than 0 <= free_thresh <= occupied_thresh <= 1;
/// - a map without a free cell.
GridMap load_map(const std::filesystem::path& yaml_path);

}  // namespace mauve_examples
