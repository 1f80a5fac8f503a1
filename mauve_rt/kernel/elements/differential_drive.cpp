// SPDX-License-Identifier: LGPL-3.0-or-later
// A differential drive: from a Twist to the wheels' velocities, and from the wheels' positions to an Odometry.
#include "mauve_rt/elements/differential_drive.hpp"

#include <mauve_types/nav_msgs/msg/odometry.hpp>

#include "mauve_rt/elements/double_fields.hpp"
#include "mauve_rt/elements/guarded_core.hpp"
#include "mauve_rt/elements/registration.hpp"

#include "joint_plugins.hpp"

namespace mauve::joints {

using msg::nav_msgs::Odometry;

struct DifferentialDriveShell : PeriodicShell {
  Property<double>& wheel_radius_m =
      property("wheel_radius_m", 0.1, {.unit = "m", .description = "radius of the wheels", .minimum = 1e-6});
  Property<double>& wheel_separation_m =
      property("wheel_separation_m", 0.5,
               {.unit = "m",
                .description = "between the points at which the wheels touch the ground",
                .minimum = 1e-6});
  Property<std::string>& left_joint =
      property("left_joint", "left_wheel_joint", {.description = "joint of the left wheel"});
  Property<std::string>& right_joint =
      property("right_joint", "right_wheel_joint", {.description = "joint of the right wheel"});

  DifferentialDrive drive() const noexcept {
    return {.wheel_radius_m = wheel_radius_m, .wheel_separation_m = wheel_separation_m};
  }
};

struct DifferentialDriveCommandShell : DifferentialDriveShell {
  Property<std::int64_t>& max_age_ms =
      property("max_age_ms", 500,
               {.unit = "ms", .description = "for an older input the wheels stop; 0: any age", .minimum = 0});
  ReadPort<types::Twist>& input = read_port<types::Twist>("input");
  WritePort<JointState>& output = write_port<JointState>("output");
};

/// Velocities of the wheels for linear.x and angular.z of the input.
class DifferentialDriveCommandCore final : public GuardedCore<DifferentialDriveCommandShell> {
 public:
  void take(CoreBase& old) noexcept override {
    GuardedCore::take(old);
    if (const auto* other = dynamic_cast<const DifferentialDriveCommandCore*>(&old)) twist_ = other->twist_;
  }

 protected:
  bool read_inputs() override {
    twist_.update(shell().input);
    return is_fresh(twist_, shell().max_age_ms) && is_finite(twist_.value());
  }
  void write_output() override { write(twist_.value().linear.x, twist_.value().angular.z); }
  void write_default() override { write(0.0, 0.0); }
  bool configure_hook() override {
    require_room(shell().output.prototype(), 2, false, description());
    twist_ = {};
    return GuardedCore::configure_hook();
  }

 private:
  void write(double forward_m_s, double yaw_rad_s) {
    const WheelPair wheels = shell().drive().wheels(forward_m_s, yaw_rad_s);
    shell().output.write_with([&](JointState& state) {
      state.header = {};
      state.name.push_back(std::string_view(shell().left_joint.value()));
      state.name.push_back(std::string_view(shell().right_joint.value()));
      state.velocity.push_back(wheels.left);
      state.velocity.push_back(wheels.right);
    });
  }

  LatestSample<types::Twist> twist_;
};

struct DifferentialDriveOdometryShell : DifferentialDriveShell {
  Property<std::string>& frame_id = property("frame_id", "odom", {.description = "frame of the pose"});
  Property<std::string>& child_frame_id =
      property("child_frame_id", "base_link", {.description = "frame of the robot"});
  ReadPort<JointState>& input = read_port<JointState>("input");
  WritePort<Odometry>& output = write_port<Odometry>("output");
};

/// The pose from the positions of the wheels, with each new input that has both. The pose begins at zero.
class DifferentialDriveOdometryCore final : public UpdateCore<DifferentialDriveOdometryShell> {
  MAUVE_STATE(pose_, left_, right_, time_ns_, has_wheels_)

 public:
  void update() override {
    time_ns_t time_ns = 0;
    shell().input.with(
        [&](const JointState& state) {
          if (shell().input.status() == DataStatus::new_data) receive(state, time_ns);
        },
        &time_ns);
  }

 protected:
  bool configure_hook() override {
    pose_ = {};
    has_wheels_ = false;
    return true;
  }

 private:
  static constexpr std::size_t kNone = SIZE_MAX;

  void receive(const JointState& state, time_ns_t time_ns) {
    const std::size_t left = find(state, shell().left_joint);
    const std::size_t right = find(state, shell().right_joint);
    if (left == kNone || right == kNone) return;
    const DifferentialDrive drive = shell().drive();
    const WheelPair turns{state.position[left] - left_, state.position[right] - right_};
    WheelPair rates;
    if (has_wheels_) {
      drive.move(pose_, turns);
      const double time_s = static_cast<double>(time_ns - time_ns_) * 1e-9;
      if (time_s > 0.0) rates = {turns.left / time_s, turns.right / time_s};
    }
    if (std::max(left, right) < state.velocity.size()) rates = {state.velocity[left], state.velocity[right]};
    left_ = state.position[left];
    right_ = state.position[right];
    time_ns_ = time_ns;
    has_wheels_ = true;
    write(state, drive.forward(rates), drive.yaw(rates));
  }
  /// Where a joint with a position is; kNone where it has none.
  static std::size_t find(const JointState& state, const std::string& joint) noexcept {
    const auto found = std::ranges::find(state.name, std::string_view(joint));
    const auto at = static_cast<std::size_t>(found - state.name.begin());
    return at < state.name.size() && at < state.position.size() && std::isfinite(state.position[at]) ? at
                                                                                                     : kNone;
  }
  void write(const JointState& state, double forward_m_s, double yaw_rad_s) {
    odometry_.header.stamp = state.header.stamp;
    odometry_.header.frame_id = std::string_view(shell().frame_id.value());
    odometry_.child_frame_id = std::string_view(shell().child_frame_id.value());
    auto& pose = odometry_.pose.pose;
    pose.position.x = pose_.x;
    pose.position.y = pose_.y;
    pose.orientation.z = std::sin(pose_.theta / 2.0);
    pose.orientation.w = std::cos(pose_.theta / 2.0);
    odometry_.twist.twist.linear.x = forward_m_s;
    odometry_.twist.twist.angular.z = yaw_rad_s;
    shell().output.write(odometry_);
  }

  types::Pose2D pose_;
  double left_{0.0};  // positions of the wheels, and when they were so
  double right_{0.0};
  time_ns_t time_ns_{0};
  bool has_wheels_{false};
  Odometry odometry_;
};

void register_differential_drive(PluginRegistry& registry) {
  registry.type<JointState>();
  registry.type<Odometry>();
  register_element<DifferentialDriveCommandCore>(registry, "mauve_rt/DifferentialDriveCommand");
  register_element<DifferentialDriveOdometryCore>(registry, "mauve_rt/DifferentialDriveOdometry");
}

}  // namespace mauve::joints
