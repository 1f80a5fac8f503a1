// SPDX-License-Identifier: LGPL-3.0-or-later
// Shortest paths for a disc-shaped robot on an occupancy map that may be partly unknown.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "mauve_examples/cell_heap.hpp"
#include "mauve_examples/clearance.hpp"
#include "mauve_examples/path.hpp"

namespace mauve_examples {

struct PlanOptions {
  double radius_m{0.25};       // no part of the path is nearer to an obstacle: the robot and a little
  double comfort_m{0.55};      // from here on obstacles do not matter
  double comfort_weight{2.0};  // a metre at radius_m costs this much more than one at comfort_m
  double unknown_weight{
      0.5};            // a metre in unknown cells costs this many times more; 0: unknown cells are not passed
  double snap_m{0.8};  // start and goal may be moved this far to where the robot fits
};

enum class PlanStatus : std::uint8_t { found, start_blocked, goal_blocked, no_path };

/// A* on the 8-connected grid without cutting corners, from the goal to the start, so that parents lead
/// forward. Source: P. Hart, N. Nilsson, B. Raphael, "A Formal Basis for the Heuristic Determination of
/// Minimum Cost Paths", 1968. Not thread-safe; memory is allocated by configure alone.
class AStar {
 public:
  /// Allocates about 17 bytes a cell. [setup]
  void configure(const GridGeometry& geometry, const PlanOptions& options);

  /// Plans on the map given row by row; `path` becomes waypoints at most path_step_m apart with straight,
  /// passable lines between them, and empty unless the result is `found`. [rt]
  PlanStatus plan(std::span<const std::int8_t> cells, const Point& start, const Point& goal,
                  double path_step_m, Path& path) noexcept;

  /// How many cells the last plan looked at. [rt]
  std::size_t expanded() const noexcept { return expanded_; }

 private:
  std::uint8_t weight(std::size_t index) const noexcept;
  bool passable(Cell cell) const noexcept {
    return geometry_.contains(cell) && weight(geometry_.index(cell)) != 0;
  }
  std::uint32_t heuristic(Cell cell, Cell start) const noexcept;
  bool search(Cell start, Cell goal) noexcept;
  void expand(Cell cell, Cell start) noexcept;
  void simplify(const Point& start, Cell first, Cell goal, double path_step_m, Path& path) const noexcept;

  GridGeometry geometry_;
  PlanOptions options_;
  ClearanceField clearance_;
  std::vector<std::uint8_t> weight_of_clearance_;  // by squared clearance in cells; 0: too near
  std::span<const std::int8_t> cells_;             // only during a plan
  CellHeap open_;
  std::vector<std::uint32_t> cost_;   // from the goal
  std::vector<std::uint8_t> onward_;  // direction of the next cell towards the goal
  std::size_t expanded_{0};
};

}  // namespace mauve_examples
