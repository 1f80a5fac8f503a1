// SPDX-License-Identifier: LGPL-3.0-or-later
// The value of a resource, polled and published: no component takes part in it.
#pragma once

#include <rcl/publisher.h>

#include <optional>
#include <string>
#include <vector>

#include "binding.hpp"
#include "flat_numbers.hpp"
#include "owned.hpp"
#include "topics.hpp"

namespace mauve::bridge {

/// What of the value is published, besides its topic.
struct MirrorSettings {
  time_ns_t period_ns;                 // the shortest time between two messages
  std::optional<FlatNumbers> numbers;  // none: the message as it is
  std::optional<std::size_t>
      number;  // only this one, as std_msgs/msg/Float64; else all, as mauve_msgs/msg/Values
};

/// Publishes the newest value of a resource when it is another one than the last. For one thread at a time.
class Mirror final : public BoundTopic {
 public:
  /// Throws Error when the type is not installed or rcl refuses. [non-rt]
  Mirror(rcl_node_t& node, const TopicSettings& topic, std::size_t number, TopicLog& log,
         const MirrorSettings& settings);

  void attach(std::shared_ptr<Resource> resource) override;
  bool send() override;
  time_ns_t next_look_ns() const override { return due_ns_; }

 private:
  /// The message to publish in value_, made from the resource's in message_; false when that is malformed.
  bool make_message(time_ns_t time_ns);
  std::string full_name() const override { return rcl_publisher_get_topic_name(publisher_.get()); }
  const TopicEvents& events() const override { return events_; }

  const MirrorSettings settings_;
  Owned<rcl_publisher_t, rcl_publisher_fini> publisher_;
  std::optional<Owned<rcl_publisher_t, rcl_publisher_fini>> names_;  // of all numbers
  std::vector<std::byte> message_;                                   // these keep their capacity
  std::vector<std::byte> value_;
  std::vector<double> numbers_;
  std::uint64_t seen_{0};
  time_ns_t due_ns_{0};
  TopicEvents events_;  // end before the entity that they are of
};

}  // namespace mauve::bridge
