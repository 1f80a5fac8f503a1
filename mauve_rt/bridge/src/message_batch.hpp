// SPDX-License-Identifier: LGPL-3.0-or-later
// Messages of several topics as a bag stores them: records of an MCAP file, one behind the other.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "mauve_rt/base/time.hpp"

namespace mauve::bridge {

/// What became of the messages of one topic since its subscription.
struct ReceivedCounts {
  std::uint64_t received{0};     // taken from the middleware
  std::uint64_t lost_before{0};  // sent and never taken, as far as the middleware shows that
  std::uint64_t lost{0};         // of those received: they found no room
};

/// The messages of one channel in a packed batch.
struct ChannelPart {
  std::uint16_t channel{0};
  std::uint64_t first_ns{0};  // log times
  std::uint64_t last_ns{0};
  std::vector<std::byte> index;  // entries of a MessageIndex
};

/// What turns the times of a batch, CLOCK_MONOTONIC, into those of a bag.
struct BagClock {
  time_ns_t log_ahead_ns{0};
  time_ns_t publish_ahead_ns{0};
  time_ns_t earliest_log_ns{0};
};

/// For one thread at a time. All functions [non-rt].
class MessageBatch {
 public:
  /// Counts for so many topics.
  explicit MessageBatch(std::size_t topics) : counts(topics), sizes_(topics) {}

  /// Counts for a further topic; returns its number. Messages may be in the batch.
  std::size_t add_topic();
  /// What a message of so many bytes takes.
  static std::size_t room_for(std::size_t message_bytes) noexcept;
  void append(std::size_t topic, time_ns_t time_ns, std::span<const std::byte> message);
  /// Memory for so many bytes of records.
  void reserve(std::size_t bytes) { records_.reserve(bytes); }

  std::size_t bytes() const noexcept { return records_.size(); }
  /// Messages of each topic.
  const std::vector<std::uint64_t>& sizes() const noexcept { return sizes_; }

  /// Calls `look(time_ns, message)` for each message of a topic. Before pack().
  template <typename Look>
  void each(std::size_t topic, Look look) const {
    for (std::size_t at = 0; at < records_.size();) {
      const Record record = record_at(at);
      if (record.topic == topic) look(record.time_ns, record.message);
      at += room_for(record.message.size());
    }
  }
  /// Completes the records for a place in a chunk: the channel of each topic, 0 leaves its messages out. Once.
  std::vector<ChannelPart> pack(const std::vector<std::uint16_t>& channels, const BagClock& clock,
                                std::uint64_t offset);
  /// After pack().
  std::span<const std::byte> records() const noexcept { return records_; }

  std::vector<ReceivedCounts> counts;  // by topic, all since its subscription

 private:
  struct Record {
    std::size_t topic;
    time_ns_t time_ns;
    std::span<const std::byte> message;
  };
  Record record_at(std::size_t at) const;

  std::vector<std::byte> records_;
  std::vector<std::uint64_t> sizes_;
};

}  // namespace mauve::bridge
