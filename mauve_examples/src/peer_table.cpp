// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_examples/peer_table.hpp"

#include <algorithm>

namespace mauve_examples {

void PeerTable::configure(std::string_view own_name, const std::vector<std::string>& peers) {
  own_name_ = RobotName(own_name);
  peers_.assign(std::min(peers.size(), kMaxPeers), Peer{});
  for (std::size_t i = 0; i < peers_.size(); ++i) peers_[i].name = RobotName(peers[i]);
}

PeerTable::Received PeerTable::receive(const PeerMessage& message, std::uint32_t own_sequence) noexcept {
  Peer* peer = find(message.sender.view());
  if (peer == nullptr) return Received::stranger;
  if (message.sequence == peer->sequence) return Received::repeated;
  const bool restarted = message.sequence < peer->sequence;
  if (restarted) {
    const RobotName name = peer->name;
    *peer = Peer{};
    peer->name = name;
  }
  peer->sequence = message.sequence;
  peer->highest_round = std::max(peer->highest_round, message.round);
  peer->bidding = message.round != 0;
  peer->bids = message.bids;
  peer->has_claim = message.has_claim;
  peer->claim = message.claim;
  for (const PeerAck& ack : message.acks) {
    // An ack of what was never sent was meant for an earlier life of this robot.
    if (!(ack.peer == own_name_) || ack.sequence > own_sequence) continue;
    peer->answered_round = ack.round;
    peer->acked_batch = ack.map_batch;
  }
  return restarted ? Received::restarted : Received::news;
}

Peer* PeerTable::find(std::string_view name) noexcept {
  const auto found =
      std::find_if(peers_.begin(), peers_.end(), [&](const Peer& peer) { return peer.name == name; });
  return found == peers_.end() ? nullptr : &*found;
}

bool PeerTable::all_answered(std::uint32_t round) const noexcept {
  return std::all_of(peers_.begin(), peers_.end(),
                     [&](const Peer& peer) { return peer.answered_round >= round; });
}

bool PeerTable::all_merged(std::uint32_t batch) const noexcept {
  return std::all_of(peers_.begin(), peers_.end(),
                     [&](const Peer& peer) { return peer.acked_batch >= batch; });
}

void PeerTable::write_acks(PeerMessage& message) const noexcept {
  message.acks.clear();
  for (const Peer& peer : peers_) {
    message.acks.push_back({peer.name, peer.sequence, peer.highest_round, peer.merged_batch});
  }
}

}  // namespace mauve_examples
