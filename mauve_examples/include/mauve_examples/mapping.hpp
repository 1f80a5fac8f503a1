// SPDX-License-Identifier: LGPL-3.0-or-later
// Mapping: makes the robot's own map from scans and poses, 10 Hz.
#pragma once

#include <memory>

#include "mauve_examples/changed_tiles.hpp"
#include "mauve_examples/model/mapping_core.hpp"
#include "mauve_examples/occupancy_map.hpp"
#include "mauve_examples/types.hpp"

namespace mauve_examples {

class Mapping final : public MappingCore {
 public:
  /// Adds the newest scan to the map and tells what changed. [rt]
  void integrate() override;

 protected:
  bool configure_hook() override;

 private:
  bool read_scan_and_its_pose();

  Pose2D pose_;
  std::unique_ptr<Scan> scan_;
  std::unique_ptr<MapUpdate> update_;
  ChangedTiles changes_;  // since they were last told
};

}  // namespace mauve_examples
