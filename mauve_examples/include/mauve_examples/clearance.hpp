// SPDX-License-Identifier: LGPL-3.0-or-later
// How far every cell is from the nearest obstacle: what planners inflate obstacles by.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "mauve_examples/grid_geometry.hpp"

namespace mauve_examples {

/// Exact squared distances between cell centres, up to a limit. Only what lies near cells that changed since the last
/// time is computed anew, square by square; at most the whole map, whatever it holds. Source of the two passes: P. Felzenszwalb, D. Huttenlocher, "Distance Transforms of Sampled
/// Functions", 2012; with a small limit the second pass is a plain minimum over a window, which compilers
/// vectorise.
class ClearanceField {
 public:
  /// Allocates; distances beyond limit_m are not told apart. No obstacle anywhere. [setup]
  void configure(const GridGeometry& geometry, double limit_m);

  /// Takes the occupied cells of a row-major map of the configured geometry; unknown cells are no obstacles.
  /// [rt]
  void compute(std::span<const std::int8_t> cells) noexcept;

  /// Whether the cell's centre is at least as far from every obstacle's centre as squared_cells() says. [rt]
  bool at_least(std::size_t index, std::uint16_t squared) const noexcept {
    return squared_[index] >= squared;
  }
  std::uint16_t squared(std::size_t index) const noexcept { return squared_[index]; }
  std::span<const std::uint16_t> squared() const noexcept { return squared_; }
  /// The squared distance in cells that keeps a disc of the radius clear of an obstacle's border. [rt]
  std::uint16_t squared_cells(double radius_m) const noexcept;

 private:
  /// Cells from a low corner up to, and without, a high one.
  struct Box {
    Cell low;
    Cell high;
  };

  std::optional<Box> take_changes(std::span<const std::int8_t> cells, const Box& square) noexcept;
  Box around(const Box& box, int cells) const noexcept;
  void compute(const Box& changed) noexcept;
  void measure_columns(const Box& changed) noexcept;

  GridGeometry geometry_;
  int limit_cells_{0};
  std::vector<std::uint8_t> occupied_;  // as of the last time
  std::vector<Box> changes_;            // at most one for each square
  std::vector<std::uint8_t> nearest_;   // while columns are measured: to the nearest obstacle so far
  std::vector<std::uint8_t>
      column_distance_;  // to the nearest obstacle of the same column, at most limit + 1
  std::vector<std::uint16_t>
      row_squares_;  // one row of their squares with limit cells of margin at both ends
  std::vector<std::uint16_t> squared_;
};

}  // namespace mauve_examples
