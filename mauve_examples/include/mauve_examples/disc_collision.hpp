// SPDX-License-Identifier: LGPL-3.0-or-later
// Whether a disc-shaped robot fits somewhere in the true map.
#pragma once

#include "mauve_examples/map_file.hpp"

namespace mauve_examples {

/// The robots' radius in every map of the mission.
inline constexpr double kRobotRadius_m = 0.2;

/// Whether a disc overlaps a cell that is not free, unknown cells and the map's end included. Exact. [rt]
bool disc_collides(const GridMap& map, double x_m, double y_m, double radius_m) noexcept;

}  // namespace mauve_examples
