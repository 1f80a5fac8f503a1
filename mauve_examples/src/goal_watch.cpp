// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_examples/goal_watch.hpp"

#include <algorithm>
#include <cmath>

#include "mauve_examples/grid_geometry.hpp"

namespace mauve_examples {

void GoalWatch::set(const Frontier& frontier, std::int64_t now_ns) noexcept {
  goal_ = frontier.at;
  active_ = true;
  remaining_m_ = frontier.cost_m;
  best_m_ = frontier.cost_m;
  progress_at_ns_ = now_ns;
}

void GoalWatch::update(const FrontierFinder& frontiers, const Pose2D& robot, std::int64_t now_ns) noexcept {
  if (!active_) return;
  const double left_m = frontiers.cost_m(goal_);
  remaining_m_ = std::isfinite(left_m) ? left_m : distance_m(robot, goal_);
  const bool explored = !frontiers.any_near(goal_, options_.frontier_reach_m);
  if (explored) {
    active_ = false;
    return;
  }
  if (distance_m(robot, goal_) < options_.reached_m) {
    // It stands there and still does not see what is beyond: it never will.
    give_up(now_ns);
    return;
  }
  if (remaining_m_ < best_m_ - options_.progress_m) {
    best_m_ = remaining_m_;
    progress_at_ns_ = now_ns;
  }
  if (now_ns - progress_at_ns_ >= options_.patience_ns) give_up(now_ns);
}

bool GoalWatch::given_up(const Point& place, std::int64_t now_ns) const noexcept {
  return std::any_of(grudges_.begin(), grudges_.end(), [&](const Grudge& grudge) {
    return now_ns < grudge.until_ns && distance_m(place, grudge.at) < options_.frontier_reach_m;
  });
}

void GoalWatch::give_up(std::int64_t now_ns) noexcept {
  active_ = false;
  grudges_[next_grudge_] = {goal_, now_ns + options_.grudge_ns};
  next_grudge_ = (next_grudge_ + 1) % grudges_.size();
}

}  // namespace mauve_examples
