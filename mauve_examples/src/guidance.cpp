// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_examples/guidance.hpp"

#include "mauve_examples/map_file.hpp"
#include "mauve_examples/ray_caster.hpp"

namespace mauve_examples {

bool GuidanceCore::configure_hook() {
  const GridMap world = load_map(shell().map.value());
  pilot_.configure(world, static_cast<std::uint8_t>(shell().number.value()));
  scan_ = std::make_unique<Scan>();
  (void)beam_table();  // computed at its first use, which is not to be in real time
  return true;
}

void GuidanceCore::read_inputs() {
  const mauve::Sample<Pose2D> pose = shell().pose.read();
  if (pose.status == mauve::DataStatus::none) return;
  shell().scan.read(*scan_);
  if (const mauve::Sample<Point> goal = shell().goal.read(); goal.status != mauve::DataStatus::none)
    pilot_.set_goal(goal.value);
  shell().map_get([this](const OccupancyGrid& map) { pilot_.read_map(map); });
  pilot_.look(*scan_, pose.value, clock_ns());
}

bool GuidanceCore::has_new_goal() const { return pilot_.wants_path(); }

bool GuidanceCore::has_path() const { return pilot_.has_path(); }

void GuidanceCore::compute_path() {
  pilot_.plan(shell().path_step);
  write_target();
}

void GuidanceCore::follow_path() {
  pilot_.follow(shell().target_threshold);
  write_target();
}

void GuidanceCore::write_target() {
  if (has_path()) shell().target.write(pilot_.target());
}

void GuidanceFsm::define() {
  mauve::State& idle = execution("Idle", "read_inputs", &GuidanceCore::read_inputs);
  mauve::State& planning = execution("Planning", "compute_path", &GuidanceCore::compute_path);
  mauve::State& following = execution("Following", "follow_path", &GuidanceCore::follow_path);
  mauve::State& w1 = wait("W1", mauve::times(1, shell().unit_ms));
  mauve::State& w2 = wait("W2", mauve::times(2, shell().unit_ms));
  mauve::State& w3 = wait("W3", mauve::times(5, shell().unit_ms));

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
