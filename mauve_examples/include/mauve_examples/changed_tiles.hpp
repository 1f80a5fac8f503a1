// SPDX-License-Identifier: LGPL-3.0-or-later
// Which tiles of a map have changed since they were handed out last.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "mauve_examples/types.hpp"

namespace mauve_examples {

/// Remembers the revision of every tile it handed out. Not thread-safe; memory is allocated by configure
/// alone.
class ChangedTiles {
 public:
  /// Allocates; everything counts as changed that is not at revision 0. [setup]
  void configure(std::size_t tile_count) {
    seen_.assign(tile_count, 0);
    next_ = 0;
  }

  /// Calls take(tile) for changed tiles until it returns false, which leaves that tile for the next time; `map`
  /// offers revision(tile). [rt]
  template <typename Map, typename Take>
  void collect(const Map& map, Take&& take) noexcept {
    const std::size_t count = seen_.size();
    for (std::size_t looked = 0; looked < count; ++looked) {
      const std::size_t tile = next_;
      if (map.revision(tile) != seen_[tile]) {
        if (!take(tile)) return;
        seen_[tile] = map.revision(tile);
      }
      next_ = (next_ + 1) % count;  // goes on here next time: tiles that change all the time starve none
    }
  }

  /// The tile counts as changed again, as when it did not arrive. [rt]
  void forget(std::size_t tile) noexcept { seen_[tile] = 0; }
  /// Everything counts as changed again. [rt]
  void forget() noexcept { std::fill(seen_.begin(), seen_.end(), 0); }

 private:
  std::vector<std::uint32_t> seen_;
  std::size_t next_{0};
};

}  // namespace mauve_examples
