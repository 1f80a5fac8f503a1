// SPDX-License-Identifier: LGPL-3.0-or-later
// Which cells of the true map a robot can ever stand on: what coverage is measured against.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "mauve_examples/map_file.hpp"
#include "mauve_examples/types.hpp"

namespace mauve_examples {

/// 1 for every cell whose centre a disc of the radius can reach from one of the starts, 0 elsewhere;
/// 8-connected without cutting corners. A start that does not fit counts from the nearest cell within half a
/// metre that does. [non-rt]
std::vector<std::uint8_t> reachable_cells(const GridMap& map, std::span<const Pose2D> starts,
                                          double radius_m);

/// 1 for every cell whose centre a disc of the radius fits at. [non-rt]
std::vector<std::uint8_t> standable_cells(const GridMap& map, double radius_m);

/// Spreads from the seeds (cell indices) over cells where standable is not 0; returns the cells reached in
/// the order of their distance in steps and marks them in `reached`. [non-rt]
std::vector<std::size_t> spread(const GridGeometry& grid, const std::vector<std::uint8_t>& standable,
                                const std::vector<std::size_t>& seeds, std::vector<std::uint8_t>& reached);

}  // namespace mauve_examples
