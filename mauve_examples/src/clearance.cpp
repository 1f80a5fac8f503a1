// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_examples/clearance.hpp"

#include <algorithm>
#include <cmath>

namespace mauve_examples {

namespace {

constexpr int kMaxLimitCells = 180;  // distances fit one byte, sums of two squares fit two
constexpr int kSquareSide = 64;      // changes are looked for, and computed anew, by squares of so many cells

}  // namespace

void ClearanceField::configure(const GridGeometry& geometry, double limit_m) {
  geometry_ = geometry;
  limit_cells_ =
      std::clamp(static_cast<int>(std::ceil(limit_m / geometry.resolution_m)) + 1, 1, kMaxLimitCells);
  const auto far = static_cast<std::uint8_t>(limit_cells_ + 1);
  const auto width = static_cast<std::size_t>(geometry.width);
  occupied_.assign(geometry.cell_count(), 0);
  column_distance_.assign(geometry.cell_count(), far);
  row_squares_.assign(width + 2 * static_cast<std::size_t>(limit_cells_), 0);
  squared_.assign(geometry.cell_count(), static_cast<std::uint16_t>(far * far));
  const auto squares = [](int cells) {
    return static_cast<std::size_t>((cells + kSquareSide - 1) / kSquareSide);
  };
  nearest_.assign(kSquareSide, 0);
  changes_.clear();
  changes_.reserve(squares(geometry.width) * squares(geometry.height));
}

void ClearanceField::compute(std::span<const std::int8_t> cells) noexcept {
  changes_.clear();
  for (int row = 0; row < geometry_.height; row += kSquareSide) {
    for (int column = 0; column < geometry_.width; column += kSquareSide) {
      const Cell high{std::min(column + kSquareSide, geometry_.width),
                      std::min(row + kSquareSide, geometry_.height)};
      if (const auto changed = take_changes(cells, {{column, row}, high})) changes_.push_back(*changed);
    }
  }
  for (const Box& changed : changes_) measure_columns(changed);
  for (const Box& changed : changes_) compute(changed);
}

std::optional<ClearanceField::Box> ClearanceField::take_changes(std::span<const std::int8_t> cells,
                                                                const Box& square) noexcept {
  Box changed{square.high, square.low};
  for (int row = square.low.row; row < square.high.row; ++row) {
    const std::size_t begin = geometry_.index({square.low.column, row});
    const auto width = static_cast<std::size_t>(square.high.column - square.low.column);
    std::uint8_t differ = 0;
    for (std::size_t i = begin; i < begin + width; ++i) {
      differ |= static_cast<std::uint8_t>(static_cast<std::uint8_t>(cells[i] == kOccupied) ^ occupied_[i]);
    }
    if (differ == 0) continue;
    changed.low.row = std::min(changed.low.row, row);
    changed.high.row = row + 1;
    for (std::size_t i = begin; i < begin + width; ++i) {
      const auto now = static_cast<std::uint8_t>(cells[i] == kOccupied);
      if (now == occupied_[i]) continue;
      occupied_[i] = now;
      const int column = square.low.column + static_cast<int>(i - begin);
      changed.low.column = std::min(changed.low.column, column);
      changed.high.column = std::max(changed.high.column, column + 1);
    }
  }
  if (changed.high.row <= changed.low.row) return std::nullopt;
  return changed;
}

ClearanceField::Box ClearanceField::around(const Box& box, int cells) const noexcept {
  return {
      {std::max(box.low.column - cells, 0), std::max(box.low.row - cells, 0)},
      {std::min(box.high.column + cells, geometry_.width), std::min(box.high.row + cells, geometry_.height)}};
}

void ClearanceField::measure_columns(const Box& changed) noexcept {
  // A distance depends on cells at most the limit away, so that far beyond what is written the search begins anew.
  const Box written = around({changed.low, changed.high}, limit_cells_);
  const Box looked_at = around(written, limit_cells_);
  const auto stride = static_cast<std::size_t>(geometry_.width);
  const auto width = static_cast<std::size_t>(changed.high.column - changed.low.column);
  const auto far = static_cast<std::uint8_t>(limit_cells_ + 1);
  const auto is_written = [&](int row) { return row >= written.low.row && row < written.high.row; };
  const auto grow = [&](int row) {
    const std::uint8_t* occupied =
        &occupied_[static_cast<std::size_t>(row) * stride + static_cast<std::size_t>(changed.low.column)];
    for (std::size_t i = 0; i < width; ++i) {
      const auto grown = static_cast<std::uint8_t>(std::min<int>(nearest_[i] + 1, far));
      nearest_[i] = occupied[i] != 0 ? std::uint8_t{0} : grown;
    }
    return &column_distance_[static_cast<std::size_t>(row) * stride +
                             static_cast<std::size_t>(changed.low.column)];
  };
  // Upwards then downwards; rows outside, so that memory is read in order.
  std::fill_n(nearest_.begin(), width, far);
  for (int row = looked_at.low.row; row < written.high.row; ++row) {
    std::uint8_t* distance = grow(row);
    if (is_written(row)) std::copy_n(nearest_.begin(), width, distance);
  }
  std::fill_n(nearest_.begin(), width, far);
  for (int row = looked_at.high.row - 1; row >= written.low.row; --row) {
    std::uint8_t* distance = grow(row);
    if (!is_written(row)) continue;
    for (std::size_t i = 0; i < width; ++i) distance[i] = std::min(distance[i], nearest_[i]);
  }
}

void ClearanceField::compute(const Box& changed) noexcept {
  const Box written = around(changed, limit_cells_);
  const auto stride = static_cast<std::size_t>(geometry_.width);
  const auto limit = static_cast<std::size_t>(limit_cells_);
  const auto begin = static_cast<std::size_t>(written.low.column);
  const auto width = static_cast<std::size_t>(written.high.column) - begin;
  const auto far_squared = static_cast<std::uint16_t>((limit_cells_ + 1) * (limit_cells_ + 1));
  for (int row = written.low.row; row < written.high.row; ++row) {
    const std::uint8_t* distance = &column_distance_[static_cast<std::size_t>(row) * stride];
    // What the windows of these cells reach over; beyond the map there is no obstacle.
    for (std::size_t i = 0; i < width + 2 * limit; ++i) {
      const std::size_t column = begin + i - limit;  // wraps around below 0
      row_squares_[i] =
          column < stride ? static_cast<std::uint16_t>(distance[column] * distance[column]) : far_squared;
    }
    std::uint16_t* out = &squared_[static_cast<std::size_t>(row) * stride + begin];
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
