// SPDX-License-Identifier: LGPL-3.0-or-later
#include "topics.hpp"

#include <rcl/error_handling.h>

#include "mauve_rt/base/time.hpp"

#include "rcl_error.hpp"
#include "type_support.hpp"

namespace mauve::bridge {

namespace {

constexpr int kMessagesAtOnce = 64;                 // messages of one topic before the others have their turn
constexpr time_ns_t kExplainEvery = ms_to_ns(100);  // a flood of messages is not looked at one by one

std::string described(const TopicSettings& settings) {
  return "resource " + settings.resource + ", topic " + settings.name;
}

}  // namespace

std::vector<Arrival*> BoundTopic::arrivals(Lane lane) {
  return lane == Lane::events ? events().arrivals() : std::vector<Arrival*>{};
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
    : BoundTopic(settings.resource, number, log), publisher_(node, rcl_get_zero_initialized_publisher()) {
  rcl_publisher_options_t options = rcl_publisher_get_default_options();
  options.qos = settings.qos;
  check(rcl_publisher_init(publisher_.get(), &node, &message_type_support(settings.type),
                           settings.name.c_str(), &options),
        "the topic cannot be published", described(settings));
  events_.open(*publisher_.get(), settings.qos);
}

bool OutgoingTopic::send() {
  time_ns_t time_ns = 0;
  for (int sent = 0; sent < kMessagesAtOnce; ++sent) {
    if (!resource().next_sample(message_, time_ns, seen_)) return false;
    // Sent from where it lies: rcl only reads it.
    const rcl_serialized_message_t serialized = borrowed(message_);
    const bool passed = went_well(rcl_publish_serialized_message(publisher_.get(), &serialized, nullptr));
    count(passed, monotonic_now_ns(), message_);
  }
  return true;
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
    : BoundTopic(settings.resource, number, log),
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
