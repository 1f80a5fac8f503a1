// SPDX-License-Identifier: LGPL-3.0-or-later
// The goal a robot is on its way to, whether it gets there, and the places it has given up.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "mauve_examples/frontiers.hpp"

namespace mauve_examples {

struct GoalOptions {
  double reached_m{0.6};                     // nearer than this the robot is there
  double frontier_reach_m{1.0};              // a goal with no frontier cell within this has been explored
  double progress_m{0.25};                   // less than this is no progress
  std::int64_t patience_ns{10'000'000'000};  // without progress for so long, the goal is given up
  std::int64_t grudge_ns{30'000'000'000};    // for how long a place that was given up is not tried again
};

/// Not thread-safe. Trivially movable; all functions [rt].
class GoalWatch {
 public:
  void set_options(const GoalOptions& options) noexcept { options_ = options; }

  /// Sets out for a frontier.
  void set(const Frontier& frontier, std::int64_t now_ns) noexcept;
  /// Drops the goal when it is reached, explored, unreachable or not coming nearer; gives the place up when
  /// that would only repeat itself. `frontiers` must have looked from where the robot is.
  void update(const FrontierFinder& frontiers, const Pose2D& robot, std::int64_t now_ns) noexcept;
  /// Leaves the goal to a peer; it is not given up.
  void drop() noexcept { active_ = false; }
  /// Whether the place was given up and its time has not passed.
  bool given_up(const Point& place, std::int64_t now_ns) const noexcept;

  bool active() const noexcept { return active_; }
  /// The present goal, or the last one when none is active.
  const Point& goal() const noexcept { return goal_; }
  /// Length of the way left, as of the last update.
  double remaining_m() const noexcept { return remaining_m_; }

 private:
  struct Grudge {
    Point at;
    std::int64_t until_ns{0};
  };

  void give_up(std::int64_t now_ns) noexcept;

  GoalOptions options_;
  Point goal_;
  bool active_{false};
  double remaining_m_{0.0};
  double best_m_{0.0};              // the least that was ever left of the way
  std::int64_t progress_at_ns_{0};  // when it was
  std::array<Grudge, 16> grudges_{};
  std::size_t next_grudge_{0};
};

}  // namespace mauve_examples
