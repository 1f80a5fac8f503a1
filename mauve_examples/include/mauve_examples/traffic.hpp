// SPDX-License-Identifier: LGPL-3.0-or-later
// The other robots as a planner takes them: obstacles that will not stay, and who gives way to whom.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "mauve_examples/grid_traversal.hpp"
#include "mauve_examples/robots_in_sight.hpp"

namespace mauve_examples {

struct TrafficOptions {
  double heed_m{2.5};          // farther robots are no obstacles yet
  double berth_m{0.28};        // radius of the obstacle that a robot is to the others' plans
  double lane_m{1.0};          // so far ahead of a moving robot is its way, too
  double near_m{1.3};          // who stands still with a way to go and a robot so near is in a jam
  double idle_near_m{0.9};     // who has nowhere to go makes room for robots so near
  double refuge_reach_m{6.0};  // how far a robot backs off at most
  std::int64_t patience_ns{1'000'000'000};  // of a robot in a jam with one of a lower number
  std::int64_t right_of_way_ns{
      4'000'000'000};                     // and of the one that goes first: the other may not be able to
  std::int64_t forget_ns{1'000'000'000};  // a robot out of sight is believed to be there for so long
};

/// Who is where, from what the range finder sees alone. The robot of the lower number goes first: the other plans
/// around it and the way ahead of it, and backs off when neither can go on. Not thread-safe; memory is allocated by
/// configure alone.
class Traffic {
 public:
  /// Allocates. `number` is the robot's own. [setup]
  void configure(const GridGeometry& geometry, std::uint8_t number, const TrafficOptions& options);

  /// Takes in a scan and where it was taken. [rt]
  void see(const Scan& scan, const Pose2D& pose, std::int64_t now_ns) noexcept;
  /// Draws those robots into a copy of the map that this one has to plan around. [rt]
  void draw(std::span<std::int8_t> cells) noexcept;
  /// Puts the map back where robots were drawn the last time. [rt]
  void erase(std::span<std::int8_t> cells, std::span<const std::int8_t> map) noexcept;
  /// Whether the robot has stood still for so long with others near that it is up to it to make room. Asks anew
  /// after each yes. [rt]
  bool must_back_off(bool has_path) noexcept;
  /// Whether the robot goes before all others that are near. [rt]
  bool goes_first() const noexcept { return goes_first_; }
  /// A place in the known free space where the robot is out of the others' way; none when there is no better one
  /// than where it stands. [rt]
  std::optional<Point> refuge(std::span<const std::int8_t> cells) noexcept;

 private:
  /// A robot as it was last seen.
  struct Other {
    Point at;
    Point anchor;   // where it was when it was last found to have moved
    Direction way;  // where it moved then
    std::int64_t seen_at_ns{kNever};
    std::int64_t moved_at_ns{kNever};
  };
  static constexpr std::int64_t kNever = -1'000'000'000'000;

  bool in_sight(const Other& other) const noexcept {
    return now_ns_ - other.seen_at_ns <= options_.forget_ns;
  }
  bool moving(const Other& other) const noexcept { return now_ns_ - other.moved_at_ns <= options_.forget_ns; }
  void draw_disc(std::span<std::int8_t> cells, const Point& at) noexcept;
  template <typename Visit>
  void for_each_cell_of_disc(const Point& at, Visit&& visit) const;
  bool roomy(std::span<const std::int8_t> cells, const Point& at) const noexcept;
  double worth(const Point& place, double way_m) const noexcept;

  GridGeometry geometry_;
  TrafficOptions options_;
  std::uint8_t number_{0};
  std::array<Other, kMaxSightings + 1> others_{};  // by number
  Sightings sightings_;
  mauve::BoundedVector<Point, 256> drawn_;  // the discs
  Pose2D pose_;
  Point stood_at_;
  std::int64_t stands_since_ns_{0};
  std::int64_t now_ns_{0};
  bool goes_first_{true};
  int side_{0};                        // of the square that is searched for a refuge, in steps
  std::vector<std::uint8_t> visited_;  // of its places
  std::vector<std::uint32_t> queue_;
  std::vector<std::uint16_t> steps_;
};

}  // namespace mauve_examples
