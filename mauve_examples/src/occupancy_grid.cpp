// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_examples/occupancy_grid.hpp"

namespace mauve_examples {

void OccupancyGrid::configure(const GridGeometry& geometry) {
  geometry_ = geometry;
  cells_.assign(geometry.cell_count(), kUnknown);
  evidence_.assign(geometry.cell_count(), 0);
  revisions_.assign(geometry.tile_count(), 0);
  free_count_ = 0;
}

void OccupancyGrid::observe(Cell cell, int evidence) noexcept {
  if (!geometry_.contains(cell)) return;
  const std::size_t index = geometry_.index(cell);
  const int sum = std::clamp(evidence_[index] + evidence, -kEvidenceLimit, kEvidenceLimit);
  evidence_[index] = static_cast<std::int8_t>(sum);
  const std::int8_t state = sum >= kOccupiedFrom ? kOccupied : kFree;
  if (state == cells_[index]) return;
  if (state == kFree) ++free_count_;
  if (cells_[index] == kFree) --free_count_;
  cells_[index] = state;
  ++revisions_[geometry_.tile_index(cell)];
}

void OccupancyGrid::copy_tile(std::size_t tile, MapTile& out) const noexcept {
  copy_tile_cells(geometry_, cells_, tile, out);
  out.revision = revisions_[tile];
}

void copy_tile_cells(const GridGeometry& geometry, std::span<const std::int8_t> cells, std::size_t tile,
                     MapTile& out) noexcept {
  const auto columns = static_cast<std::size_t>(geometry.tile_columns());
  out.column = static_cast<std::uint16_t>(tile % columns);
  out.row = static_cast<std::uint16_t>(tile / columns);
  out.cells.fill(kUnknown);
  for_each_tile_cell(geometry, out.column, out.row,
                     [&](Cell cell, std::size_t i) { out.cells[i] = cells[geometry.index(cell)]; });
}

}  // namespace mauve_examples
