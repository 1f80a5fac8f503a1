// SPDX-License-Identifier: LGPL-3.0-or-later
// Brings the robot's own map to all peers over a link that may lose messages: one batch of tiles at a time,
// repeated until every peer has it.
#pragma once

#include <cstdint>

#include "mauve_examples/changed_tiles.hpp"
#include "mauve_examples/merged_map.hpp"

namespace mauve_examples {

/// Stop-and-wait. Contents of a batch do not change while it is under way: a peer that has it has just that.
/// Not thread-safe; memory is allocated by configure alone.
class TileSender {
 public:
  /// Allocates. [setup]
  void configure(std::size_t tile_count);

  /// Number of the batch under way; 0: none. [rt]
  std::uint32_t batch() const noexcept { return runs_.empty() ? 0 : batch_; }
  const TileRuns& runs() const noexcept { return runs_; }

  /// Every peer has the batch under way. [rt]
  void confirm() noexcept { runs_.clear(); }
  /// Starts the next batch if none is under way and tiles have changed since they were sent. [rt]
  void start(const MergedMap& map) noexcept;
  /// A peer lost its memory: everything is sent again. [rt]
  void forget() noexcept;

 private:
  ChangedTiles changes_;
  TileRuns runs_;  // of the batch under way
  std::uint32_t batch_{0};
};

}  // namespace mauve_examples
