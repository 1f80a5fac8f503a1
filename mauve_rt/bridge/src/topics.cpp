// SPDX-License-Identifier: LGPL-3.0-or-later
#include "topics.hpp"

#include <rcl/error_handling.h>

#include <algorithm>
#include <array>
#include <span>

#include "mauve_rt/base/seam/guards.hpp"
#include "mauve_rt/base/time.hpp"

#include "rcl_error.hpp"
#include "type_support.hpp"

namespace mauve::bridge {

namespace {

constexpr int kMessagesAtOnce = 64;  // messages that one wait takes of a topic
// Of a stop's output on a best-effort topic, after its first message: a loss that lasts for some ms does not take them all.
constexpr std::array kCopies{ms_to_ns(5), ms_to_ns(20)};
// Of a reliable topic, while it is not acknowledged: only a message makes the middleware report soon what it has sent, else
// listeners ask for a lost one seconds later. So long takes an acknowledgement; and as often as a bad cable needs.
constexpr time_ns_t kRepairEvery = ms_to_ns(10);
constexpr std::size_t kRepairs = 20;
constexpr time_ns_t kExplainEvery = ms_to_ns(100);  // a flood of messages is not looked at one by one

std::string described(const TopicSettings& settings) {
  return "resource " + settings.resource + ", topic " + settings.name;
}

}  // namespace

std::vector<Arrival*> BoundTopic::arrivals(Lane lane) {
  return lane == Lane::events ? events().arrivals() : std::vector<Arrival*>{};
}

void BoundTopic::attach(std::shared_ptr<Resource> resource) {
  if (is_static_) {
    Resource* const side = resource->static_side();
    if (side == nullptr) {
      throw Error(ErrorCode::invalid_argument, "the resource has no static values",
                  {.element = "resource " + resource_name(),
                   .expected = "a transform_tree",
                   .found = resource->kind(),
                   .remedy = "bind it to one topic"});
    }
    resource = std::shared_ptr<Resource>(std::move(resource), side);
  }
  Binding::attach(std::move(resource));
}

void BoundTopic::report(BridgeReport& report) const {
  const LockGuard lock(refusal_mutex_);
  report.topics.push_back({.resource = resource_name(),
                           .topic = full_name(),
                           .counts = counter_.counts(),
                           .troubles = events().troubles(),
                           .refusal = refusal_});
}

void BoundTopic::explain(std::span<const std::byte> message, time_ns_t now) {
  if (now < explained_ns_ + kExplainEvery) return;
  explained_ns_ = now;
  std::string refusal = resource().why_refused(message);
  const LockGuard lock(refusal_mutex_);
  refusal_ = std::move(refusal);
}

void BoundTopic::count(bool passed, time_ns_t time_ns, std::span<const std::byte> message) {
  counter_.count(passed);
  log_.add(number_, time_ns, message);
}

OutgoingTopic::OutgoingTopic(rcl_node_t& node, const TopicSettings& settings, std::size_t number,
                             TopicLog& log)
    : BoundTopic(settings, number, log), publisher_(node, rcl_get_zero_initialized_publisher()) {
  rcl_publisher_options_t options = rcl_publisher_get_default_options();
  options.qos = settings.qos;
  check(rcl_publisher_init(publisher_.get(), &node, &message_type_support(settings.type),
                           settings.name.c_str(), &options),
        "the topic cannot be published", described(settings));
  const rmw_qos_profile_t* const actual = rcl_publisher_get_actual_qos(publisher_.get());
  is_reliable_ = actual != nullptr && actual->reliability == RMW_QOS_POLICY_RELIABILITY_RELIABLE;
  events_.open(*publisher_.get(), settings.qos);
}

bool OutgoingTopic::send() {
  const LockGuard lock(mutex_);
  return send_next();
}

time_ns_t OutgoingTopic::send_stops(bool may_wait) {
  const time_ns_t due_ns = copy_due_ns_.load(std::memory_order_relaxed);
  if (resource().stops() == stops_.load(std::memory_order_relaxed) && monotonic_now_ns() < due_ns)
    return due_ns;
  if (may_wait) {
    mutex_.lock();
  } else if (!mutex_.try_lock()) {
    return kForever;
  }
  const LockGuard lock(mutex_, std::adopt_lock);
  const std::uint32_t stops = resource().stops();  // before the samples: a later one is noticed
  if (stops != stops_.load(std::memory_order_relaxed)) {
    if (send_next()) return kAtOnce;
    stops_.store(stops, std::memory_order_relaxed);
  }
  if (copy_due_ns_.load(std::memory_order_relaxed) <= monotonic_now_ns() && !send_next()) repeat();
  return copy_due_ns_.load(std::memory_order_relaxed);
}

/// How long after the first message of a stop's output the next copy is due; kForever: there is none.
time_ns_t OutgoingTopic::copy_after_ns() const {
  if (is_reliable_) return copies_ < kRepairs ? static_cast<time_ns_t>(copies_ + 1) * kRepairEvery : kForever;
  return copies_ < kCopies.size() ? kCopies[copies_] : kForever;
}

/// Whether there was one.
bool OutgoingTopic::send_next() {
  time_ns_t time_ns = 0;
  if (!resource().next_sample(message_, time_ns, seen_)) return false;
  publish(message_);
  copy_due_ns_.store(kForever, std::memory_order_relaxed);
  if (time_ns > resource().stop_ns()) return true;
  message_.swap(stopped_);
  stopped_sent_ns_ = monotonic_now_ns();
  copies_ = 0;
  copy_due_ns_.store(stopped_sent_ns_ + copy_after_ns(), std::memory_order_relaxed);
  return true;
}

/// Unless all listeners have it.
void OutgoingTopic::repeat() {
  time_ns_t after_ns = kForever;
  if (!is_reliable_ || !went_well(rcl_publisher_wait_for_all_acked(publisher_.get(), 0))) {
    publish(stopped_);
    ++copies_;
    after_ns = copy_after_ns();
  }
  copy_due_ns_.store(after_ns == kForever ? kForever : stopped_sent_ns_ + after_ns,
                     std::memory_order_relaxed);
}

void OutgoingTopic::publish(std::vector<std::byte>& message) {
  // Sent from where it lies: rcl only reads it.
  const rcl_serialized_message_t serialized = borrowed(message);
  const bool passed = went_well(rcl_publish_serialized_message(publisher_.get(), &serialized, nullptr));
  count(passed, monotonic_now_ns(), message);
}

ArrivalTwin::ArrivalTwin(rcl_node_t& node, const TopicSettings& settings, const Arrival& messages,
                         Resource& resource)
    : messages_(messages), resource_(resource), subscription_(node, rcl_get_zero_initialized_subscription()) {
  rcl_subscription_options_t options = rcl_subscription_get_default_options();
  options.qos = rmw_qos_profile_sensor_data;
  options.qos.depth = 1;
  check(rcl_subscription_init(subscription_.get(), &node, &message_type_support(settings.type),
                              settings.name.c_str(), &options),
        "arrivals of the topic cannot be subscribed to", described(settings));
}

void ArrivalTwin::join(rcl_wait_set_t& set) {
  if (rcl_wait_set_add_subscription(&set, subscription_.get(), &place_) != RCL_RET_OK) rcl_reset_error();
}

void ArrivalTwin::take() {
  rmw_message_info_t about = rmw_get_zero_initialized_message_info();
  for (int taken = 0; taken < kMessagesAtOnce; ++taken) {
    if (!went_well(rcl_take_serialized_message(subscription_.get(), message_.get(), &about, nullptr))) return;
    resource_.arrived(monotonic_now_ns());
  }
}

IncomingTopic::IncomingTopic(rcl_node_t& node, const TopicSettings& settings, std::size_t number,
                             TopicLog& log)
    : BoundTopic(settings, number, log),
      node_(node),
      settings_(settings),
      subscription_(node, rcl_get_zero_initialized_subscription()) {
  rcl_subscription_options_t options = rcl_subscription_get_default_options();
  options.qos = settings.qos;
  check(rcl_subscription_init(subscription_.get(), &node, &message_type_support(settings.type),
                              settings.name.c_str(), &options),
        "the topic cannot be subscribed to", described(settings));
  events_.open(*subscription_.get(), settings.qos);
}

std::vector<Arrival*> IncomingTopic::arrivals(Lane lane) {
  if (lane != Lane::messages) return BoundTopic::arrivals(lane);
  std::vector<Arrival*> all{this};
  if (twin_ != nullptr) all.push_back(twin_.get());
  return all;
}

void IncomingTopic::listen_for_silence(Silence of) {
  if (of == silence_) return;
  const bool is_repaired = settings_.qos.reliability != RMW_QOS_POLICY_RELIABILITY_BEST_EFFORT;
  twin_.reset();
  if (of == Silence::of_link && is_repaired)
    twin_ = std::make_unique<ArrivalTwin>(node_, settings_, static_cast<const Arrival&>(*this), resource());
  if (of == Silence::none) resource().caught_up(kForever);
  silence_ = of;
}

void IncomingTopic::join(rcl_wait_set_t& set) {
  if (rcl_wait_set_add_subscription(&set, subscription_.get(), &place_) != RCL_RET_OK) rcl_reset_error();
}

bool IncomingTopic::has_arrived(const rcl_wait_set_t& set) const {
  return set.subscriptions[place_] != nullptr;
}

void IncomingTopic::take() {
  for (int taken = 0; taken < kMessagesAtOnce; ++taken) {
    rmw_message_info_t about = rmw_get_zero_initialized_message_info();
    if (!went_well(rcl_take_serialized_message(subscription_.get(), message_.get(), &about, nullptr)))
      return;  // nothing left, which is no error
    const time_ns_t now = monotonic_now_ns();
    const bool passed = resource().write_sample(message_.bytes(), now);
    if (!passed) explain(message_.bytes(), now);
    count(passed, now, message_.bytes());
  }
}

}  // namespace mauve::bridge
