// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_examples/explorer.hpp"

#include <algorithm>

#include "mauve_examples/tile_runs.hpp"

namespace mauve_examples {

void Explorer::configure(const GridGeometry& geometry, std::string_view name,
                         const std::vector<std::string>& peers, const ExplorerOptions& options) {
  map_.configure(geometry);
  finder_.configure(geometry, options.frontiers);
  peers_.configure(name, peers);
  sender_.configure(geometry.tile_count());
  goal_ = GoalWatch{};
  goal_.set_options(options.goal);
  auction_ = options.auction;
  candidates_.clear();
  done_ = false;
  round_open_ = false;
  round_ = 0;
  sequence_ = 0;
}

void Explorer::set_options(const GoalOptions& goal, const AuctionOptions& auction) noexcept {
  goal_.set_options(goal);
  auction_ = auction;
}

bool Explorer::is_like(const Explorer& other) const noexcept {
  const auto mine = peers_.peers();
  const auto theirs = other.peers_.peers();
  return geometry() == other.geometry() && peers_.own_name() == other.peers_.own_name() &&
         std::equal(mine.begin(), mine.end(), theirs.begin(), theirs.end(),
                    [](const Peer& a, const Peer& b) { return a.name == b.name; });
}

void Explorer::receive(const PeerMessage& message) noexcept {
  const PeerTable::Received received = peers_.receive(message, sequence_);
  if (received == PeerTable::Received::stranger || received == PeerTable::Received::repeated) return;
  if (received == PeerTable::Received::restarted) sender_.forget();
  Peer& peer = *peers_.find(message.sender.view());
  if (message.map_batch == 0 || message.map_batch == peer.merged_batch) return;
  const GridGeometry& grid = geometry();
  const bool same_grid = message.resolution == grid.resolution_m && message.origin_x == grid.origin_x_m &&
                         message.origin_y == grid.origin_y_m;
  // Tiles of another grid mean nothing here, but its sender shall not wait for them for ever.
  peer.merged_batch = message.map_batch;
  if (!same_grid) return;
  MapTile tile;
  for (std::size_t position = 0; read_tile(message.map_runs, position, tile);) map_.merge(tile);
}

void Explorer::look(const Pose2D& robot, std::int64_t now_ns) noexcept {
  robot_ = robot;
  finder_.find(map_.cells(), {robot.x, robot.y, 0.0});
  goal_.update(finder_, robot, now_ns);
  candidates_.clear();
  for (const Frontier& frontier : finder_.list()) {
    if (!goal_.given_up(frontier.at, now_ns)) candidates_.push_back(frontier);
  }
  done_ = finder_.has_view() && candidates_.empty() && !goal_.active();
}

bool Explorer::decide_together(std::int64_t now_ns) noexcept {
  if (goal_.active() && is_undercut(claim(), peers_, auction_)) goal_.drop();
  if (goal_.active() || candidates_.empty()) {
    round_open_ = false;
    return false;
  }
  if (!round_open_) {
    round_open_ = true;
    ++round_;
  }
  if (!peers_.all_answered(round_)) return false;
  round_open_ = false;
  const auto choice = bid_together(candidates_, peers_, auction_);
  if (!choice) return follow_peers();
  goal_.set(candidates_[*choice], now_ns);
  return go_to(goal_.goal());
}

bool Explorer::decide_alone(std::int64_t now_ns) noexcept {
  round_open_ = false;
  if (goal_.active()) return false;
  const auto choice = choose_alone(candidates_, peers_, auction_);
  if (!choice) return false;
  goal_.set(candidates_[*choice], now_ns);
  return go_to(goal_.goal());
}

bool Explorer::go_to(const Point& place) noexcept {
  destination_ = place;
  has_destination_ = true;
  return true;
}

bool Explorer::follow_peers() noexcept {
  // Another destination only when it is another place: every new one makes guidance plan anew.
  constexpr double kSamePlace_m = 2.0;
  const auto choice = choose_alone(candidates_, peers_, auction_);
  if (!choice) return false;
  const Point& place = candidates_[*choice].at;
  if (has_destination_ && distance_m(place, destination_) < kSamePlace_m) return false;
  return go_to(place);
}

void Explorer::compose(PeerMessage& message) noexcept {
  if (sender_.batch() != 0 && peers_.all_merged(sender_.batch())) sender_.confirm();
  if (!peers_.peers().empty()) sender_.start(map_);

  message.sender = peers_.own_name();
  message.sequence = ++sequence_;
  message.round = round();
  message.bids.clear();
  if (round_open_) {
    for (const Frontier& frontier : candidates_)
      message.bids.push_back({frontier.at.x, frontier.at.y, frontier.cost_m});
  }
  message.has_claim = goal_.active();
  message.claim = goal_.active() ? claim() : Bid{};
  peers_.write_acks(message);
  message.x = robot_.x;
  message.y = robot_.y;
  message.map_batch = sender_.batch();
  message.resolution = geometry().resolution_m;
  message.origin_x = geometry().origin_x_m;
  message.origin_y = geometry().origin_y_m;
  message.tiles.clear();
  message.map_runs = sender_.runs();
}

}  // namespace mauve_examples
