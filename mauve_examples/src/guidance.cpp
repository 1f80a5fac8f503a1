// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_examples/guidance.hpp"

#include "mauve_examples/map_file.hpp"
#include "mauve_examples/ray_caster.hpp"

namespace mauve_examples {

namespace {

constexpr std::int64_t kOperatorPatience_ns =
    10'000'000'000;  // without a path for so long, an operator's goal is given up

}  // namespace

bool Guidance::configure_hook() {
  const GridMap world = load_map(shell().map.value());
  pilot_.configure(world, static_cast<std::uint8_t>(shell().number.value()));
  operator_goal_.emplace(
      shell().operator_goal, shell().lookup,
      mauve::TransformedReadPort<PoseStamped>::Options{.to = shell().goal.frames()->frame});
  scan_ = std::make_unique<Scan>();
  (void)beam_table();  // computed at its first use, which is not to be in real time
  return true;
}

bool Guidance::read_operator_goal() {
  const mauve::TransformedSample<PoseStamped> goal = operator_goal_->read();
  // One whose transform is not there yet is read once more at the next release.
  if (!goal || goal.time_ns <= operator_goal_ns_) return false;
  operator_goal_ns_ = goal.time_ns;
  const Point place{goal.value.pose.position.x, goal.value.pose.position.y, 0.0};
  if (!pilot_.geometry().contains(place)) return false;
  pilot_.set_goal(place);
  return true;
}

void Guidance::read_goals() {
  if (read_operator_goal()) {
    is_operated_ = true;
    has_path_ns_ = clock_ns();
  } else if (pilot_.has_path()) {
    has_path_ns_ = clock_ns();
  } else if (!pilot_.wants_path() || clock_ns() - has_path_ns_ > kOperatorPatience_ns) {
    is_operated_ = false;
  }
  if (is_operated_) return;
  if (const mauve::Sample<Point> goal = shell().goal.read(); goal.status != mauve::DataStatus::none)
    pilot_.set_goal(goal.value);
}

void Guidance::read_inputs() {
  const mauve::Sample<Pose2D> pose = shell().pose.read();
  if (pose.status == mauve::DataStatus::none) return;
  shell().scan.read(*scan_);
  read_goals();
  shell().map_get([this](const OccupancyGrid& map) { pilot_.read_map(map); });
  pilot_.look(*scan_, pose.value, clock_ns());
}

bool Guidance::has_new_goal() const { return pilot_.wants_path(); }

bool Guidance::has_path() const { return pilot_.has_path(); }

void Guidance::compute_path() {
  pilot_.plan(shell().path_step);
  write_target();
}

void Guidance::follow_path() {
  pilot_.follow(shell().target_threshold);
  write_target();
}

void Guidance::write_target() {
  if (has_path()) shell().target.write(pilot_.target());
}

}  // namespace mauve_examples
