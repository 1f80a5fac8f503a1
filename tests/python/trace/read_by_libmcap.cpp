// SPDX-License-Identifier: LGPL-3.0-or-later
// read_by_libmcap FILE: prints each topic of an MCAP file and how many messages of it libmcap, rosbag2's reader, gives. It
// reads as rosbag2 does: by the summary, in the order of log time; then once more from begin to end.
#define MCAP_IMPLEMENTATION
#define MCAP_COMPRESSION_NO_LZ4
#define MCAP_COMPRESSION_NO_ZSTD
#include <cstdio>
#include <map>
#include <string>

#include <mcap/reader.hpp>

namespace {

int problems = 0;

void report(const mcap::Status& status) {
  if (status.ok()) return;
  ++problems;
  std::fprintf(stderr, "%s\n", status.message.c_str());
}

using Counts = std::map<std::string, unsigned long>;

Counts by_index(mcap::McapReader& reader) {
  Counts counts;
  report(reader.readSummary(mcap::ReadSummaryMethod::NoFallbackScan));
  mcap::ReadMessageOptions options;
  options.readOrder = mcap::ReadMessageOptions::ReadOrder::LogTimeOrder;
  for (const auto& view : reader.readMessages(report, options)) ++counts[view.channel->topic];
  return counts;
}

Counts from_begin(mcap::McapReader& reader) {
  Counts counts;
  mcap::TypedRecordReader records(*reader.dataSource(), sizeof(mcap::Magic));
  std::map<mcap::ChannelId, std::string> topics;
  records.onChannel = [&](const mcap::ChannelPtr channel, mcap::ByteOffset, std::optional<mcap::ByteOffset>) {
    topics[channel->id] = channel->topic;
  };
  records.onMessage = [&](const mcap::Message& message, mcap::ByteOffset, std::optional<mcap::ByteOffset>) {
    ++counts[topics[message.channelId]];
  };
  while (records.next()) report(records.status());
  return counts;
}

}  // namespace

int main(int count, char** arguments) {
  mcap::McapReader reader;
  if (count != 2) return 2;
  report(reader.open(arguments[1]));
  if (problems != 0) return 1;
  const Counts counts = by_index(reader);
  if (counts != from_begin(reader)) {
    std::fprintf(stderr, "the summary leads to other messages than the file holds\n");
    ++problems;
  }
  for (const auto& [topic, messages] : counts) std::printf("%s %lu\n", topic.c_str(), messages);
  return problems == 0 ? 0 : 1;
}
