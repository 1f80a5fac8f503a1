// SPDX-License-Identifier: LGPL-3.0-or-later
// Tiles on the radio: runs of equal cells, so that what a tile costs depends on the walls in it and hardly on how fine
// the map is.
#pragma once

#include <cstddef>

#include "mauve_examples/types.hpp"

namespace mauve_examples {

/// Appends a tile (but for its revision); false when there is no room for it, and nothing is appended. [rt]
bool append_tile(const MapTile& tile, TileRuns& runs) noexcept;

/// Reads the tile that begins at the position, and moves on behind it; false at the end, and where no whole tile
/// follows. [rt]
bool read_tile(const TileRuns& runs, std::size_t& position, MapTile& tile) noexcept;

}  // namespace mauve_examples
