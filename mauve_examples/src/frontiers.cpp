// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_examples/frontiers.hpp"

#include <algorithm>
#include <limits>

#include "mauve_examples/nearest_cell.hpp"

namespace mauve_examples {

namespace {

constexpr std::int32_t kUnreachedCost = std::numeric_limits<std::int32_t>::max();
constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
constexpr std::int32_t kStraightCost = 5;
constexpr std::int32_t kDiagonalCost = 7;
// A robot pushed against a wall stands where it does not plan to go: the search starts from the nearest good
// cell.
constexpr double kSnap_m = 0.8;

constexpr std::uint8_t kOpen = 1;
constexpr std::uint8_t kTaken = 2;

}  // namespace

void FrontierFinder::configure(const GridGeometry& geometry, const FrontierOptions& options) {
  geometry_ = geometry;
  options_ = options;
  clearance_.configure(geometry, options.radius_m);
  near_squared_ = clearance_.squared_cells(options.radius_m);
  const std::size_t count = geometry.cell_count();
  kind_.assign(count, 0);
  cost_.assign(count, kUnreachedCost);
  next_.assign(count, kNone);
  previous_.assign(count, kNone);
  members_.assign(count, 0);
  stack_.assign(count, 0);
  is_member_.assign(count, 0);
  list_.clear();
}

const FrontierList& FrontierFinder::find(std::span<const std::int8_t> cells, const Point& robot) noexcept {
  list_.clear();
  for (std::size_t i = 0; i < member_count_; ++i) is_member_[members_[i]] = 0;
  member_count_ = 0;
  clearance_.compute(cells);
  classify(cells);
  std::fill(cost_.begin(), cost_.end(), kUnreachedCost);
  const auto start =
      nearest_cell(geometry_, geometry_.cell_at(robot.x, robot.y), cells_of(geometry_, kSnap_m),
                   [this](Cell cell) { return passable(geometry_.index(cell)); });
  has_view_ = start.has_value();
  if (!start) return list_;
  flood(*start);
  cluster();
  return list_;
}

void FrontierFinder::classify(std::span<const std::int8_t> cells) noexcept {
  const std::span<const std::uint16_t> squared = clearance_.squared();
  const std::uint16_t near = near_squared_;
  std::uint8_t* const kind = kind_.data();
  for (std::size_t i = 0; i < squared.size(); ++i) {
    const auto of_free = static_cast<std::uint8_t>(cells[i] == kFree ? kPassable : 0);
    // Unknown cells that touch walls are of no interest: no robot will ever stand there, whatever they hold.
    const auto of_state = static_cast<std::uint8_t>(cells[i] == kUnknown ? kToBeSeen : of_free);
    kind[i] = squared[i] >= near ? of_state : std::uint8_t{0};
  }
}

bool FrontierFinder::beside_unknown(Cell cell) const noexcept {
  const auto unknown = [this](Cell beside) {
    return geometry_.contains(beside) && kind_[geometry_.index(beside)] == kToBeSeen;
  };
  return unknown({cell.column + 1, cell.row}) || unknown({cell.column - 1, cell.row}) ||
         unknown({cell.column, cell.row + 1}) || unknown({cell.column, cell.row - 1});
}

inline void FrontierFinder::unlink(std::uint32_t index) noexcept {
  if (previous_[index] != kNone) {
    next_[previous_[index]] = next_[index];
  } else {
    bucket_[static_cast<std::size_t>(cost_[index]) % kBuckets] = next_[index];
  }
  if (next_[index] != kNone) previous_[next_[index]] = previous_[index];
}

inline void FrontierFinder::relax(std::uint32_t index, std::int32_t cost) noexcept {
  if (cost >= cost_[index]) return;
  if (cost_[index] != kUnreachedCost) unlink(index);
  cost_[index] = cost;
  std::uint32_t& head = bucket_[static_cast<std::size_t>(cost) % kBuckets];
  next_[index] = head;
  previous_[index] = kNone;
  if (head != kNone) previous_[head] = index;
  head = index;
}

void FrontierFinder::flood(Cell start) noexcept {
  std::fill(std::begin(bucket_), std::end(bucket_), kNone);
  const auto first = static_cast<std::uint32_t>(geometry_.index(start));
  cost_[first] = 0;
  next_[first] = previous_[first] = kNone;
  bucket_[0] = first;
  std::size_t empty_in_a_row = 0;
  for (std::size_t turn = 0; empty_in_a_row < kBuckets; turn = (turn + 1) % kBuckets) {
    ++empty_in_a_row;
    while (bucket_[turn] != kNone) {
      empty_in_a_row = 0;
      const std::uint32_t index = bucket_[turn];
      unlink(index);
      const Cell cell = geometry_.cell(index);
      if (beside_unknown(cell)) {
        members_[member_count_++] = index;
        is_member_[index] = kOpen;
      }
      const bool inside = cell.column > 0 && cell.row > 0 && cell.column + 1 < geometry_.width &&
                          cell.row + 1 < geometry_.height;
      if (inside) {
        spread_inside(index);
      } else {
        spread_at_border(cell);
      }
    }
  }
}

void FrontierFinder::spread_inside(std::uint32_t index) noexcept {
  const auto width = static_cast<std::uint32_t>(geometry_.width);
  const std::uint32_t below = index - width;
  const std::uint32_t above = index + width;
  const std::int32_t straight = cost_[index] + kStraightCost;
  const std::int32_t diagonal = cost_[index] + kDiagonalCost;
  const bool left = passable(index - 1);
  const bool right = passable(index + 1);
  if (passable(below)) {
    if (left && passable(below - 1)) relax(below - 1, diagonal);
    relax(below, straight);
    if (right && passable(below + 1)) relax(below + 1, diagonal);
  }
  if (left) relax(index - 1, straight);
  if (right) relax(index + 1, straight);
  if (passable(above)) {
    if (left && passable(above - 1)) relax(above - 1, diagonal);
    relax(above, straight);
    if (right && passable(above + 1)) relax(above + 1, diagonal);
  }
}

void FrontierFinder::spread_at_border(Cell cell) noexcept {
  const std::int32_t cost = cost_[geometry_.index(cell)];
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) {
      const Cell next{cell.column + dx, cell.row + dy};
      if (!geometry_.contains(next) || !passable(geometry_.index(next))) continue;
      const bool diagonal = dx != 0 && dy != 0;
      if (diagonal && !(passable(geometry_.index({next.column, cell.row})) &&
                        passable(geometry_.index({cell.column, next.row})))) {
        continue;
      }
      relax(static_cast<std::uint32_t>(geometry_.index(next)),
            cost + (diagonal ? kDiagonalCost : kStraightCost));
    }
  }
}

