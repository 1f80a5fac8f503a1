// SPDX-License-Identifier: LGPL-3.0-or-later
// Who goes where: the frontier a robot takes, given its own bids and what its peers bid and claim.
#pragma once

#include <cstddef>
#include <optional>

#include "mauve_examples/frontiers.hpp"
#include "mauve_examples/peer_table.hpp"

namespace mauve_examples {

struct AuctionOptions {
  double claim_radius_m{2.0};  // frontiers nearer than this to a claim are the claimer's
  double undercut_share{
      0.5};  // unless reaching it costs another robot less than this share of what is left to the claimer
  double repulsion_m{8.0};       // up to here a claim makes frontiers dearer
  double repulsion_cost_m{6.0};  // by so much beside it, by less farther away
};

/// Every robot that bids gets one frontier: again and again the lowest of all bids wins (equal ones by name),
/// and what lies near the won frontier is no longer to be had. Robots that know the same bids come to the
/// same result, so none needs to tell another what it has won. Returns which of `own` the robot takes, or
/// none when the others get all. [rt] Source: sequential single-item auctions, M. Lagoudakis et al.,
/// "Auction-Based Multi-Robot Routing", RSS 2005.
std::optional<std::size_t> bid_together(const FrontierList& own, const PeerTable& peers,
                                        const AuctionOptions& options) noexcept;

/// Whether a peer has undercut the robot's claim: it was that much nearer, and the claim is to be dropped.
/// [rt]
bool is_undercut(const Bid& own, const PeerTable& peers, const AuctionOptions& options) noexcept;

/// The frontier a robot takes when nobody answers: the cheapest, those near the peers' last claims made
/// dearer. [rt]
std::optional<std::size_t> choose_alone(const FrontierList& own, const PeerTable& peers,
                                        const AuctionOptions& options) noexcept;

}  // namespace mauve_examples
