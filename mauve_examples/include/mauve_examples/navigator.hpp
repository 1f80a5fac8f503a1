// SPDX-License-Identifier: LGPL-3.0-or-later
// Plans a path, hands out its points one after the other and notices when an obstacle has come to light on
// it.
#pragma once

#include <cstdint>
#include <span>

#include "mauve_examples/a_star.hpp"
#include "mauve_examples/path.hpp"

namespace mauve_examples {

/// Not thread-safe; memory is allocated by configure alone.
class Navigator {
 public:
  /// Allocates. [setup]
  void configure(const GridGeometry& geometry, const PlanOptions& options);

  /// Plans from the robot to the goal; the first waypoint is the target then. [rt]
  PlanStatus plan(std::span<const std::int8_t> cells, const Pose2D& robot, const Point& goal,
                  double path_step_m) noexcept;
  /// Goes on to the next waypoint when the robot is within threshold_m of the present one and the way on is
  /// clear; if it is not, a corner would be cut, and the robot first has to come as near as an eighth of
  /// that. [rt]
  void follow(std::span<const std::int8_t> cells, const Pose2D& robot, double threshold_m) noexcept;
  /// Whether an obstacle is known on the way to the target or on the look_ahead_m of the path behind it: one
  /// has come to light, or the robot has strayed. [rt]
  bool blocked(std::span<const std::int8_t> cells, const Pose2D& robot, double look_ahead_m) const noexcept;
  /// Whether the robot has hardly moved for patience_ns although its path goes on, as when it leans against
  /// something that the way to its target does not go around. [rt]
  bool stalled(const Pose2D& robot, std::int64_t now_ns, std::int64_t patience_ns) noexcept;
  /// Forgets the path. [rt]
  void clear() noexcept { path_.clear(); }

  const Path& path() const noexcept { return path_; }

 private:
  bool leaves_room(std::span<const std::int8_t> cells, Cell cell) const noexcept;
  bool line_leaves_room(std::span<const std::int8_t> cells, const Point& from,
                        const Point& to) const noexcept;

  GridGeometry geometry_;
  AStar planner_;
  Path path_;
  Point moved_from_;
  std::int64_t moved_at_ns_{0};
};

}  // namespace mauve_examples
