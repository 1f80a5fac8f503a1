// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_examples/guidance.hpp"

#include <algorithm>
#include <limits>

#include "mauve_examples/map_file.hpp"
#include "mauve_examples/ray_caster.hpp"

namespace mauve_examples {

namespace {

constexpr mauve::time_ns_t kGoalPatience_ns = mauve::s_to_ns(10);  // so long a robot with a goal may stand
constexpr double kUnknown_m = std::numeric_limits<double>::quiet_NaN();
constexpr double kAnywhere_m = std::numeric_limits<double>::infinity();

}  // namespace

bool Guidance::configure_hook() {
  const GridMap world = load_map(shell().map.value());
  pilot_.configure(world, static_cast<std::uint8_t>(shell().number.value()));
  to_map_.emplace(shell().lookup, mauve::TransformOptions{.to = shell().goal.frames()->frame});
  scan_ = std::make_unique<Scan>();
  (void)beam_table();  // computed at its first use, which is not to be in real time
  return true;
}

mauve::ActionServerPorts<DriveTo> Guidance::drive_to() const {
  auto& ports = shell();
  return {.status = ports.drive_to_status,
          .goal = ports.drive_to_goal,
          .decide = ports.drive_to_decide,
          .feedback = ports.drive_to_feedback,
          .result = ports.drive_to_result};
}

void Guidance::begin_goal(std::uint32_t number, const Pose2D& pose) {
  goal_number_ = number;
  has_place_ = false;
  moved_from_ = {pose.x, pose.y, 0.0};
  moved_ns_ = clock_ns();
  tolerance_m_ = kAnywhere_m;
  if (number == 0) pilot_.set_goal({pose.x, pose.y, 0.0});  // it stays, unless it explores on
}

bool Guidance::find_place(const mauve::Sample<DriveTo::Goal>& goal) {
  if (has_place_) return true;
  const mauve::TransformedSample<PoseStamped> pose = to_map_->transform(
      mauve::Sample<PoseStamped>{.value = goal.value.pose, .status = goal.status, .time_ns = goal.time_ns},
      shell().goal.frames());
  // A transform of that time may still come.
  if (pose.outcome == mauve::TransformOutcome::after_interval ||
      pose.outcome == mauve::TransformOutcome::overtaken)
    return true;
  if (!pose) {
    log().warn("goal {} is aborted: frame {}: {}", goal_number_, pose.frame.view(), to_string(pose.outcome));
    return false;
  }
  place_ = {pose.value.pose.position.x, pose.value.pose.position.y, 0.0};
  has_place_ = pilot_.geometry().contains(place_);
  if (!has_place_)
    log().warn("goal {} is aborted: ({:.2f}, {:.2f}) is outside of the map", goal_number_, place_.x,
               place_.y);
  return has_place_;
}

bool Guidance::is_stuck(const Pose2D& pose) {
  constexpr double kHardly_m = 0.1;
  if (distance_m(pose, moved_from_) > kHardly_m) {
    moved_from_ = {pose.x, pose.y, 0.0};
    moved_ns_ = clock_ns();
  }
  if (clock_ns() - moved_ns_ <= kGoalPatience_ns) return false;
  log().warn("goal {} is aborted: no path leads nearer, the robot has not moved for {} s", goal_number_,
             kGoalPatience_ns / mauve::s_to_ns(1));
  return true;
}

bool Guidance::drive_to_goal(const Pose2D& pose) {
  mauve::ActionServerPorts<DriveTo> action = drive_to();
  const mauve::ActionGoal status = action.status.read().value;
  if (status.number != goal_number_) begin_goal(status.number, pose);
  if (goal_number_ == 0) return false;
  const mauve::Sample<DriveTo::Goal> goal = action.goal.read();
  const bool is_canceling = status.its_state() == mauve::GoalState::canceling;
  const bool can_go_on = is_canceling || (find_place(goal) && !is_stuck(pose));
  const double distance = has_place_ ? distance_m(pose, place_) : kUnknown_m;
  tolerance_m_ = goal.value.tolerance_m > 0.0 ? goal.value.tolerance_m : shell().target_threshold.value();
  if (is_canceling) {
    action.cancel({.distance_m = distance, .reached = false});
  } else if (distance <= tolerance_m_) {
    action.succeed({.distance_m = distance, .reached = true});
  } else if (!can_go_on) {
    action.abort({.distance_m = distance, .reached = false});
  } else {
    const auto elapsed_ns = static_cast<double>(clock_ns() - goal.time_ns);
    action.feedback.write({.distance_m = distance, .elapsed_s = elapsed_ns * 1e-9});
    if (has_place_) pilot_.set_goal(place_);
    return true;
  }
  begin_goal(0, pose);
  return false;
}

void Guidance::read_goals(const Pose2D& pose) {
  if (drive_to_goal(pose)) return;
  if (const mauve::Sample<Point> goal = shell().goal.read(); goal.status != mauve::DataStatus::none)
    pilot_.set_goal(goal.value);
}

void Guidance::read_inputs() {
  const mauve::Sample<Pose2D> pose = shell().pose.read();
  if (pose.status == mauve::DataStatus::none) return;
  shell().scan.read(*scan_);
  read_goals(pose.value);
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
  pilot_.follow(std::min(shell().target_threshold.value(), tolerance_m_));
  write_target();
}

void Guidance::write_target() {
  if (has_path()) shell().target.write(pilot_.target());
}

}  // namespace mauve_examples
