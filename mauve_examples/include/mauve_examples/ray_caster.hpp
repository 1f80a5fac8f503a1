// SPDX-License-Identifier: LGPL-3.0-or-later
// The simulated range finder: exact ranges in the true map.
#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "mauve_examples/grid_traversal.hpp"
#include "mauve_examples/map_file.hpp"
#include "mauve_examples/types.hpp"

namespace mauve_examples {

/// Headings of the beams relative to the robot, computed once.
class BeamTable {
 public:
  BeamTable() noexcept;
  /// Direction of a beam for a robot whose heading is given as a unit vector. [rt]
  Direction direction(std::size_t beam, const Direction& heading) const noexcept {
    const Direction& relative = beams_[beam];
    return {heading.x * relative.x - heading.y * relative.y, heading.y * relative.x + heading.x * relative.y};
  }

 private:
  std::array<Direction, kBeamCount> beams_;
};

/// The table all scans share. Call once before real time begins. [rt]
const BeamTable& beam_table() noexcept;

/// Distance to where the beam enters the first cell that is not free, unknown cells and the map's end
/// included; infinity when that is beyond max_range_m. [rt]
double cast_ray(const GridMap& map, const Point& from, const Direction& direction,
                double max_range_m) noexcept;

/// One turn of the range finder at the pose, in a world without robots. [rt]
void range_scan(const GridMap& map, const Pose2D& pose, float max_range_m, Scan& scan) noexcept;

/// Ends the beams of a scan taken at the pose at the robots they meet first, and notes whose beams they are. [rt]
void scan_robots(std::span<const RobotBody> robots, const Pose2D& pose, Scan& scan) noexcept;

}  // namespace mauve_examples
