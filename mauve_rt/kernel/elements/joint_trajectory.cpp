// SPDX-License-Identifier: LGPL-3.0-or-later
// Interpolation of a JointTrajectory: the JointState of each period.
#include <algorithm>
#include <cmath>

#include <mauve_types/trajectory_msgs/msg/joint_trajectory.hpp>

#include "mauve_rt/elements/joint_spline.hpp"
#include "mauve_rt/elements/registration.hpp"

#include "joint_plugins.hpp"

namespace mauve::joints {

using msg::trajectory_msgs::JointTrajectory;
using msg::trajectory_msgs::JointTrajectoryPoint;

struct JointTrajectoryShell : PeriodicShell {
  ReadPort<JointTrajectory>& input = read_port<JointTrajectory>("input");
  WritePort<JointState>& output = write_port<JointState>("output");
};

/// A trajectory on its way, in memory that comes with configure.
struct Motion {
  JointTrajectory trajectory;
  Sequence<std::size_t> columns;  // of each joint, in the order of the output
  time_ns_t start_ns{0};          // of the trajectory's time 0
  time_ns_t from_ns{0};           // it moves the joints from here on: when it starts, or was received
  bool is_set{false};

  const Sequence<JointTrajectoryPoint>& points() const noexcept { return trajectory.points; }
  time_ns_t instant_ns(std::size_t point) const noexcept {
    const auto& from_start = points()[point].time_from_start;
    return start_ns + s_to_ns(from_start.sec) + from_start.nanosec;
  }
  SplineOrder order(std::size_t point) const noexcept {
    if (points()[point].velocities.empty()) return SplineOrder::linear;
    return points()[point].accelerations.empty() ? SplineOrder::cubic : SplineOrder::quintic;
  }
  JointMotion at(std::size_t point, std::size_t joint) const noexcept {
    const JointTrajectoryPoint& values = points()[point];
    const std::size_t column = columns[joint];
    return {.position = values.positions[column],
            .velocity = values.velocities.empty() ? 0.0 : values.velocities[column],
            .acceleration = values.accelerations.empty() ? 0.0 : values.accelerations[column]};
  }
};

/// Follows the newest trajectory that has begun, and holds its last point. A new trajectory begins at its stamp (0: when it is
/// received), at the motion that the joints have then.
class JointTrajectoryCore final : public UpdateCore<JointTrajectoryShell> {
 public:
  void update() override {
    shell().input.with([&](const JointTrajectory& trajectory) {
      if (shell().input.status() == DataStatus::new_data) receive(trajectory);
    });
    if (waiting_->is_set && waiting_->from_ns <= clock_ns()) begin();
    if (!running_->is_set) return;
    sample(clock_ns());
    write();
  }
  /// Copies, since a core on probation may have to give way to the old one.
  void take(CoreBase& old) noexcept override {
    const auto* other = dynamic_cast<const JointTrajectoryCore*>(&old);
    if (other == nullptr) return;
    *running_ = *other->running_;
    *waiting_ = *other->waiting_;
    names_ = other->names_;
    now_ = other->now_;
    begin_ = other->begin_;
    has_begin_ = other->has_begin_;
    for (Motion* motion : {running_, waiting_})  // what does not fit into other capacities is gone
      motion->is_set = motion->is_set && are_points_good(*motion);
  }

 protected:
  bool configure_hook() override {
    for (Motion& motion : motions_) {
      motion = {};
      motion.trajectory = shell().input.prototype();
      motion.columns.allocate(motion.trajectory.joint_names.capacity());
    }
    const std::size_t joints = motions_[0].trajectory.joint_names.capacity();
    require_room(shell().output.prototype(), joints, true, description());
    names_.allocate(joints);
    now_.allocate(joints);
    begin_.allocate(joints);
    has_begin_ = false;
    bad_joints_ = TraceNames::intern("refused trajectory: joints");
    bad_points_ = TraceNames::intern("refused trajectory: points");
    over_ = TraceNames::intern("refused trajectory: it is over");
    return true;
  }

 private:
  using Names = Sequence<BoundedString<255>>;

