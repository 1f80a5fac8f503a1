// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_examples/start_poses.hpp"

#include <algorithm>
#include <numbers>
#include <string>
#include <utility>

#include "mauve_examples/disc_collision.hpp"
#include "mauve_examples/reachability.hpp"
#include "mauve_examples/unicycle.hpp"

namespace mauve_examples {

namespace {

constexpr double kSeparation_m = 5.0 * kRobotRadius_m;  // between centres

/// SplitMix64: unlike the standard distributions it gives the same numbers with every library.
/// Source: G. Steele, D. Lea, C. Flood, "Fast Splittable Pseudorandom Number Generators", OOPSLA 2014.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  std::uint64_t next() {
    std::uint64_t z = (state_ += 0x9E3779B97F4A7C15ULL);
    z = (z ^ (z >> 30U)) * 0xBF58476D1CE4E5B9ULL;
    z = (z ^ (z >> 27U)) * 0x94D049BB133111EBULL;
    return z ^ (z >> 31U);
  }
  std::size_t below(std::size_t limit) { return static_cast<std::size_t>(next() % limit); }
  double unit() { return static_cast<double>(next() >> 11U) / static_cast<double>(1ULL << 53U); }

 private:
  std::uint64_t state_;
};

/// The largest set of standable cells that are connected, or none.
std::vector<std::size_t> largest_region(const GridMap& map, const std::vector<std::uint8_t>& standable) {
  std::vector<std::uint8_t> reached(map.cell_count(), 0);
  std::vector<std::size_t> largest;
  for (std::size_t i = 0; i < standable.size(); ++i) {
    if (standable[i] == 0 || reached[i] != 0) continue;
    std::vector<std::size_t> region = spread(map, standable, {i}, reached);
    if (region.size() > largest.size()) largest = std::move(region);
  }
  return largest;
}

}  // namespace

std::vector<Pose2D> start_poses(const GridMap& map, std::size_t count, std::uint64_t seed) {
  std::vector<Pose2D> poses;
  if (count == 0) return poses;
  Random random(seed);
  // With some room around the robots where the map has it.
  std::vector<std::uint8_t> standable = standable_cells(map, 2.0 * kRobotRadius_m);
  std::vector<std::size_t> region = largest_region(map, standable);
  if (region.empty()) {
    standable = standable_cells(map, kRobotRadius_m);
    region = largest_region(map, standable);
  }

  if (!region.empty()) {
    // The region again, now in the order of the way from the first robot: the others stand near, on its side
    // of walls.
    std::sort(region.begin(), region.end());
    std::vector<std::uint8_t> reached(map.cell_count(), 0);
    const std::vector<std::size_t> by_distance =
        spread(map, standable, {region[random.below(region.size())]}, reached);
    for (const std::size_t index : by_distance) {
      const Point at = map.centre(map.cell(index));
      const bool apart = std::all_of(poses.begin(), poses.end(), [&](const Pose2D& other) {
        return distance_m(at, other) >= kSeparation_m;
      });
      if (!apart) continue;
      poses.push_back({at.x, at.y, wrap_angle(2.0 * std::numbers::pi * random.unit())});
      if (poses.size() == count) return poses;
    }
  }
  throw MapError({"map is too small for the robots", "start poses", "room for " + std::to_string(count),
                  "room for " + std::to_string(poses.size()), "use fewer robots or a larger map"});
}

}  // namespace mauve_examples
