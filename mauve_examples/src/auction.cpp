// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_examples/auction.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <span>
#include <string_view>

#include "mauve_examples/grid_geometry.hpp"

namespace mauve_examples {

namespace {

constexpr std::size_t kMaxRobots = kMaxPeers + 1;

struct Offer {
  Point at;
  double cost_m{0.0};
};

struct Bidder {
  std::string_view name;
  mauve::BoundedVector<Offer, kMaxBids> offers;
  bool served{false};
};

/// A place that a robot has taken, and for what cost another may still have it.
struct Place {
  Point at;
  double undercut_m{0.0};
};

using Taken = mauve::BoundedVector<Place, kMaxRobots>;

/// What the places taken add to the cost of one more.
double repulsion_m(const Point& at, const Point& taken, const AuctionOptions& options) noexcept {
  const double apart_m = distance_m(at, taken);
  if (apart_m >= options.repulsion_m) return 0.0;
  return options.repulsion_cost_m * (1.0 - apart_m / options.repulsion_m);
}

/// Infinity when the place is too near to one taken.
double price_m(const Offer& offer, const Taken& taken, const AuctionOptions& options) noexcept {
  double price = offer.cost_m;
  for (const Place& place : taken) {
    if (distance_m(offer.at, place.at) >= options.claim_radius_m) {
      price += repulsion_m(offer.at, place.at, options);
    } else if (offer.cost_m >= place.undercut_m) {
      return std::numeric_limits<double>::infinity();
    }
  }
  return price;
}

struct Winner {
  Bidder* bidder{nullptr};
  std::size_t offer{0};
  double price_m{std::numeric_limits<double>::infinity()};
};

Winner lowest(std::span<Bidder> bidders, const Taken& taken, const AuctionOptions& options) noexcept {
  Winner winner;
  for (Bidder& bidder : bidders) {
    if (bidder.served) continue;
    for (std::size_t i = 0; i < bidder.offers.size(); ++i) {
      const double price = price_m(bidder.offers[i], taken, options);
      const bool tie =
          price == winner.price_m && winner.bidder != nullptr && bidder.name < winner.bidder->name;
      if (price < winner.price_m || tie) winner = {&bidder, i, price};
    }
  }
  return winner;
}

}  // namespace

std::optional<std::size_t> bid_together(const FrontierList& own, const PeerTable& peers,
                                        const AuctionOptions& options) noexcept {
  std::array<Bidder, kMaxRobots> bidders;
  std::size_t count = 1;
  Taken taken;
  bidders[0].name = peers.own_name().view();
  for (const Frontier& frontier : own) bidders[0].offers.push_back({frontier.at, frontier.cost_m});
  for (const Peer& peer : peers.peers()) {
    if (peer.has_claim)
      taken.push_back({{peer.claim.x, peer.claim.y, 0.0}, options.undercut_share * peer.claim.cost});
    if (peer.has_claim || !peer.bidding) continue;
    Bidder& bidder = bidders[count++];
    bidder.name = peer.name.view();
    for (const Bid& bid : peer.bids) bidder.offers.push_back({{bid.x, bid.y, 0.0}, bid.cost});
  }
  for (std::size_t round = 0; round < count; ++round) {
    const Winner winner = lowest(std::span(bidders.data(), count), taken, options);
    if (winner.bidder == nullptr) return std::nullopt;
    if (winner.bidder == bidders.data()) return winner.offer;
    winner.bidder->served = true;
    taken.push_back({winner.bidder->offers[winner.offer].at, 0.0});
  }
  return std::nullopt;
}

bool is_undercut(const Bid& own, const PeerTable& peers, const AuctionOptions& options) noexcept {
  return std::any_of(peers.peers().begin(), peers.peers().end(), [&](const Peer& peer) {
    return peer.has_claim && distance_m(own, peer.claim) < options.claim_radius_m &&
           peer.claim.cost < options.undercut_share * own.cost;
  });
}

std::optional<std::size_t> choose_alone(const FrontierList& own, const PeerTable& peers,
                                        const AuctionOptions& options) noexcept {
  std::optional<std::size_t> best;
  double best_price_m = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < own.size(); ++i) {
    double price = own[i].cost_m;
    for (const Peer& peer : peers.peers()) {
      if (peer.has_claim) price += repulsion_m(own[i].at, {peer.claim.x, peer.claim.y, 0.0}, options);
    }
    if (price >= best_price_m) continue;
    best_price_m = price;
    best = i;
  }
  return best;
}

}  // namespace mauve_examples
