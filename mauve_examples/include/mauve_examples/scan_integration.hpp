// SPDX-License-Identifier: LGPL-3.0-or-later
// From a scan and the pose it was taken at to the map: what beams passed is free, what ended them is
// occupied.
#pragma once

#include "mauve_examples/occupancy_grid.hpp"

namespace mauve_examples {

/// Adds one scan, taken at the pose, to the map by casting its beams through it. [rt]
void integrate_scan(const Scan& scan, const Pose2D& pose, OccupancyGrid& map) noexcept;

}  // namespace mauve_examples
