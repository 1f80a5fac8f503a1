// SPDX-License-Identifier: LGPL-3.0-or-later
// Control: a PID controller that drives the robot to a target and into no other robot, 50 Hz.
#pragma once

#include <memory>

#include "mauve_examples/model/control_core.hpp"
#include "mauve_examples/point_controller.hpp"
#include "mauve_examples/types.hpp"

namespace mauve_examples {

class Control final : public ControlCore {
 public:
  /// Commands the velocity for the next period; none before there is a target. [rt]
  void control() override;

 protected:
  bool configure_hook() override;

 private:
  PointController controller_;
  std::unique_ptr<Scan> scan_;
};

}  // namespace mauve_examples
