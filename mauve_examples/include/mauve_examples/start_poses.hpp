// SPDX-License-Identifier: LGPL-3.0-or-later
// Where the robots of a mission begin.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "mauve_examples/map_file.hpp"
#include "mauve_examples/types.hpp"

namespace mauve_examples {

/// Poses of `count` robots near one another, a robot's width apart and more, in the largest region a robot
/// can move in. Equal maps and seeds give equal poses on every machine. Throws MapError when there is no room
/// for all. [non-rt]
std::vector<Pose2D> start_poses(const GridMap& map, std::size_t count, std::uint64_t seed);

}  // namespace mauve_examples
