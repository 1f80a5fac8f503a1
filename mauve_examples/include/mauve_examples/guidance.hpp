// SPDX-License-Identifier: LGPL-3.0-or-later
// Guidance: plans a path to the goal and hands its points to the controller.
#pragma once

#include <memory>
#include <optional>

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
  void read_goals();
  bool read_operator_goal();
  void write_target();

  Pilot pilot_;
  std::optional<mauve::TransformedReadPort<PoseStamped>> operator_goal_;  // in the frame of goals
  mauve::time_ns_t operator_goal_ns_{0};                                  // when the last one came
  mauve::time_ns_t has_path_ns_{0};  // when there was a path to that goal
  bool is_operated_{false};          // on its way to that goal
  std::unique_ptr<Scan> scan_;
};

}  // namespace mauve_examples
