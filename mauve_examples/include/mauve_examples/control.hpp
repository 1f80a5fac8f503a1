// SPDX-License-Identifier: LGPL-3.0-or-later
// Control: a PID controller that drives the robot to a target and into no other robot, 50 Hz.
#pragma once

#include <memory>

#include "mauve_rt/mauve_rt.hpp"

#include "mauve_examples/point_controller.hpp"
#include "mauve_examples/types.hpp"

namespace mauve_examples {

struct ControlShell : mauve::Shell {
  mauve::Property<double>& max_speed =
      property("max_speed", 1.0, {.unit = "m/s", .description = "", .minimum = 0.0, .maximum = 5.0});
  mauve::Property<double>& heading_gain =
      property("heading_gain", 4.0, {.unit = "1/s", .description = "", .minimum = 0.0, .maximum = 50.0});
  mauve::Property<double>& distance_gain =
      property("distance_gain", 2.0, {.unit = "1/s", .description = "", .minimum = 0.0, .maximum = 50.0});

  mauve::ReadPort<Pose2D>& pose = read_port<Pose2D>("pose");
  mauve::ReadPort<Point>& target = read_port<Point>("target");
  mauve::ReadPort<Scan>& scan = read_port<Scan>("scan").optional();  // without one it goes blind
  mauve::WritePort<Twist>& command =
      write_port<Twist>("command");  // zero when stopped: the robot stands still
};

class ControlCore : public mauve::Core<ControlShell> {
 public:
  /// Commands the velocity for the next period; none before there is a target. [rt]
  void control();

 protected:
  bool configure_hook() override;

 private:
  PointController controller_;
  std::unique_ptr<Scan> scan_;
};

struct ControlFsm : mauve::Fsm<ControlShell, ControlCore> {
  void define() override;
};

}  // namespace mauve_examples
