// SPDX-License-Identifier: LGPL-3.0-or-later
// One robot's share of exploring together: what it knows, what it wants, what it tells its peers.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "mauve_examples/auction.hpp"
#include "mauve_examples/frontiers.hpp"
#include "mauve_examples/goal_watch.hpp"
#include "mauve_examples/merged_map.hpp"
#include "mauve_examples/peer_table.hpp"
#include "mauve_examples/tile_sender.hpp"

namespace mauve_examples {

struct ExplorerOptions {
  FrontierOptions frontiers;
  GoalOptions goal;
  AuctionOptions auction;
};

/// The bidding protocol. Each step a robot receives, looks, decides and composes one message; every message
/// carries its latest answers, so that lost ones cost time and nothing else.
///
/// A robot without a goal opens a *round* and sends its bids until every peer has answered that very round
/// (the highest round seen is in every message, also of robots that bid themselves or have nothing left to
/// explore, so two open rounds answer each other). Only then it takes a frontier. Without the peers' answers
/// it waits, for as long as it takes. When its peers have taken all there is, it follows them without a claim
/// and asks again: where they look, more opens up.
///
/// Not thread-safe; memory is allocated by configure alone.
class Explorer {
 public:
  /// Allocates. [setup]
  void configure(const GridGeometry& geometry, std::string_view name, const std::vector<std::string>& peers,
                 const ExplorerOptions& options);

  /// Changes how goals are judged and shared; the frontiers' options hold from configure on. [rt]
  void set_options(const GoalOptions& goal, const AuctionOptions& auction) noexcept;
  /// Whether this explorer may hand over to the other one: same map, same robots. [rt]
  bool is_like(const Explorer& other) const noexcept;

  /// Notes a peer's message and merges its tiles. [rt]
  void receive(const PeerMessage& message) noexcept;
  /// Takes over what changed on the robot's own map. [rt]
  void refresh(const OccupancyGrid& own) noexcept { map_.refresh(own); }
  /// Looks for frontiers and judges the goal. [rt]
  void look(const Pose2D& robot, std::int64_t now_ns) noexcept;
  /// Takes a goal with its peers; true when there is a new destination. [rt]
  bool decide_together(std::int64_t now_ns) noexcept;
  /// Takes a goal by itself; true when there is a new destination. [rt]
  bool decide_alone(std::int64_t now_ns) noexcept;
  /// The message of this step. [rt]
  void compose(PeerMessage& message) noexcept;

  const GridGeometry& geometry() const noexcept { return map_.geometry(); }
  const MergedMap& map() const noexcept { return map_; }
  const GoalWatch& goal() const noexcept { return goal_; }
  /// Where to go: the goal, or what the robot follows its peers to. [rt]
  const Point& destination() const noexcept { return destination_; }
  const PeerTable& peers() const noexcept { return peers_; }
  const FrontierList& frontiers() const noexcept { return candidates_; }
  /// Nothing is left to explore, as of the last look. [rt]
  bool done() const noexcept { return done_; }
  /// The open bidding round; 0: none. [rt]
  std::uint32_t round() const noexcept { return round_open_ ? round_ : 0; }

 private:
  Bid claim() const noexcept { return {goal_.goal().x, goal_.goal().y, goal_.remaining_m()}; }
  bool go_to(const Point& place) noexcept;
  bool follow_peers() noexcept;

  MergedMap map_;
  FrontierFinder finder_;
  PeerTable peers_;
  TileSender sender_;
  GoalWatch goal_;
  AuctionOptions auction_;
  FrontierList candidates_;  // frontiers that were not given up
  Pose2D robot_;
  Point destination_;
  bool has_destination_{false};
  bool done_{false};
  bool round_open_{false};
  std::uint32_t round_{0};
  std::uint32_t sequence_{0};
};

}  // namespace mauve_examples
