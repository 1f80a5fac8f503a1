// SPDX-License-Identifier: LGPL-3.0-or-later
// Guidance: plans a path to the goal and hands its points to the controller.
#pragma once

#include <limits>
#include <memory>
#include <optional>

#include "mauve_rt/parts/action_ports.hpp"
#include "mauve_rt/parts/state_fields.hpp"
#include "mauve_rt/parts/transformed_read_port.hpp"

#include "mauve_examples/model/guidance_core.hpp"
#include "mauve_examples/occupancy_map.hpp"
#include "mauve_examples/pilot.hpp"

namespace mauve_examples {

/// Listing 2 of the paper.
class Guidance final : public GuidanceCore {
 public:
  /// Idle: reads position and goal, and looks at the map and at who is in sight. [rt]
  void read_inputs() override;
  /// A goal that no path was planned to yet, or whose path has become impassable, or room to be made. [rt]
  bool has_new_goal() const override;
  bool has_path() const override;
  /// Planning. [rt]
  void compute_path() override;
  /// Following. [rt]
  void follow_path() override;

 protected:
  bool configure_hook() override;

 private:
  // A core that replaces this one goes on with the goal of the action.
  MAUVE_STATE(goal_number_, has_place_, place_, moved_from_, moved_ns_)

  mauve::ActionServerPorts<DriveTo> drive_to() const;
  void read_goals(const Pose2D& pose);
  /// Whether the goal of the action says where to go; ends the goal where it is time to.
  bool drive_to_goal(const Pose2D& pose);
  void begin_goal(std::uint32_t number, const Pose2D& pose);
  /// Looks the place of the goal up, once. False, with a log line: there will be none, or the robot cannot go there.
  bool find_place(const mauve::Sample<DriveTo::Goal>& goal);
  /// Whether the robot has not moved for so long that it will not, with a log line.
  bool is_stuck(const Pose2D& pose);
  void write_target();

  Pilot pilot_;
  std::optional<mauve::ToFrame> to_map_;  // the frame of goals
  std::uint32_t goal_number_{0};          // of the action's present goal; 0: none
  bool has_place_{false};
  Point place_;                                                  // of that goal, in the map
  Point moved_from_;                                             // where the robot was
  mauve::time_ns_t moved_ns_{0};                                 // then
  double tolerance_m_{std::numeric_limits<double>::infinity()};  // of that goal
  std::unique_ptr<Scan> scan_;
};

}  // namespace mauve_examples
