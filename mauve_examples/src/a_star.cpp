// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_examples/a_star.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>

#include "mauve_examples/grid_traversal.hpp"
#include "mauve_examples/nearest_cell.hpp"

namespace mauve_examples {

namespace {

// Costs are integers: a step of one cell with weight kUnit costs kStraight * kUnit.
constexpr int kUnit = 8;
constexpr std::uint32_t kStraight = 5;
constexpr std::uint32_t kDiagonal = 7;
constexpr std::uint32_t kUnreached = std::numeric_limits<std::uint32_t>::max();

struct Move {
  int column;
  int row;
};
// Opposite moves are four apart.
constexpr std::array<Move, 8> kMoves{{{1, 0}, {1, 1}, {0, 1}, {-1, 1}, {-1, 0}, {-1, -1}, {0, -1}, {1, -1}}};

}  // namespace

void AStar::configure(const GridGeometry& geometry, const PlanOptions& options) {
  geometry_ = geometry;
  options_ = options;
  clearance_.configure(geometry, options.comfort_m);
  open_.configure(geometry.cell_count());
  cost_.assign(geometry.cell_count(), kUnreached);
  onward_.assign(geometry.cell_count(), 0);

  const std::uint16_t near = clearance_.squared_cells(options.radius_m);
  const std::uint16_t far = clearance_.squared_cells(options.comfort_m);
  weight_of_clearance_.assign(std::size_t{far} + 1, 0);
  for (std::size_t squared = near; squared <= far; ++squared) {
    const double span = std::max(1e-9, std::sqrt(far) - std::sqrt(near));
    const double missing = (std::sqrt(far) - std::sqrt(static_cast<double>(squared))) / span;
    const double weight = kUnit * (1.0 + options.comfort_weight * missing);
    weight_of_clearance_[squared] = static_cast<std::uint8_t>(std::clamp(weight, 1.0, 255.0));
  }
}

std::uint8_t AStar::weight(std::size_t index) const noexcept {
  const std::int8_t state = cells_[index];
  if (state != kFree && (state != kUnknown || options_.unknown_weight <= 0.0)) return 0;
  const std::size_t squared =
      std::min<std::size_t>(clearance_.squared(index), weight_of_clearance_.size() - 1);
  const std::uint8_t weight = weight_of_clearance_[squared];
  if (state == kFree) return weight;
  return static_cast<std::uint8_t>(std::min(weight * (1.0 + options_.unknown_weight), 255.0));
}

PlanStatus AStar::plan(std::span<const std::int8_t> cells, const Point& start, const Point& goal,
                       double path_step_m, Path& path) noexcept {
  path.clear();
  expanded_ = 0;
  cells_ = cells;
  clearance_.compute(cells);
  const int reach = cells_of(geometry_, options_.snap_m);
  const auto fits = [this](Cell cell) { return passable(cell); };
  const auto first = nearest_cell(geometry_, geometry_.cell_at(start.x, start.y), reach, fits);
  if (!first) return PlanStatus::start_blocked;
  const auto last = nearest_cell(geometry_, geometry_.cell_at(goal.x, goal.y), reach, fits);
  if (!last) return PlanStatus::goal_blocked;
  if (!search(*first, *last)) return PlanStatus::no_path;
  simplify(start, *first, *last, path_step_m, path);
  return PlanStatus::found;
}

std::uint32_t AStar::heuristic(Cell cell, Cell start) const noexcept {
  const auto across = static_cast<std::uint32_t>(std::abs(cell.column - start.column));
  const auto along = static_cast<std::uint32_t>(std::abs(cell.row - start.row));
  const std::uint32_t diagonal = std::min(across, along);
  return kUnit * (kDiagonal * diagonal + kStraight * (std::max(across, along) - diagonal));
}

bool AStar::search(Cell start, Cell goal) noexcept {
  std::fill(cost_.begin(), cost_.end(), kUnreached);
  open_.clear();
  cost_[geometry_.index(goal)] = 0;
  open_.push_or_decrease(static_cast<std::uint32_t>(geometry_.index(goal)), heuristic(goal, start));
  const auto wanted = static_cast<std::uint32_t>(geometry_.index(start));
  while (!open_.empty()) {
    const std::uint32_t index = open_.pop();
    ++expanded_;
    if (index == wanted) return true;
    expand(geometry_.cell(index), start);
  }
  return false;
}

void AStar::expand(Cell cell, Cell start) noexcept {
  const std::size_t index = geometry_.index(cell);
  for (std::size_t move = 0; move < kMoves.size(); ++move) {
    const Cell next{cell.column + kMoves[move].column, cell.row + kMoves[move].row};
    if (!geometry_.contains(next)) continue;
    const std::size_t next_index = geometry_.index(next);
    const std::uint8_t next_weight = weight(next_index);
    if (next_weight == 0) continue;
    const bool diagonal = move % 2 == 1;
    if (diagonal && !(passable({next.column, cell.row}) && passable({cell.column, next.row}))) continue;
    const std::uint32_t cost = cost_[index] + (diagonal ? kDiagonal : kStraight) * next_weight;
    if (cost >= cost_[next_index]) continue;
    cost_[next_index] = cost;
    onward_[next_index] = static_cast<std::uint8_t>((move + 4) % kMoves.size());
    open_.push_or_decrease(static_cast<std::uint32_t>(next_index), cost + heuristic(next, start));
  }
}

void AStar::simplify(const Point& start, Cell first, Cell goal, double path_step_m,
                     Path& path) const noexcept {
  // From where it does not fit, the robot first steps straight out; elsewhere the path begins under its feet.
  const bool fits = passable(geometry_.cell_at(start.x, start.y));
  Point anchor = fits ? start : geometry_.centre(first);
  if (!fits) path.push_back(anchor);
  Cell reached = first;
  double length_m = distance_m(start, geometry_.centre(first));
  int worst = weight(geometry_.index(first));
  for (Cell cell = first; cell != goal;) {
    const Move move = kMoves[onward_[geometry_.index(cell)]];
    cell = {cell.column + move.column, cell.row + move.row};
    length_m += distance_m(geometry_.centre(reached), geometry_.centre(cell));
    const int here = weight(geometry_.index(cell));
    const Point centre = geometry_.centre(cell);
    // A straight line must be hardly worse than the path it replaces: about as far from walls, as little
    // unknown.
    const int allowed = std::max(worst, here);
    const bool straight =
        distance_m(anchor, centre) <= path_step_m && line_is_clear(geometry_, anchor, centre, [&](Cell on) {
          const int weight_on = geometry_.contains(on) ? weight(geometry_.index(on)) : 0;
          return weight_on != 0 && weight_on <= allowed + kUnit / 2;
        });
    if (straight) {
      worst = allowed;
    } else {
      anchor = geometry_.centre(reached);
      if (!path.push_back(anchor)) break;
      worst = std::max<int>(weight(geometry_.index(reached)), here);
    }
    reached = cell;
  }
  path.push_back(geometry_.centre(reached));
  path.set_length_m(length_m);
}

}  // namespace mauve_examples
