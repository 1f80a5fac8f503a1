// SPDX-License-Identifier: LGPL-3.0-or-later
// Takes a robot to its goal through a world where others are on their way, too.
#pragma once

#include <cstdint>
#include <vector>

#include "mauve_examples/changed_tiles.hpp"
#include "mauve_examples/navigator.hpp"
#include "mauve_examples/occupancy_grid.hpp"
#include "mauve_examples/traffic.hpp"

namespace mauve_examples {

/// Plans on a copy of the map into which the robots in sight are drawn: the map itself never learns of them.
/// Not thread-safe; memory is allocated by configure alone.
class Pilot {
 public:
  /// Allocates. `number` is the robot's own. [setup]
  void configure(const GridGeometry& geometry, std::uint8_t number);

  /// Copies what has changed on the map: planning does not keep others from it. [rt]
  void read_map(const OccupancyGrid& map) noexcept;
  /// The map's, also while nothing of it is known. [rt]
  const GridGeometry& geometry() const noexcept { return geometry_; }
  /// Where to go; the same place again changes nothing. [rt]
  void set_goal(const Point& goal) noexcept;
  /// Judges the present path by what is seen and by the map as read. [rt]
  void look(const Scan& scan, const Pose2D& pose, std::int64_t now_ns) noexcept;

  /// Whether a path is to be planned: to a new goal, or because the present one leads no further. [rt]
  bool wants_path() const noexcept { return wants_path_; }
  bool has_path() const noexcept { return !navigator_.path().finished(); }
  /// Plans to the goal, or out of the others' way when it is up to this robot to make room. [rt]
  PlanStatus plan(double path_step_m) noexcept;
  /// Goes on along the path. [rt]
  void follow(double threshold_m) noexcept { navigator_.follow(cells_, pose_, threshold_m); }
  /// The next point of the path; only while there is one. [rt]
  const Point& target() const noexcept { return navigator_.path().target(); }

 private:
  bool backing_off() const noexcept { return now_ns_ < back_off_until_ns_; }
  PlanStatus plan_to(const Point& place, double path_step_m) noexcept;

  Navigator navigator_;
  Traffic traffic_;
  GridGeometry geometry_;
  ChangedTiles changes_;
  std::vector<std::int8_t> map_;    // as read
  std::vector<std::int8_t> cells_;  // with the robots in sight
  Pose2D pose_;
  Point goal_;
  bool has_goal_{false};
  bool wants_path_{false};
  bool makes_room_{false};      // the next plan leads out of the others' way
  bool was_on_its_way_{false};  // when it began to back off
  std::int64_t now_ns_{0};
  std::int64_t back_off_until_ns_{0};
};

}  // namespace mauve_examples
