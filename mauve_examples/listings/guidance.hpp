// SPDX-License-Identifier: LGPL-3.0-or-later
// Listings 1 and 2 of the paper, and the state machines of its Fig. 2 and Fig. 4: the component Guidance, as
// short as it can be. The mission's own, in mauve_examples/guidance.hpp, plans around obstacles.
#pragma once

#include "mauve_rt/mauve_rt.hpp"

#include "mauve_examples/grid_geometry.hpp"
#include "mauve_examples/types.hpp"

namespace listings {

using mauve_examples::distance_m;
using mauve_examples::Point;

/// Listing 1: the shell is what others see.
struct GuidanceShell : mauve::Shell {
  mauve::Property<double>& target_threshold = property("target_threshold", 0.1, {.unit = "m"});
  mauve::Property<double>& path_step = property("path_step", 0.5, {.unit = "m"});
  mauve::ReadPort<Point>& position = read_port<Point>("position");
  mauve::ReadPort<Point>& goal = read_port<Point>("goal");
  mauve::WritePort<Point>& target = write_port<Point>("target", {.on_stop = mauve::OutputPolicy::hold});
};

/// Listing 2: the core is data and algorithms. A std::queue would allocate; the path has room for 64 points.
class GuidanceCore : public mauve::Core<GuidanceShell> {
 public:
  void read_inputs() {
    current_position_ = shell().position.read().value;
    goal_ = shell().goal.read();
  }
  bool has_new_goal() const {
    return goal_.status != mauve::DataStatus::none && distance_m(goal_.value, current_goal_) > 0.0;
  }
  bool has_path() const { return next_ < path_.size(); }
  void compute_path() {
    current_goal_ = goal_.value;
    path_.clear();
    next_ = 0;
    const double length_m = distance_m(current_position_, current_goal_);
    const double step_m = shell().path_step;
    for (double way_m = step_m; way_m < length_m && !path_.full(); way_m += step_m) {
      const double share = way_m / length_m;
      path_.push_back({current_position_.x + share * (current_goal_.x - current_position_.x),
                       current_position_.y + share * (current_goal_.y - current_position_.y), 0.0});
    }
    path_.push_back(current_goal_);
  }
  void follow_path() {
    shell().target.write(path_[next_]);
    if (distance_m(current_position_, path_[next_]) < shell().target_threshold) ++next_;
  }

 private:
  Point current_position_;
  mauve::Sample<Point> goal_;
  Point current_goal_;
  mauve::BoundedVector<Point, 64> path_;
  std::size_t next_{0};
};

/// Fig. 2: the same as periodic state machine. One action in each period, and one period, which must do for
/// planning too.
struct GuidancePsm : mauve::PeriodicFsm<GuidanceShell, GuidanceCore> {
  void define() override {
    period(mauve::ms_to_ns(50));
    const PeriodicState idle = periodic_state("Idle", "read_inputs", &GuidanceCore::read_inputs);
    const PeriodicState planning = periodic_state("Planning", "compute_path", &GuidanceCore::compute_path);
    const PeriodicState following = periodic_state("Following", "follow_path", &GuidanceCore::follow_path);
    set_initial(idle);
    transition(idle, "has_new_goal", &GuidanceCore::has_new_goal, planning);
    transition(idle, "has_path", &GuidanceCore::has_path, following);
    next(planning, idle);
    next(following, idle);
  }
};

/// Fig. 4: execution states take no time, and one leads to the next at once; waits of 1, 2 and 5 units of 10
/// ms.
struct GuidanceFsm : mauve::Fsm<GuidanceShell, GuidanceCore> {
  void define() override {
    constexpr mauve::time_ns_t kUnit_ns = mauve::ms_to_ns(10);
    mauve::State& idle = execution("Idle", "read_inputs", &GuidanceCore::read_inputs);
    mauve::State& planning = execution("Planning", "compute_path", &GuidanceCore::compute_path);
    mauve::State& following = execution("Following", "follow_path", &GuidanceCore::follow_path);
    mauve::State& w1 = wait("W1", 1 * kUnit_ns);
    mauve::State& w2 = wait("W2", 2 * kUnit_ns);
    mauve::State& w3 = wait("W3", 5 * kUnit_ns);
    set_initial(idle);
    transition(idle, "has_new_goal", &GuidanceCore::has_new_goal, planning);
    transition(idle, "has_path", &GuidanceCore::has_path, following);
    next(idle, w1);
    next(following, w2);
    next(planning, w3);
    next(w1, idle);
    next(w2, idle);
    next(w3, idle);
  }
};

}  // namespace listings
