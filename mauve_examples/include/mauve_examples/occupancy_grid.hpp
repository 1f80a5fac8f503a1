// SPDX-License-Identifier: LGPL-3.0-or-later
// The map a robot makes: evidence per cell, its state, and a revision per tile.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "mauve_examples/grid_geometry.hpp"
#include "mauve_examples/types.hpp"

namespace mauve_examples {

/// Saturating counters per cell (a cheap log-odds ratio) and the ternary state that follows from them.
/// Readers that want only what changed compare the tiles' revisions with those they saw last.
/// Not thread-safe: guarded by whoever owns it.
class OccupancyGrid {
 public:
  /// Allocates for the geometry; everything unknown, every revision 0. [setup]
  void configure(const GridGeometry& geometry);

  const GridGeometry& geometry() const noexcept { return geometry_; }
  std::span<const std::int8_t> cells() const noexcept { return cells_; }
  /// State of a cell inside the grid. [rt]
  std::int8_t at(Cell cell) const noexcept { return cells_[geometry_.index(cell)]; }

  /// A beam passed through the cell; cells outside the grid are ignored. [rt]
  void observe_free(Cell cell) noexcept { observe(cell, kFreeEvidence); }
  /// A beam ended in the cell; cells outside the grid are ignored. [rt]
  void observe_hit(Cell cell) noexcept { observe(cell, kHitEvidence); }

  std::size_t tile_count() const noexcept { return revisions_.size(); }
  /// How often the tile changed; 0: nothing in it is known. [rt]
  std::uint32_t revision(std::size_t tile) const noexcept { return revisions_[tile]; }
  /// Copies a tile; its cells beyond the grid are unknown. [rt]
  void copy_tile(std::size_t tile, MapTile& out) const noexcept;
  /// How many cells are free. [rt]
  std::size_t free_count() const noexcept { return free_count_; }

 private:
  // One pass says free; one hit outweighs six passes, since obstacles thinner than a cell are mostly passed
  // by.
  static constexpr int kFreeEvidence = -1;
  static constexpr int kHitEvidence = 6;
  static constexpr int kOccupiedFrom = 1;
  static constexpr int kEvidenceLimit = 12;

  void observe(Cell cell, int evidence) noexcept;

  GridGeometry geometry_;
  std::vector<std::int8_t> cells_;
  std::vector<std::int8_t> evidence_;
  std::vector<std::uint32_t> revisions_;
  std::size_t free_count_{0};
};

/// Copies a tile out of row-major cells; what lies beyond the grid is unknown. The revision is left alone.
/// [rt]
void copy_tile_cells(const GridGeometry& geometry, std::span<const std::int8_t> cells, std::size_t tile,
                     MapTile& out) noexcept;

/// Calls visit(cell, index in the tile) for the cells of a tile that lie inside the grid. [rt]
template <typename Visit>
void for_each_tile_cell(const GridGeometry& geometry, int tile_column, int tile_row, Visit&& visit) {
  const int columns = std::min(kTileSide, geometry.width - tile_column * kTileSide);
  const int rows = std::min(kTileSide, geometry.height - tile_row * kTileSide);
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      visit(Cell{tile_column * kTileSide + column, tile_row * kTileSide + row},
            static_cast<std::size_t>(row * kTileSide + column));
    }
  }
}

}  // namespace mauve_examples
