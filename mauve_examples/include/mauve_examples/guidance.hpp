// SPDX-License-Identifier: LGPL-3.0-or-later
// Guidance: plans a path to the goal and hands its points to the controller; the clock-based FSM of the
// paper's Fig. 4.
#pragma once

#include <memory>

#include "mauve_examples/occupancy_map.hpp"
#include "mauve_examples/pilot.hpp"

namespace mauve_examples {

/// Listing 1 of the paper, and the map.
struct GuidanceShell : mauve::Shell {
  mauve::Property<double>& target_threshold = property(
      "target_threshold", 0.5,
      {.unit = "m", .description = "nearer than this a point is reached", .minimum = 0.05, .maximum = 5.0});
  mauve::Property<double>& path_step =
      property("path_step", 1.0,
               {.unit = "m", .description = "between points of the path", .minimum = 0.1, .maximum = 20.0});
  mauve::Property<std::string>& map = property(
      "map", "", {.description = "YAML file: how large the world is", .structural = mauve::ReadBy::core});
  mauve::Property<std::int64_t>& unit_ms = property("unit_ms", 100,
                                                    {.unit = "ms",
                                                     .description = "of the waits: 1, 2 and 5 units",
                                                     .minimum = 1,
                                                     .maximum = 10000,
                                                     .structural = mauve::ReadBy::fsm});
  mauve::Property<std::int64_t>& number = property("number", 1,
                                                   {.unit = "",
                                                    .description = "of this robot: lower ones go first",
                                                    .minimum = 1,
                                                    .maximum = 16,
                                                    .structural = mauve::ReadBy::core});

  mauve::ReadPort<Pose2D>& pose = read_port<Pose2D>("pose");
  mauve::ReadPort<Scan>& scan = read_port<Scan>("scan");
  mauve::ReadPort<Point>& goal = read_port<Point>("goal");
  mauve::WritePort<Point>& target = write_port<Point>(
      "target", {.on_commit = mauve::OutputPolicy::hold, .on_stop = mauve::OutputPolicy::hold});
  mauve::CallPort<void(MapReader)>& map_get = call_port<void(MapReader)>("map_get", kMapReaderType);
};

/// Listing 2 of the paper.
class GuidanceCore : public mauve::Core<GuidanceShell> {
 public:
  /// Idle: reads position and goal, and looks at the map and at who is in sight. [rt]
  void read_inputs();
  /// A goal that no path was planned to yet, or whose path has become impassable, or room to be made. [rt]
  bool has_new_goal() const;
  bool has_path() const;
  /// Planning. [rt]
  void compute_path();
  /// Following. [rt]
  void follow_path();

 protected:
  bool configure_hook() override;

 private:
  void write_target();

  Pilot pilot_;
  std::unique_ptr<Scan> scan_;
};

/// Idle, Planning and Following; the waits make I-P-I, I-F-I and I-I take 5, 2 and 1 units.
struct GuidanceFsm : mauve::Fsm<GuidanceShell, GuidanceCore> {
  void define() override;
};

}  // namespace mauve_examples
