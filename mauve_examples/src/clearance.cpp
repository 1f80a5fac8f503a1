// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_examples/clearance.hpp"

#include <algorithm>
#include <cmath>

namespace mauve_examples {

namespace {

constexpr int kMaxLimitCells = 180;  // distances fit one byte, sums of two squares fit two

}  // namespace

void ClearanceField::configure(const GridGeometry& geometry, double limit_m) {
  geometry_ = geometry;
  limit_cells_ =
      std::clamp(static_cast<int>(std::ceil(limit_m / geometry.resolution_m)) + 1, 1, kMaxLimitCells);
  column_distance_.assign(geometry.cell_count(), 0);
  row_squares_.assign(static_cast<std::size_t>(geometry.width) + 2 * static_cast<std::size_t>(limit_cells_),
                      0);
  squared_.assign(geometry.cell_count(), 0);
}

void ClearanceField::compute(std::span<const std::int8_t> cells) noexcept {
  const auto width = static_cast<std::size_t>(geometry_.width);
  const auto height = static_cast<std::size_t>(geometry_.height);
  const auto limit = static_cast<std::size_t>(limit_cells_);
  const auto far = static_cast<std::uint8_t>(limit + 1);

  // Along the columns, upwards then downwards; rows outside, so that memory is read in order.
  for (std::size_t row = 0; row < height; ++row) {
    std::uint8_t* distance = &column_distance_[row * width];
    const std::int8_t* state = &cells[row * width];
    const std::uint8_t* below = row > 0 ? distance - width : nullptr;
    for (std::size_t i = 0; i < width; ++i) {
      const int grown = below != nullptr ? std::min<int>(below[i] + 1, far) : far;
      distance[i] = static_cast<std::uint8_t>(state[i] == kOccupied ? 0 : grown);
    }
  }
  for (std::size_t row = height - 1; row-- > 0;) {
    std::uint8_t* distance = &column_distance_[row * width];
    const std::uint8_t* above = distance + width;
    for (std::size_t i = 0; i < width; ++i) {
      distance[i] = static_cast<std::uint8_t>(std::min<int>(distance[i], above[i] + 1));
    }
  }

  const auto far_squared = static_cast<std::uint16_t>(far * far);
  std::fill(row_squares_.begin(), row_squares_.end(), far_squared);
  for (std::size_t row = 0; row < height; ++row) {
    const std::uint8_t* distance = &column_distance_[row * width];
    for (std::size_t i = 0; i < width; ++i) {
      row_squares_[limit + i] = static_cast<std::uint16_t>(distance[i] * distance[i]);
    }
    std::uint16_t* out = &squared_[row * width];
    std::fill_n(out, width, far_squared);
    for (std::size_t shift = 0; shift <= 2 * limit; ++shift) {
      const std::uint16_t* from = &row_squares_[shift];
      const auto across = static_cast<int>(shift) - limit_cells_;
      const auto across_squared = static_cast<std::uint16_t>(across * across);
      for (std::size_t i = 0; i < width; ++i) {
        out[i] = std::min(out[i], static_cast<std::uint16_t>(from[i] + across_squared));
      }
    }
  }
}

std::uint16_t ClearanceField::squared_cells(double radius_m) const noexcept {
  // An obstacle reaches half a cell from its centre.
  const double cells = radius_m / geometry_.resolution_m + 0.5;
  const double limit = static_cast<double>(limit_cells_) * limit_cells_;
  return static_cast<std::uint16_t>(std::min(std::ceil(cells * cells), limit));
}

}  // namespace mauve_examples
