// SPDX-License-Identifier: LGPL-3.0-or-later
// The mission's data: structs generated from the messages of mauve_msgs, and one of its own. Units: m, rad, m/s, rad/s, ns.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <tuple>

#include "mauve_rt/data/bounded.hpp"
#include "mauve_rt/data/cdr.hpp"
#include "mauve_rt/elements/types.hpp"

#include "mauve_types/geometry_msgs/msg/pose_stamped.hpp"
#include "mauve_types/mauve_msgs/action/drive_to.hpp"
#include "mauve_types/mauve_msgs/msg/map_update.hpp"
#include "mauve_types/mauve_msgs/msg/peer_message.hpp"
#include "mauve_types/mauve_msgs/msg/robot_body.hpp"

namespace mauve_examples {

using mauve::msg::geometry_msgs::PoseStamped;
using mauve::msg::mauve_msgs::Bid;
using mauve::msg::mauve_msgs::DriveTo;
using mauve::msg::mauve_msgs::MapTile;
using mauve::msg::mauve_msgs::MapUpdate;
using mauve::msg::mauve_msgs::PeerAck;
using mauve::msg::mauve_msgs::PeerMessage;
using mauve::msg::mauve_msgs::RobotBody;
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

// What the messages hold at most, as their definitions say.

inline constexpr int kTileSide = 16;
inline constexpr std::size_t kTileCells = std::size_t{kTileSide} * kTileSide;
static_assert(std::tuple_size_v<decltype(MapTile::cells)> == kTileCells);

using TileList = decltype(MapUpdate::tiles);
/// Tiles as runs of equal cells, one tile after the other; see PeerMessage.msg and tile_runs.hpp.
using TileRuns = decltype(PeerMessage::map_runs);
using RobotName = decltype(PeerMessage::sender);

inline constexpr std::size_t kMaxBids = decltype(PeerMessage::bids)::capacity();
inline constexpr std::size_t kMaxPeers = decltype(PeerMessage::acks)::capacity();

}  // namespace mauve_examples

MAUVE_TYPE(mauve_examples::Scan, "mauve_examples/Scan", max_range_m, ranges_m, robots)
