// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_examples/mapping.hpp"

#include "mauve_examples/map_file.hpp"
#include "mauve_examples/scan_integration.hpp"

namespace mauve_examples {

bool Mapping::configure_hook() {
  const GridMap world = load_map(shell().map.value());
  shell().map_update([&world](OccupancyGrid& map) {
    // What was drawn before remains, unless it was of another world.
    if (map.geometry() != world) map.configure(world);
  });
  scan_ = std::make_unique<Scan>();
  update_ = std::make_unique<MapUpdate>();
  update_->resolution = world.resolution_m;
  update_->origin_x = world.origin_x_m;
  update_->origin_y = world.origin_y_m;
  update_->columns = static_cast<std::uint16_t>(world.tile_columns());
  update_->rows = static_cast<std::uint16_t>(world.tile_rows());
  changes_.configure(world.tile_count());
  return true;
}

bool Mapping::read_scan_and_its_pose() {
  // Equal writer's times: the scan was taken at this pose, and not at the one before or after. On another CPU
  // than the robot's both are read at the very instant they are written, so a pair that does not match is
  // common: the next does.
  constexpr int kAttempts = 10;
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    mauve::time_ns_t scan_time_ns = 0;
    if (shell().scan.read(*scan_, &scan_time_ns) == mauve::DataStatus::none) return false;
    const mauve::Sample<Pose2D> pose = shell().pose.read();
    pose_ = pose.value;
    if (pose.time_ns == scan_time_ns) return true;
  }
  return false;
}

void Mapping::integrate() {
  const bool has_scan = read_scan_and_its_pose();
  shell().map_update([&](OccupancyGrid& map) {
    if (has_scan) integrate_scan(*scan_, pose_, map);
    update_->tiles.clear();
    changes_.collect(map, [&](std::size_t tile) {
      TileList& tiles = update_->tiles;
      if (!tiles.resize(tiles.size() + 1)) return false;
      map.copy_tile(tile, tiles[tiles.size() - 1]);
      return true;
    });
  });
  if (update_->tiles.empty()) return;
  update_->stamp_ns = clock_ns();
  if (shell().map_updates.write(*update_)) return;
  for (const MapTile& tile : update_->tiles) {  // no room for them: they are to be told yet
    changes_.forget(static_cast<std::size_t>(tile.row) * update_->columns + tile.column);
  }
}

}  // namespace mauve_examples
