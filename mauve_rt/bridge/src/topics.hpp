// SPDX-License-Identifier: LGPL-3.0-or-later
// Resources bound to ROS topics: what is written is published, what arrives is written.
#pragma once

#include <rcl/publisher.h>
#include <rcl/subscription.h>

#include <atomic>
#include <string>

#include "mauve_rt/resource.hpp"

#include "owned.hpp"
#include "receiver.hpp"
#include "topic_events.hpp"
#include "topic_log.hpp"

namespace mauve::bridge {

/// How a topic fared. Counts of messages.
struct TopicCounts {
  std::uint64_t passed{0};   // sent, or received and written
  std::uint64_t refused{0};  // by rcl, or by the resource: full, malformed, larger than it declares
};

/// The counts while one thread counts and others look.
///
/// | member            | written by       | order                                     |
/// | ----------------- | ---------------- | ----------------------------------------- |
/// | passed_, refused_ | the one thread   | relaxed: figures that nothing depends on  |
class TopicCounter {
 public:
  void count(bool passed) noexcept {
    std::atomic<std::uint64_t>& counter = passed ? passed_ : refused_;
    counter.store(counter.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
  }
  TopicCounts counts() const noexcept {
    return {.passed = passed_.load(std::memory_order_relaxed),
            .refused = refused_.load(std::memory_order_relaxed)};
  }

 private:
  std::atomic<std::uint64_t> passed_{0};
  std::atomic<std::uint64_t> refused_{0};
};

/// What both directions are made from.
struct TopicSettings {
  std::string name;  // as given; rcl expands and remaps it
  std::string type;  // package/msg/Type
  rmw_qos_profile_t qos;
  std::size_t number;  // in the log
};

/// Publishes what is written to a resource. For one thread at a time.
class OutgoingTopic {
 public:
  /// Throws Error when the type is not installed or rcl refuses. [non-rt]
  OutgoingTopic(rcl_node_t& node, Resource& resource, const TopicSettings& settings, TopicLog& log);

  /// Publishes what was written since the last call, oldest first; true when there may be more. [non-rt]
  bool send();
  std::string full_name() const { return rcl_publisher_get_topic_name(publisher_.get()); }
  TopicCounts counts() const noexcept { return counter_.counts(); }
  const TopicEvents& events() const noexcept { return events_; }
  const Resource& resource() const noexcept { return resource_; }

 private:
  Resource& resource_;
  TopicLog& log_;
  std::size_t number_;
  Owned<rcl_publisher_t, rcl_publisher_fini> publisher_;
  std::vector<std::byte> message_;  // keeps its capacity
  std::uint64_t seen_{0};
  TopicCounter counter_;
  TopicEvents events_;  // end before the entity that they are of
};

/// Writes to a resource what is published. Taken from by the receiver's thread.
class IncomingTopic final : public Arrival {
 public:
  /// Throws Error when the type is not installed or rcl refuses. [non-rt]
  IncomingTopic(rcl_node_t& node, Resource& resource, const TopicSettings& settings, TopicLog& log);

  void join(rcl_wait_set_t& set) override;
  bool has_arrived(const rcl_wait_set_t& set) const override;
  void take() override;
  std::string full_name() const { return rcl_subscription_get_topic_name(subscription_.get()); }
  TopicCounts counts() const noexcept { return counter_.counts(); }
  const TopicEvents& events() const noexcept { return events_; }
  const Resource& resource() const noexcept { return resource_; }

 private:
  Resource& resource_;
  TopicLog& log_;
  std::size_t number_;
  Owned<rcl_subscription_t, rcl_subscription_fini> subscription_;
  OwnedMessage message_;
  std::size_t place_{0};  // in the wait set
  TopicCounter counter_;
  TopicEvents events_;  // end before the entity that they are of
};

}  // namespace mauve::bridge
