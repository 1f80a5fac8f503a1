// SPDX-License-Identifier: LGPL-3.0-or-later
// Mapping: makes the robot's own map from scans and poses, 10 Hz.
#pragma once

#include <memory>

#include "mauve_examples/changed_tiles.hpp"
#include "mauve_examples/occupancy_map.hpp"
#include "mauve_examples/types.hpp"

namespace mauve_examples {

struct MappingShell : mauve::Shell {
  mauve::Property<std::string>& map = property(
      "map", "", {.description = "YAML file: how large the world is", .structural = mauve::ReadBy::core});

  mauve::ReadPort<Pose2D>& pose = read_port<Pose2D>("pose");
  mauve::ReadPort<Scan>& scan = read_port<Scan>("scan");
  mauve::CallPort<void(MapWriter)>& map_update = call_port<void(MapWriter)>("map_update", kMapWriterType);
  mauve::WritePort<MapUpdate>& map_updates = write_port<MapUpdate>(
      "map_updates", {.on_commit = mauve::OutputPolicy::hold, .on_stop = mauve::OutputPolicy::hold});
};

class MappingCore : public mauve::Core<MappingShell> {
 public:
  /// Adds the newest scan to the map and tells what changed. [rt]
  void integrate();

 protected:
  bool configure_hook() override;

 private:
  bool read_scan_and_its_pose();

  Pose2D pose_;
  std::unique_ptr<Scan> scan_;
  std::unique_ptr<MapUpdate> update_;
  ChangedTiles changes_;  // since they were last told
};

struct MappingFsm : mauve::Fsm<MappingShell, MappingCore> {
  void define() override;
};

}  // namespace mauve_examples
