// SPDX-License-Identifier: LGPL-3.0-or-later
// What the robots know together, as one of them sees it: its own map, and its peers' where its own is
// unknown.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "mauve_examples/occupancy_grid.hpp"

namespace mauve_examples {

/// Not thread-safe; memory is allocated by configure alone.
class MergedMap {
 public:
  /// Allocates; everything unknown. [setup]
  void configure(const GridGeometry& geometry);

  const GridGeometry& geometry() const noexcept { return geometry_; }
  std::span<const std::int8_t> cells() const noexcept { return merged_; }

  /// Takes over the tiles of the robot's own map that changed since the last call. [rt]
  void refresh(const OccupancyGrid& own) noexcept;
  /// Takes over a peer's tile where the own map knows nothing; false when the tile is outside the map. [rt]
  bool merge(const MapTile& tile) noexcept;

  std::size_t tile_count() const noexcept { return own_revision_.size(); }
  /// Revision of a tile of the robot's own map, as taken over last. [rt]
  std::uint32_t revision(std::size_t tile) const noexcept { return own_revision_[tile]; }
  /// A tile of the robot's own map as taken over last, without what peers found. [rt]
  void copy_tile(std::size_t tile, MapTile& out) const noexcept;

 private:
  GridGeometry geometry_;
  std::vector<std::int8_t> own_;
  std::vector<std::int8_t> merged_;
  std::vector<std::uint32_t> own_revision_;
};

}  // namespace mauve_examples