  void receive(const JointTrajectory& trajectory) {
    Motion& fresh = *spare_;
    fresh.trajectory = trajectory;
    const auto& stamp = fresh.trajectory.header.stamp;
    fresh.start_ns = clock_ns();
    if (stamp.sec != 0 || stamp.nanosec != 0)  // a later step of CLOCK_REALTIME moves no motion
      fresh.start_ns += s_to_ns(stamp.sec) + stamp.nanosec - realtime_now_ns();
    fresh.from_ns = std::max(fresh.start_ns, clock_ns());
    if (!find_columns(fresh)) {
      trace_mark(bad_joints_);
    } else if (!are_points_good(fresh)) {
      trace_mark(bad_points_);
    } else if (fresh.instant_ns(fresh.points().size() - 1) <= fresh.from_ns) {
      trace_mark(over_);
    } else {
      fresh.is_set = true;
      std::swap(spare_, waiting_);
    }
  }
  /// A first trajectory may have any joints, the others have to have the same ones, in any order.
  bool find_columns(Motion& fresh) const noexcept {
    const Names& given = fresh.trajectory.joint_names;
    const Names& wanted = running_->is_set ? names_ : given;
    if (given.empty() || given.size() != wanted.size()) return false;
    fresh.columns.clear();
    for (const auto& name : wanted) {
      const auto column = static_cast<std::size_t>(std::ranges::find(given, name) - given.begin());
      // Of two equal names the second is not found, and of different ones one is missing.
      if (column == given.size() || (&wanted == &given && column != fresh.columns.size())) return false;
      fresh.columns.push_back(column);
    }
    return true;
  }
  static bool are_points_good(const Motion& fresh) noexcept {
    const std::size_t joints = fresh.trajectory.joint_names.size();
    const auto has = [joints](const Sequence<double>& values) {
      return values.size() == joints &&
             std::ranges::all_of(values, [](double value) { return std::isfinite(value); });
    };
    const auto may_have = [&](const Sequence<double>& values) {
      return !values.is_overflowed() && (values.empty() || has(values));
    };
    for (std::size_t i = 0; i < fresh.points().size(); ++i) {
      const JointTrajectoryPoint& point = fresh.points()[i];
      if (!has(point.positions) || !may_have(point.velocities) || !may_have(point.accelerations))
        return false;
      if (fresh.instant_ns(i) < fresh.start_ns || (i > 0 && fresh.instant_ns(i) <= fresh.instant_ns(i - 1)))
        return false;
    }
    return !fresh.points().empty();
  }

  void begin() {
    has_begin_ = running_->is_set;
    if (has_begin_) {
      sample(waiting_->from_ns);
      begin_ = now_;
    } else {
      names_ = waiting_->trajectory.joint_names;
      now_.resize(names_.size());
    }
    std::swap(running_, waiting_);
    waiting_->is_set = false;
  }
  /// Writes the motion at an instant to now_.
  void sample(time_ns_t instant_ns) {
    const Motion& motion = *running_;
    const std::size_t points = motion.points().size();
    std::size_t to = 0;
    while (to < points && motion.instant_ns(to) <= instant_ns) ++to;
    // From where the joints were at the begin, unless a point has been passed since.
    const bool is_from_begin = has_begin_ && (to == 0 || motion.instant_ns(to - 1) <= motion.from_ns);
    const bool is_held = to == points || (to == 0 && !has_begin_);
    for (std::size_t joint = 0; joint < now_.size(); ++joint) {
      if (is_held) {
        now_[joint] = {.position = motion.at(to == 0 ? 0 : to - 1, joint).position};
        continue;
      }
      const time_ns_t from_ns = is_from_begin ? motion.from_ns : motion.instant_ns(to - 1);
      const JointMotion from = is_from_begin ? begin_[joint] : motion.at(to - 1, joint);
      const SplineOrder order =
          is_from_begin ? motion.order(to) : std::min(motion.order(to - 1), motion.order(to));
      now_[joint] =
          interpolate(from, motion.at(to, joint), static_cast<double>(motion.instant_ns(to) - from_ns) * 1e-9,
                      static_cast<double>(instant_ns - from_ns) * 1e-9, order);
    }
  }
  void write() {
    shell().output.write_with([&](JointState& state) {
      state.header = {};
      state.name = names_;
      for (const JointMotion& joint : now_) {
        state.position.push_back(joint.position);
        state.velocity.push_back(joint.velocity);
      }
    });
  }

  std::array<Motion, 3> motions_;
  Motion* running_{&motions_[0]};
  Motion* waiting_{&motions_[1]};  // begins later
  Motion* spare_{&motions_[2]};    // takes what is received
  Names names_;                    // of the joints, as the first trajectory has them
  Sequence<JointMotion> now_;
  Sequence<JointMotion> begin_;  // the motion at running_->from_ns
  bool has_begin_{false};        // of the first trajectory there is none
  std::uint32_t bad_joints_{0};
  std::uint32_t bad_points_{0};
  std::uint32_t over_{0};
};

void register_joint_trajectory(PluginRegistry& registry) {
  registry.type<JointTrajectory>();
  register_element<JointTrajectoryCore>(registry, "mauve_rt/JointTrajectory");
}

}  // namespace mauve::joints
