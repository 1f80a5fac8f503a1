// SPDX-License-Identifier: LGPL-3.0-or-later
// Where the known world ends: free cells beside unknown ones that the robot can reach.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "mauve_examples/clearance.hpp"
#include "mauve_examples/types.hpp"

namespace mauve_examples {

/// A stretch of frontier cells, stood for by one of them.
struct Frontier {
  Point at;
  double size_m{0.0};
  double cost_m{0.0};  // length of the way there
};

struct FrontierOptions {
  double radius_m{0.25};  // as the planner's
  double extent_m{1.5};   // a longer stretch of frontier is cut: no cell of one lies farther from its nearest
  double min_size_m{0.2};  // smaller ones are cells that beams missed
  double size_gain{0.5};   // a metre of frontier is worth this many metres of way
};

inline constexpr std::size_t kMaxFrontiers = kMaxBids;
using FrontierList = mauve::BoundedVector<Frontier, kMaxFrontiers>;

/// Finds the frontiers by one shortest-path search from the robot through known free cells.
/// Source: B. Yamauchi, "A Frontier-Based Approach for Autonomous Exploration", 1997; the search is Dial's,
/// CACM 12, 1969. Not thread-safe; memory is allocated by configure alone.
class FrontierFinder {
 public:
  /// Allocates about 20 bytes a cell. [setup]
  void configure(const GridGeometry& geometry, const FrontierOptions& options);

  /// The frontiers of the map given row by row, best first: near ones, and of near ones the long ones. [rt]
  const FrontierList& find(std::span<const std::int8_t> cells, const Point& robot) noexcept;
  /// What the last find() found. [rt]
  const FrontierList& list() const noexcept { return list_; }

  /// Whether the last find() got anywhere: not where the map is still empty around the robot. [rt]
  bool has_view() const noexcept { return has_view_; }
  /// Length of the way to a place, by the last find(); infinity where it does not lead. [rt]
  double cost_m(const Point& place) const noexcept;
  /// Whether the last find() saw a frontier cell within reach_m of the place. [rt]
  bool any_near(const Point& place, double reach_m) const noexcept;

 private:
  static constexpr std::size_t kBuckets = 8;  // one more than the longest step
  static constexpr std::uint8_t kPassable = 1;
  static constexpr std::uint8_t kToBeSeen = 2;  // unknown, and not beside a wall

  bool passable(std::size_t index) const noexcept { return kind_[index] == kPassable; }
  void classify(std::span<const std::int8_t> cells) noexcept;
  bool beside_unknown(Cell cell) const noexcept;
  void flood(Cell start) noexcept;
  void spread_inside(std::uint32_t index) noexcept;
  void spread_at_border(Cell cell) noexcept;
  void relax(std::uint32_t index, std::int32_t cost) noexcept;
  void unlink(std::uint32_t index) noexcept;
  void cluster() noexcept;
  Frontier grow(std::uint32_t seed) noexcept;
  void keep(const Frontier& frontier) noexcept;

  GridGeometry geometry_;
  FrontierOptions options_;
  ClearanceField clearance_;
  std::uint16_t near_squared_{0};
  std::vector<std::uint8_t> kind_;   // what a cell is to the search
  std::vector<std::int32_t> cost_;   // in fifths of a cell; kUnreached
  std::vector<std::uint32_t> next_;  // of the same bucket
  std::vector<std::uint32_t> previous_;
  std::uint32_t bucket_[kBuckets]{};
  std::vector<std::uint32_t> members_;  // frontier cells, nearest first
  std::size_t member_count_{0};
  std::vector<std::uint32_t> stack_;     // of the stretch being grown
  std::vector<std::uint8_t> is_member_;  // 1: a frontier cell not yet in a stretch, 2: in one
  bool has_view_{false};
  FrontierList list_;
};

}  // namespace mauve_examples
