// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_examples/tile_sender.hpp"

#include "mauve_examples/tile_runs.hpp"

namespace mauve_examples {

void TileSender::configure(std::size_t tile_count) {
  changes_.configure(tile_count);
  runs_.clear();
  batch_ = 0;
}

void TileSender::start(const MergedMap& map) noexcept {
  if (!runs_.empty()) return;
  changes_.collect(map, [&](std::size_t tile) {
    MapTile copy;
    map.copy_tile(tile, copy);
    return append_tile(copy, runs_);
  });
  if (!runs_.empty()) ++batch_;
}

void TileSender::forget() noexcept {
  changes_.forget();
  runs_.clear();
}

}  // namespace mauve_examples
