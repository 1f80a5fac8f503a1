// SPDX-License-Identifier: LGPL-3.0-or-later
// What a robot has last heard of each of its peers, and what they have of it.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "mauve_examples/types.hpp"

namespace mauve_examples {

/// A peer as of its last message; all zero before the first.
struct Peer {
  RobotName name;
  std::uint32_t sequence{0};        // of its last message
  std::uint32_t highest_round{0};   // the highest bidding round of its that was seen
  std::uint32_t merged_batch{0};    // the last batch of its tiles that was merged
  std::uint32_t answered_round{0};  // the highest of our rounds that it has answered
  std::uint32_t acked_batch{0};     // the last of our batches that it has merged
  bool bidding{false};
  mauve::BoundedVector<Bid, kMaxBids> bids;  // of its open round
  bool has_claim{false};
  Bid claim;
};

/// Messages of one peer are taken to arrive in the order they were sent, some of them or none: a sequence
/// number lower than the last one means that the peer has started anew. Not thread-safe; memory is allocated
/// by configure alone.
class PeerTable {
 public:
  enum class Received : std::uint8_t { news, repeated, stranger, restarted };

  /// Names the robot and its peers, at most kMaxPeers. [setup]
  void configure(std::string_view own_name, const std::vector<std::string>& peers);

  /// Notes what the message says; `own_sequence` is the last sequence number this robot has sent. [rt]
  Received receive(const PeerMessage& message, std::uint32_t own_sequence) noexcept;
  /// The peer of that name or null. [rt]
  Peer* find(std::string_view name) noexcept;

  /// Whether every peer has answered the round; true without peers. [rt]
  bool all_answered(std::uint32_t round) const noexcept;
  /// Whether every peer has merged the batch; true without peers. [rt]
  bool all_merged(std::uint32_t batch) const noexcept;
  /// Writes what was last received of each peer. [rt]
  void write_acks(PeerMessage& message) const noexcept;

  const RobotName& own_name() const noexcept { return own_name_; }
  std::span<const Peer> peers() const noexcept { return peers_; }

 private:
  RobotName own_name_;
  std::vector<Peer> peers_;
};

}  // namespace mauve_examples
