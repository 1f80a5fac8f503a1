// SPDX-License-Identifier: LGPL-3.0-or-later
// The mission's data: plain structs, each declaring once which ROS message it is. Units: m, rad, m/s, rad/s,
// ns.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "mauve_rt/data/bounded.hpp"
#include "mauve_rt/data/cdr.hpp"
#include "mauve_rt/elements/types.hpp"

namespace mauve_examples {

using mauve::types::Bool;
using mauve::types::Point;
using mauve::types::Pose2D;
using mauve::types::Twist;
using mauve::types::Vector3;

inline constexpr std::size_t kBeamCount = 360;

/// One turn of the range finder: beam i points i degrees left of the robot's heading.
struct Scan {
  float max_range_m{0.0F};
  std::array<float, kBeamCount> ranges_m{};  // infinity: nothing within max_range_m
  std::array<std::uint8_t, kBeamCount>
      robots{};  // number of the robot the beam ended at; 0: at something else
};

/// Where a robot's body is.
struct RobotBody {
  std::uint8_t number{0};  // what is written on it; from 1
  double x{0.0};
  double y{0.0};
  double radius_m{0.0};
};

inline constexpr int kTileSide = 16;
inline constexpr std::size_t kTileCells = std::size_t{kTileSide} * kTileSide;

/// A square of cells of an occupancy map, row by row from its lowest x and y.
struct MapTile {
  std::uint16_t column{0};
  std::uint16_t row{0};
  std::uint32_t revision{0};
  std::array<std::int8_t, kTileCells> cells{};
};

inline constexpr std::size_t kMaxTilesPerMessage = 64;

using TileList = mauve::BoundedVector<MapTile, kMaxTilesPerMessage>;

/// Tiles as runs of equal cells, one tile after the other; see PeerMessage.msg and tile_runs.hpp.
using TileRuns = mauve::BoundedVector<std::uint8_t, 16384>;

/// Tiles of a robot's own map that changed.
struct MapUpdate {
  std::int64_t stamp_ns{0};
  double resolution_m{0.0};
  double origin_x_m{0.0};
  double origin_y_m{0.0};
  std::uint16_t columns{0};
  std::uint16_t rows{0};
  TileList tiles;
};

/// What reaching a frontier would cost the robot that bids.
struct Bid {
  double x{0.0};
  double y{0.0};
  double cost_m{0.0};
};

using RobotName = mauve::BoundedString<32>;

/// The last message received from a peer, and the round of its that is answered.
struct PeerAck {
  RobotName peer;
  std::uint32_t sequence{0};
  std::uint32_t round{0};
  std::uint32_t map_batch{0};
};

inline constexpr std::size_t kMaxBids = 16;
inline constexpr std::size_t kMaxPeers = 8;

/// The exploring robots' talk: bids, claims, answers and map updates in one message.
struct PeerMessage {
  RobotName sender;
  std::uint32_t sequence{0};
  std::uint32_t round{0};
  mauve::BoundedVector<Bid, kMaxBids> bids;
  bool has_claim{false};
  Bid claim;
  mauve::BoundedVector<PeerAck, kMaxPeers> acks;
  double x{0.0};
  double y{0.0};
  std::uint32_t map_batch{0};
  double resolution_m{0.0};
  double origin_x_m{0.0};
  double origin_y_m{0.0};
  TileList tiles;  // none any more: see map_runs
  TileRuns map_runs;
};

}  // namespace mauve_examples

MAUVE_TYPE(mauve_examples::Scan, "mauve_examples/Scan", max_range_m, ranges_m, robots)
MAUVE_TYPE(mauve_examples::RobotBody, "mauve_msgs/msg/RobotBody", number, x, y, radius_m)
MAUVE_TYPE(mauve_examples::MapTile, "mauve_msgs/msg/MapTile", column, row, revision, cells)
MAUVE_TYPE(mauve_examples::MapUpdate, "mauve_msgs/msg/MapUpdate", stamp_ns, resolution_m, origin_x_m,
           origin_y_m, columns, rows, tiles)
MAUVE_TYPE(mauve_examples::Bid, "mauve_msgs/msg/Bid", x, y, cost_m)
MAUVE_TYPE(mauve_examples::PeerAck, "mauve_msgs/msg/PeerAck", peer, sequence, round, map_batch)
MAUVE_TYPE(mauve_examples::PeerMessage, "mauve_msgs/msg/PeerMessage", sender, sequence, round, bids,
           has_claim, claim, acks, x, y, map_batch, resolution_m, origin_x_m, origin_y_m, tiles, map_runs)
