// SPDX-License-Identifier: LGPL-3.0-or-later
// A ROS node as one would have it with rcl alone, for the references.
#pragma once

#include <geometry_msgs/msg/point.h>
#include <rcl/error_handling.h>
#include <rcl/rcl.h>

#include <atomic>
#include <chrono>
#include <iostream>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "mauve_rt/base/time.hpp"

namespace bench {

using PointMessage = geometry_msgs__msg__Point;

/// Throws std::runtime_error with what rcl says unless it went well.
inline void check(rcl_ret_t outcome, const char* what) {
  if (outcome == RCL_RET_OK) return;
  const std::string message = rcl_get_error_string().str;
  rcl_reset_error();
  throw std::runtime_error(std::string(what) + ": " + message);
}

inline const rosidl_message_type_support_t* point_type() {
  return ROSIDL_GET_MSG_TYPE_SUPPORT(geometry_msgs, msg, Point);
}

/// A context and a node in it. Ends with the process, as do publishers and subscriptions.
class BareNode {
 public:
  BareNode(const char* name, const std::string& name_space) {
    rcl_init_options_t options = rcl_get_zero_initialized_init_options();
    check(rcl_init_options_init(&options, rcl_get_default_allocator()), "rcl_init_options_init");
    check(rcl_init(0, nullptr, &options, &context_), "rcl_init");
    const rcl_node_options_t node_options = rcl_node_get_default_options();
    check(rcl_node_init(&node_, name, name_space.c_str(), &context_, &node_options), "rcl_node_init");
  }
  BareNode(const BareNode&) = delete;
  BareNode& operator=(const BareNode&) = delete;

  rcl_context_t& context() { return context_; }
  rcl_node_t& get() { return node_; }

 private:
  rcl_context_t context_ = rcl_get_zero_initialized_context();
  rcl_node_t node_ = rcl_get_zero_initialized_node();
};

/// point_0, point_1 ..., relative to the node's namespace, as the talker's architecture names them.
inline std::string topic_name(std::size_t number) { return "point_" + std::to_string(number); }

/// Until a subscription knows so many publishers.
inline void await_publishers(const rcl_subscription_t& subscription, std::size_t wanted) {
  for (std::size_t found = 0; found < wanted;) {
    check(rcl_subscription_get_publisher_count(&subscription, &found), "publisher count");
    if (found < wanted) std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
}

/// Calls `take` with the number of each subscription that has messages, until told to end.
template <typename Take>
void take_until(const std::atomic<bool>& ending, rcl_wait_set_t& set,
                const std::vector<rcl_subscription_t>& subscriptions, Take take) {
  while (!ending) {
    check(rcl_wait_set_clear(&set), "rcl_wait_set_clear");
    for (const rcl_subscription_t& subscription : subscriptions)
      check(rcl_wait_set_add_subscription(&set, &subscription, nullptr), "rcl_wait_set_add");
    const rcl_ret_t outcome = rcl_wait(&set, mauve::ms_to_ns(100));
    if (outcome == RCL_RET_TIMEOUT) continue;
    check(outcome, "rcl_wait");
    for (std::size_t i = 0; i < subscriptions.size(); ++i) {
      if (set.subscriptions[i] != nullptr) take(i);
    }
  }
}

/// Becomes true at a line on the standard input, or its end. Called once.
inline const std::atomic<bool>& ending_by_a_line() {
  static std::atomic<bool> ending{false};
  std::thread([] {
    std::string line;
    std::getline(std::cin, line);
    ending = true;
  }).detach();  // the process ends with or without a line
  return ending;
}

/// Says on the standard output that everybody is there.
inline void say(const char* word) { std::cout << word << std::endl; }

}  // namespace bench
