// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_examples/guidance.hpp"

#include <algorithm>

#include "mauve_examples/map_file.hpp"

namespace mauve_examples {

namespace {

constexpr double kLookAhead_m = 4.0;
constexpr std::int64_t kPatience_ns = mauve::s_to_ns(2);

}  // namespace

bool GuidanceCore::configure_hook() {
  const GridMap world = load_map(shell().map.value());
  navigator_.configure(world, PlanOptions{});
  cells_.assign(world.cell_count(), kUnknown);
  has_goal_ = needs_path_ = false;
  return true;
}

void GuidanceCore::read_inputs() {
  position_ = shell().pose.read().value;
  const mauve::Sample<Point> goal = shell().goal.read();
  if (goal.status == mauve::DataStatus::none) return;
  if (!has_goal_ || distance_m(goal.value, planned_goal_) > 0.0) needs_path_ = true;
  has_goal_ = true;
  goal_ = goal.value;
  shell().map_get([this](const OccupancyGrid& map) { std::ranges::copy(map.cells(), cells_.begin()); });
  const bool blocked = has_path() && navigator_.blocked(cells_, position_, kLookAhead_m);
  if (navigator_.stalled(position_, clock_ns(), kPatience_ns) || blocked) needs_path_ = true;
}

bool GuidanceCore::has_new_goal() const { return has_goal_ && needs_path_; }

bool GuidanceCore::has_path() const { return !navigator_.path().finished(); }

void GuidanceCore::compute_path() {
  planned_goal_ = goal_;
  needs_path_ = navigator_.plan(cells_, position_, goal_, shell().path_step) != PlanStatus::found;
  write_target();
}

void GuidanceCore::follow_path() {
  navigator_.follow(cells_, position_, shell().target_threshold);
  write_target();
}

void GuidanceCore::write_target() {
  if (has_path()) shell().target.write(navigator_.path().target());
}

void GuidanceFsm::define() {
  const mauve::time_ns_t unit_ns = mauve::ms_to_ns(shell().unit_ms);
  mauve::State& idle = execution("Idle", "read_inputs", &GuidanceCore::read_inputs);
  mauve::State& planning = execution("Planning", "compute_path", &GuidanceCore::compute_path);
  mauve::State& following = execution("Following", "follow_path", &GuidanceCore::follow_path);
  mauve::State& w1 = wait("W1", unit_ns);
  mauve::State& w2 = wait("W2", 2 * unit_ns);
  mauve::State& w3 = wait("W3", 5 * unit_ns);

  set_initial(idle);
  transition(idle, "has_new_goal", &GuidanceCore::has_new_goal, planning);
  transition(idle, "has_path", &GuidanceCore::has_path, following);
  next(idle, w1);
  next(w1, idle);
  next(following, w2);
  next(w2, idle);
  next(planning, w3);
  next(w3, idle);
}

}  // namespace mauve_examples
