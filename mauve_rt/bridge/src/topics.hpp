// SPDX-License-Identifier: LGPL-3.0-or-later
// Resources bound to ROS topics: what is written is published, what arrives is written.
#pragma once

#include <rcl/publisher.h>
#include <rcl/subscription.h>

#include <memory>
#include <span>
#include <string>

#include "mauve_rt/base/pi_mutex.hpp"
#include "mauve_rt/base/seam/atomic.hpp"
#include "mauve_rt/base/seam/mutex.hpp"

#include "binding.hpp"
#include "owned.hpp"
#include "topic_log.hpp"

namespace mauve::bridge {

/// What both directions are made from.
struct TopicSettings {
  std::string resource;
  std::string name;  // as given; rcl expands and remaps it
  std::string type;  // package/msg/Type
  rmw_qos_profile_t qos;
  bool is_static{false};  // of the resource's static side
};

/// What both directions have in common.
class BoundTopic : public Binding {
 public:
  /// `number`: in the log.
  BoundTopic(const TopicSettings& settings, std::size_t number, TopicLog& log)
      : Binding(settings.resource), log_(log), number_(number), is_static_(settings.is_static) {}
  void attach(std::shared_ptr<Resource> resource) override;
  std::vector<Arrival*> arrivals(Lane lane) override;
  void report(BridgeReport& report) const override;

 protected:
  /// Of a message that went through, or not; for the log, too. [non-rt]
  void count(bool passed, time_ns_t time_ns, std::span<const std::byte> message);
  /// Not for the log. [non-rt]
  void count(bool passed) noexcept { counter_.count(passed); }
  /// Notes why the resource refused a message, unless it has just done so of another one. [non-rt]
  void explain(std::span<const std::byte> message, time_ns_t now);
  virtual std::string full_name() const = 0;
  virtual const TopicEvents& events() const = 0;

 private:
  TopicLog& log_;
  std::size_t number_;
  bool is_static_;
  TrafficCounter counter_;
  time_ns_t explained_ns_{0};  // of the thread that counts
  mutable Mutex refusal_mutex_;
  std::string refusal_ MAUVE_GUARDED_BY(refusal_mutex_);  // that thread writes it, others look
};

/// Publishes what is written to a resource. The outputs that a stop writes are sent again until something newer is sent: by a
/// publisher that is best effort twice, by a reliable one while they are not acknowledged.
///
/// | member            | written by    | read by                       | under / order                                  |
/// | ----------------- | ------------- | ----------------------------- | ---------------------------------------------- |
/// | stops_, copy_due_ns_ | who sends  | send_stops(), before it locks | mutex_; relaxed: who changes the resource's count notifies afterwards |
/// | the rest          | who sends     | who sends                     | mutex_, held while it publishes: the order of the messages is that of the writes |
class OutgoingTopic final : public BoundTopic {
 public:
  /// Throws Error when the type is not installed or rcl refuses. [non-rt]
  OutgoingTopic(rcl_node_t& node, const TopicSettings& settings, std::size_t number, TopicLog& log);

  bool send() override;
  time_ns_t send_stops(bool may_wait) override;

 private:
  bool send_next() MAUVE_REQUIRES(mutex_);
  void publish(std::vector<std::byte>& message) MAUVE_REQUIRES(mutex_);
  void repeat() MAUVE_REQUIRES(mutex_);
  time_ns_t copy_after_ns() const MAUVE_REQUIRES(mutex_);
  std::string full_name() const override { return rcl_publisher_get_topic_name(publisher_.get()); }
  const TopicEvents& events() const override { return events_; }

  Owned<rcl_publisher_t, rcl_publisher_fini> publisher_;
  bool is_reliable_{false};
  PiMutex mutex_;
  std::vector<std::byte> message_ MAUVE_GUARDED_BY(mutex_);  // these keep their capacity
  std::vector<std::byte> stopped_ MAUVE_GUARDED_BY(mutex_);  // the last that a stop has written
  std::uint64_t seen_ MAUVE_GUARDED_BY(mutex_){0};
  Atomic<std::uint32_t> stops_{0};           // of the resource, as far as they are sent
  Atomic<time_ns_t> copy_due_ns_{kForever};  // the next copy of stopped_
  std::size_t copies_ MAUVE_GUARDED_BY(mutex_){0};
  time_ns_t stopped_sent_ns_ MAUVE_GUARDED_BY(mutex_){0};
  TopicEvents events_;  // end before the entity that they are of
};

/// A subscription that only reports arrivals: best effort, so that a lost message holds up no later one until it is
/// repaired. Taken from by the receiver's thread.
class ArrivalTwin final : public Arrival {
 public:
  /// `messages` writes them to the resource; both outlive it. Throws Error as IncomingTopic. [non-rt]
  ArrivalTwin(rcl_node_t& node, const TopicSettings& settings, const Arrival& messages, Resource& resource);

 private:
  void join(rcl_wait_set_t& set) override;
  /// Also when messages wait to be written, perhaps more of them than were taken now: then nothing is caught up.
  bool has_arrived(const rcl_wait_set_t& set) const override {
    return set.subscriptions[place_] != nullptr || messages_.has_arrived(set);
  }
  void take() override;
  bool wants_idle() const override { return true; }
  void idle(time_ns_t until_ns) override { resource_.caught_up(until_ns); }

  const Arrival& messages_;
  Resource& resource_;
  Owned<rcl_subscription_t, rcl_subscription_fini> subscription_;
  OwnedMessage message_;
  std::size_t place_{0};  // in the wait set
};

/// Writes to a resource what is published. Taken from by the receiver's thread.
class IncomingTopic final : public BoundTopic, private Arrival {
 public:
  /// Throws Error when the type is not installed or rcl refuses. [non-rt]
  IncomingTopic(rcl_node_t& node, const TopicSettings& settings, std::size_t number, TopicLog& log);

  std::vector<Arrival*> arrivals(Lane lane) override;
  void listen_for_silence(Silence of) override;

 private:
  void join(rcl_wait_set_t& set) override;
  bool has_arrived(const rcl_wait_set_t& set) const override;
  void take() override;
  bool wants_idle() const override { return silence_ != Silence::none && twin_ == nullptr; }
  void idle(time_ns_t until_ns) override { resource().caught_up(until_ns); }
  std::string full_name() const override { return rcl_subscription_get_topic_name(subscription_.get()); }
  const TopicEvents& events() const override { return events_; }

  rcl_node_t& node_;
  const TopicSettings settings_;
  Owned<rcl_subscription_t, rcl_subscription_fini> subscription_;
  OwnedMessage message_;
  std::unique_ptr<ArrivalTwin> twin_;  // while silence_ is of_link, of a reliable subscription
  Silence silence_{Silence::none};
  std::size_t place_{0};  // in the wait set
  TopicEvents events_;    // end before the entity that they are of
};

}  // namespace mauve::bridge
