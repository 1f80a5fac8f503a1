// SPDX-License-Identifier: LGPL-3.0-or-later
#include "message_batch.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>

#include "mauve_rt/base/contract.hpp"

namespace mauve::bridge {

namespace {

static_assert(std::endian::native == std::endian::little, "MCAP is little-endian");

// A message record of https://mcap.dev/spec: opcode, length, channel, sequence, log time, publish time, then the data.
// Until it is packed, the number of the topic and its time are in place of channel and log time.
constexpr std::byte kOpcode{0x05};
constexpr std::size_t kLengthAt = 1;
constexpr std::size_t kChannelAt = 9;
constexpr std::size_t kLogTimeAt = 15;
constexpr std::size_t kPublishTimeAt = 23;
constexpr std::size_t kHead = 31;
constexpr std::size_t kBeforeLengthCounts = 9;

template <typename Number>
void put(std::byte* at, Number number) {
  std::memcpy(at, &number, sizeof number);
}

template <typename Number>
Number get(const std::byte* at) {
  Number number{};
  std::memcpy(&number, at, sizeof number);
  return number;
}

void add_entry(ChannelPart& part, std::uint64_t log_ns, std::uint64_t offset) {
  part.first_ns = part.index.empty() ? log_ns : std::min(part.first_ns, log_ns);
  part.last_ns = std::max(part.last_ns, log_ns);
  const std::array entry{log_ns, offset};
  const auto bytes = std::as_bytes(std::span(entry));
  part.index.insert(part.index.end(), bytes.begin(), bytes.end());
}

}  // namespace

std::size_t MessageBatch::add_topic() {
  counts.emplace_back();
  sizes_.push_back(0);
  return sizes_.size() - 1;
}

std::size_t MessageBatch::room_for(std::size_t message_bytes) noexcept { return kHead + message_bytes; }

void MessageBatch::append(std::size_t topic, time_ns_t time_ns, std::span<const std::byte> message) {
  std::array<std::byte, kHead> head{kOpcode};
  put(&head[kLengthAt], static_cast<std::uint64_t>(kHead - kBeforeLengthCounts + message.size()));
  put(&head[kChannelAt], static_cast<std::uint16_t>(topic));
  put(&head[kLogTimeAt], time_ns);
  records_.insert(records_.end(), head.begin(), head.end());
  records_.insert(records_.end(), message.begin(), message.end());
  ++sizes_[topic];
}

MessageBatch::Record MessageBatch::record_at(std::size_t at) const {
  const std::byte* const head = &records_[at];
  const std::size_t size = get<std::uint64_t>(head + kLengthAt) + kBeforeLengthCounts - kHead;
  return {.topic = get<std::uint16_t>(head + kChannelAt),
          .time_ns = get<time_ns_t>(head + kLogTimeAt),
          .message = {head + kHead, size}};
}

std::vector<ChannelPart> MessageBatch::pack(const std::vector<std::uint16_t>& channels, const BagClock& clock,
                                            std::uint64_t offset) {
  MAUVE_EXPECTS(channels.size() == sizes_.size());
  std::vector<ChannelPart> parts(channels.size());
  std::size_t end = 0;  // of what stays
  for (std::size_t at = 0; at < records_.size();) {
    const Record record = record_at(at);
    const std::size_t size = room_for(record.message.size());
    if (const std::uint16_t channel = channels[record.topic]; channel != 0) {
      const time_ns_t log_ns = std::max(record.time_ns + clock.log_ahead_ns, clock.earliest_log_ns);
      if (end != at) std::memmove(&records_[end], &records_[at], size);
      std::byte* const head = &records_[end];
      put(head + kChannelAt, channel);
      put(head + kLogTimeAt, log_ns);
      put(head + kPublishTimeAt, record.time_ns + clock.publish_ahead_ns);
      parts[record.topic].channel = channel;
      add_entry(parts[record.topic], static_cast<std::uint64_t>(log_ns), offset + end);
      end += size;
    }
    at += size;
  }
  records_.resize(end);
  std::erase_if(parts, [](const ChannelPart& part) { return part.index.empty(); });
  return parts;
}

}  // namespace mauve::bridge
