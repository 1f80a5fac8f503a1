// SPDX-License-Identifier: LGPL-3.0-or-later
// Robot: the simulated body. Velocity commands in, pose, scan and frames out, 100 Hz; tells the other bodies where it is.
#pragma once

#include <memory>

#include "mauve_rt/data/transform_tree.hpp"

#include "mauve_examples/map_file.hpp"
#include "mauve_examples/model/robot_core.hpp"
#include "mauve_examples/types.hpp"
#include "mauve_examples/unicycle.hpp"

namespace mauve_examples {

inline constexpr std::size_t kMaxOthers = 15;

class Robot final : public RobotCore {
 public:
  /// Moves for one period, unless into something. [rt]
  void move() override;
  /// Looks around and tells where it is and what it sees. [rt]
  void sense() override;

  /// Another such core goes on from where the robot is. [rt]
  void take(mauve::CoreBase& old) noexcept override;

 protected:
  bool configure_hook() override;

 private:
  Twist command_in_force() const;
  void meet_others();
  void set_frames();
  void set_frame(mauve::SetTransform::Request& request, const mauve::Transform& transform);

  GridMap world_;
  Unicycle body_;
  UnicycleLimits limits_;
  std::unique_ptr<Scan> scan_;
  std::unique_ptr<Scan> walls_;  // without robots: as before while this one stands
  Pose2D seen_from_;
  mauve::BoundedVector<RobotBody, kMaxOthers> others_;  // where they were when they last said so
  Pose2D start_;                                        // the odometry's origin
  mauve::SetTransform::Request odom_;                   // in the map
  mauve::SetTransform::Request base_;                   // in the odometry's frame
  mauve::SetTransform::Request scanner_;                // at the base
  bool are_static_frames_set_{false};
  std::int64_t steps_{0};
  std::int64_t collisions_{0};
  std::uint32_t collision_mark_{0};
};

}  // namespace mauve_examples
