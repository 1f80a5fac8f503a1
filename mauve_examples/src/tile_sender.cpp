// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_examples/tile_sender.hpp"

namespace mauve_examples {

void TileSender::configure(std::size_t tile_count) {
  changes_.configure(tile_count);
  tiles_.clear();
  batch_ = 0;
}

void TileSender::start(const MergedMap& map) noexcept {
  if (!tiles_.empty()) return;
  changes_.collect(map, tiles_);
  if (!tiles_.empty()) ++batch_;
}

void TileSender::forget() noexcept {
  changes_.forget();
  tiles_.clear();
}

}  // namespace mauve_examples
