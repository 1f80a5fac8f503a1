// SPDX-License-Identifier: LGPL-3.0-or-later
// Robot: the simulated body. Velocity commands in, pose and scan out, 100 Hz; tells the other bodies where it is.
#pragma once

#include <memory>

#include "mauve_rt/mauve_rt.hpp"

#include "mauve_examples/map_file.hpp"
#include "mauve_examples/types.hpp"
#include "mauve_examples/unicycle.hpp"

namespace mauve_examples {

inline constexpr std::size_t kMaxOthers = 15;

struct RobotShell : mauve::Shell {
  mauve::Property<std::string>& map = property(
      "map", "",
      {.description = "YAML file of the world the robot moves in", .structural = mauve::ReadBy::core});
  mauve::Property<double>& start_x =
      property("start_x", 0.0, {.unit = "m", .structural = mauve::ReadBy::core});
  mauve::Property<double>& start_y =
      property("start_y", 0.0, {.unit = "m", .structural = mauve::ReadBy::core});
  mauve::Property<double>& start_yaw =
      property("start_yaw", 0.0, {.unit = "rad", .structural = mauve::ReadBy::core});
  mauve::Property<double>& radius =
      property("radius", 0.2, {.unit = "m", .description = "", .minimum = 0.05, .maximum = 1.0});
  mauve::Property<std::int64_t>& number = property(
      "number", 1, {.unit = "", .description = "by which other robots know it", .minimum = 1, .maximum = 16});
  mauve::Property<double>& max_speed =
      property("max_speed", 1.0, {.unit = "m/s", .description = "", .minimum = 0.0, .maximum = 5.0});
  mauve::Property<double>& max_range = property(
      "max_range", 5.0, {.unit = "m", .description = "of the range finder", .minimum = 0.5, .maximum = 30.0});
  mauve::Property<double>& command_timeout =
      property("command_timeout", 0.2,
               {.unit = "s",
                .description = "a command older than this counts for nothing",
                .minimum = 0.02,
                .maximum = 5.0});

  mauve::ReadPort<Twist>& command = read_port<Twist>("command");
  mauve::ReadPort<RobotBody>& bodies = read_port<RobotBody>("bodies");
  mauve::WritePort<RobotBody>& body = write_port<RobotBody>(
      "body", {.on_commit = mauve::OutputPolicy::hold, .on_stop = mauve::OutputPolicy::hold});
  mauve::WritePort<Pose2D>& pose = write_port<Pose2D>(
      "pose", {.on_commit = mauve::OutputPolicy::hold, .on_stop = mauve::OutputPolicy::hold});
  mauve::WritePort<Scan>& scan = write_port<Scan>(
      "scan", {.on_commit = mauve::OutputPolicy::hold, .on_stop = mauve::OutputPolicy::hold});
};

class RobotCore : public mauve::Core<RobotShell> {
 public:
  /// Moves for one period, unless into something. [rt]
  void move();
  /// Looks around and tells where it is and what it sees. [rt]
  void sense();

  /// Another such core goes on from where the robot is. [rt]
  void take(mauve::CoreBase& old) noexcept override;

 protected:
  bool configure_hook() override;

 private:
  Twist command_in_force() const;
  void meet_others();

  GridMap world_;
  Unicycle body_;
  UnicycleLimits limits_;
  std::unique_ptr<Scan> scan_;
  std::unique_ptr<Scan> walls_;  // without robots: as before while this one stands
  Pose2D seen_from_;
  mauve::BoundedVector<RobotBody, kMaxOthers> others_;  // where they were when they last said so
  std::int64_t steps_{0};
  std::int64_t collisions_{0};
  std::uint32_t collision_mark_{0};
};

struct RobotFsm : mauve::Fsm<RobotShell, RobotCore> {
  void define() override;
};

}  // namespace mauve_examples
