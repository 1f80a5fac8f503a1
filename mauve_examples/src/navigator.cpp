// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_examples/navigator.hpp"

#include "mauve_examples/disc_collision.hpp"
#include "mauve_examples/grid_traversal.hpp"
#include "mauve_examples/nearest_cell.hpp"

namespace mauve_examples {

void Navigator::configure(const GridGeometry& geometry, const PlanOptions& options) {
  geometry_ = geometry;
  planner_.configure(geometry, options);
  path_.configure();
}

PlanStatus Navigator::plan(std::span<const std::int8_t> cells, const Pose2D& robot, const Point& goal,
                           double path_step_m) noexcept {
  return planner_.plan(cells, {robot.x, robot.y, 0.0}, goal, path_step_m, path_);
}

void Navigator::follow(std::span<const std::int8_t> cells, const Pose2D& robot, double threshold_m) noexcept {
  if (path_.finished()) return;
  const double left_m = distance_m(robot, path_.target());
  if (left_m >= threshold_m) return;
  if (path_.next() + 1 < path_.points().size()) {
    const Point& after = path_.points()[path_.next() + 1];
    if (left_m >= threshold_m / 8.0 && !line_leaves_room(cells, {robot.x, robot.y, 0.0}, after)) return;
  } else if (left_m >= threshold_m / 2.0) {
    return;
  }
  path_.advance();
}

bool Navigator::blocked(std::span<const std::int8_t> cells, const Pose2D& robot,
                        double look_ahead_m) const noexcept {
  if (path_.finished()) return false;
  const Point& target = path_.target();
  // A robot that already is too near to something can only go on: no plan would start better.
  const bool free_standing = leaves_room(cells, geometry_.cell_at(robot.x, robot.y));
  if (free_standing ? !line_leaves_room(cells, {robot.x, robot.y, 0.0}, target)
                    : !leaves_room(cells, geometry_.cell_at(target.x, target.y))) {
    return true;
  }
  double ahead_m = 0.0;
  for (std::size_t i = path_.next() + 1; i < path_.points().size() && ahead_m < look_ahead_m; ++i) {
    const Point& from = path_.points()[i - 1];
    const Point& to = path_.points()[i];
    if (!line_leaves_room(cells, from, to)) return true;
    ahead_m += distance_m(from, to);
  }
  return false;
}

bool Navigator::stalled(const Pose2D& robot, std::int64_t now_ns, std::int64_t patience_ns) noexcept {
  constexpr double kHardly_m = 0.1;
  if (path_.finished() || distance_m(robot, moved_from_) > kHardly_m) {
    moved_from_ = {robot.x, robot.y, 0.0};
    moved_at_ns_ = now_ns;
    return false;
  }
  if (now_ns - moved_at_ns_ < patience_ns) return false;
  moved_at_ns_ = now_ns;  // once per patience
  return true;
}

bool Navigator::leaves_room(std::span<const std::int8_t> cells, Cell cell) const noexcept {
  // Half a cell more than the radius: obstacles reach from their cell's centre to its border.
  const double reach = kRobotRadius_m / geometry_.resolution_m + 0.5;
  const auto obstacle = nearest_cell(geometry_, cell, static_cast<int>(reach),
                                     [&](Cell near) { return cells[geometry_.index(near)] == kOccupied; });
  if (!obstacle) return true;
  const int across = obstacle->column - cell.column;
  const int along = obstacle->row - cell.row;
  return across * across + along * along >= reach * reach;
}

bool Navigator::line_leaves_room(std::span<const std::int8_t> cells, const Point& from,
                                 const Point& to) const noexcept {
  return line_is_clear(geometry_, from, to, [&](Cell cell) { return leaves_room(cells, cell); });
}

}  // namespace mauve_examples
