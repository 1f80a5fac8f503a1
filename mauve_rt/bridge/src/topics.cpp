// SPDX-License-Identifier: LGPL-3.0-or-later
#include "topics.hpp"

#include <rcl/error_handling.h>

#include "mauve_rt/time.hpp"

#include "rcl_error.hpp"
#include "type_support.hpp"

namespace mauve::bridge {

namespace {

constexpr int kAtOnce = 64;  // messages of one topic before the others have their turn

std::string described(const Resource& resource, const TopicSettings& settings) {
  return "resource " + resource.name() + ", topic " + settings.name;
}

}  // namespace

OutgoingTopic::OutgoingTopic(rcl_node_t& node, Resource& resource, const TopicSettings& settings,
                             TopicLog& log)
    : resource_(resource),
      log_(log),
      number_(settings.number),
      publisher_(node, rcl_get_zero_initialized_publisher()) {
  rcl_publisher_options_t options = rcl_publisher_get_default_options();
  options.qos = settings.qos;
  check(rcl_publisher_init(publisher_.get(), &node, &message_type_support(settings.type),
                           settings.name.c_str(), &options),
        "the topic cannot be published", described(resource, settings));
  events_.open(*publisher_.get(), settings.qos);
}

bool OutgoingTopic::send() {
  time_ns_t time_ns = 0;
  for (int sent = 0; sent < kAtOnce; ++sent) {
    if (!resource_.next_sample(message_, time_ns, seen_)) return false;
    // Sent from where it lies: rcl only reads it.
    const rcl_serialized_message_t serialized{.buffer = reinterpret_cast<std::uint8_t*>(message_.data()),
                                              .buffer_length = message_.size(),
                                              .buffer_capacity = message_.size(),
                                              .allocator = rcl_get_default_allocator()};
    const bool passed = rcl_publish_serialized_message(publisher_.get(), &serialized, nullptr) == RCL_RET_OK;
    if (!passed) rcl_reset_error();
    counter_.count(passed);
    log_.add(number_, monotonic_now_ns(), message_);
  }
  return true;
}

IncomingTopic::IncomingTopic(rcl_node_t& node, Resource& resource, const TopicSettings& settings,
                             TopicLog& log)
    : resource_(resource),
      log_(log),
      number_(settings.number),
      subscription_(node, rcl_get_zero_initialized_subscription()) {
  rcl_subscription_options_t options = rcl_subscription_get_default_options();
  options.qos = settings.qos;
  check(rcl_subscription_init(subscription_.get(), &node, &message_type_support(settings.type),
                              settings.name.c_str(), &options),
        "the topic cannot be subscribed to", described(resource, settings));
  events_.open(*subscription_.get(), settings.qos);
}

void IncomingTopic::join(rcl_wait_set_t& set) {
  if (rcl_wait_set_add_subscription(&set, subscription_.get(), &place_) != RCL_RET_OK) rcl_reset_error();
}

bool IncomingTopic::has_arrived(const rcl_wait_set_t& set) const {
  return set.subscriptions[place_] != nullptr;
}

void IncomingTopic::take() {
  for (int taken = 0; taken < kAtOnce; ++taken) {
    rmw_message_info_t about = rmw_get_zero_initialized_message_info();
    if (rcl_take_serialized_message(subscription_.get(), message_.get(), &about, nullptr) != RCL_RET_OK) {
      rcl_reset_error();  // nothing left, which is no error
      return;
    }
    const rcl_serialized_message_t& arrived = *message_.get();
    const std::span data(reinterpret_cast<const std::byte*>(arrived.buffer), arrived.buffer_length);
    const time_ns_t now = monotonic_now_ns();
    counter_.count(resource_.write_sample(data, now));
    log_.add(number_, now, data);
  }
}

}  // namespace mauve::bridge