void FrontierFinder::cluster() noexcept {
  for (std::size_t i = 0; i < member_count_; ++i) {
    if (is_member_[members_[i]] != kOpen) continue;
    const Frontier frontier = grow(members_[i]);
    if (frontier.size_m >= options_.min_size_m) keep(frontier);
  }
}

Frontier FrontierFinder::grow(std::uint32_t seed) noexcept {
  const Cell origin = geometry_.cell(seed);
  const int extent = cells_of(geometry_, options_.extent_m);
  std::size_t size = 1;
  stack_[0] = seed;
  is_member_[seed] = kTaken;
  double sum_column = 0.0;
  double sum_row = 0.0;
  // Breadth first: stack_[0, size) ends up as the whole stretch.
  for (std::size_t done = 0; done < size; ++done) {
    const Cell cell = geometry_.cell(stack_[done]);
    sum_column += cell.column;
    sum_row += cell.row;
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        const Cell next{cell.column + dx, cell.row + dy};
        if (!geometry_.contains(next)) continue;
        const auto index = static_cast<std::uint32_t>(geometry_.index(next));
        const int across = next.column - origin.column;
        const int along = next.row - origin.row;
        if (is_member_[index] != kOpen || across * across + along * along > extent * extent) continue;
        is_member_[index] = kTaken;
        stack_[size++] = index;
      }
    }
  }
  // The member nearest to the middle stands for all.
  const double mean_column = sum_column / static_cast<double>(size);
  const double mean_row = sum_row / static_cast<double>(size);
  std::uint32_t middle = seed;
  double best = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < size; ++i) {
    const Cell cell = geometry_.cell(stack_[i]);
    const double across = cell.column - mean_column;
    const double along = cell.row - mean_row;
    if (across * across + along * along >= best) continue;
    best = across * across + along * along;
    middle = stack_[i];
  }
  const double per_cost_m = geometry_.resolution_m / kStraightCost;
  return {geometry_.centre(geometry_.cell(middle)), static_cast<double>(size) * geometry_.resolution_m,
          static_cast<double>(cost_[middle]) * per_cost_m};
}

void FrontierFinder::keep(const Frontier& frontier) noexcept {
  const auto worth = [this](const Frontier& f) { return f.cost_m - options_.size_gain * f.size_m; };
  if (list_.full() && worth(frontier) >= worth(list_[list_.size() - 1])) return;
  if (!list_.full()) list_.resize(list_.size() + 1);
  std::size_t place = list_.size() - 1;
  for (; place > 0 && worth(list_[place - 1]) > worth(frontier); --place) list_[place] = list_[place - 1];
  list_[place] = frontier;
}

double FrontierFinder::cost_m(const Point& place) const noexcept {
  const Cell cell = geometry_.cell_at(place.x, place.y);
  if (!geometry_.contains(cell)) return std::numeric_limits<double>::infinity();
  const std::int32_t cost = cost_[geometry_.index(cell)];
  if (cost == kUnreachedCost) return std::numeric_limits<double>::infinity();
  return cost * geometry_.resolution_m / kStraightCost;
}

bool FrontierFinder::any_near(const Point& place, double reach_m) const noexcept {
  const Cell centre = geometry_.cell_at(place.x, place.y);
  return nearest_cell(geometry_, centre, cells_of(geometry_, reach_m),
                      [this](Cell cell) { return is_member_[geometry_.index(cell)] != 0; })
      .has_value();
}

}  // namespace mauve_examples
