// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_examples/merged_map.hpp"

namespace mauve_examples {

void MergedMap::configure(const GridGeometry& geometry) {
  geometry_ = geometry;
  own_.assign(geometry.cell_count(), kUnknown);
  merged_.assign(geometry.cell_count(), kUnknown);
  own_revision_.assign(geometry.tile_count(), 0);
}

void MergedMap::refresh(const OccupancyGrid& own) noexcept {
  const auto columns = static_cast<std::size_t>(geometry_.tile_columns());
  for (std::size_t tile = 0; tile < own_revision_.size(); ++tile) {
    if (own.revision(tile) == own_revision_[tile]) continue;
    own_revision_[tile] = own.revision(tile);
    for_each_tile_cell(geometry_, static_cast<int>(tile % columns), static_cast<int>(tile / columns),
                       [&](Cell cell, std::size_t) {
                         const std::size_t index = geometry_.index(cell);
                         own_[index] = own.cells()[index];
                         if (own_[index] != kUnknown) merged_[index] = own_[index];
                       });
  }
}

bool MergedMap::merge(const MapTile& tile) noexcept {
  if (tile.column >= geometry_.tile_columns() || tile.row >= geometry_.tile_rows()) return false;
  for_each_tile_cell(geometry_, tile.column, tile.row, [&](Cell cell, std::size_t i) {
    const std::size_t index = geometry_.index(cell);
    // Of a cell both have seen the own observation counts; of what peers say, the latest word.
    if (own_[index] == kUnknown && tile.cells[i] != kUnknown) merged_[index] = tile.cells[i];
  });
  return true;
}

void MergedMap::copy_tile(std::size_t tile, MapTile& out) const noexcept {
  copy_tile_cells(geometry_, own_, tile, out);
  out.revision = own_revision_[tile];
}

}  // namespace mauve_examples
