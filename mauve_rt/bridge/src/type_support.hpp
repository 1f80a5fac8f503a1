// SPDX-License-Identifier: LGPL-3.0-or-later
// Type supports of installed interface packages, found by name as rclcpp's generic publishers find them.
#pragma once

#include <rosidl_runtime_c/message_type_support_struct.h>
#include <rosidl_runtime_c/service_type_support_struct.h>

#include <cstddef>
#include <string>

struct rosidl_action_type_support_t;

namespace mauve::bridge {

/// The type support of `package/msg/Type`; its library stays loaded. [non-rt]
/// Throws Error (unknown_type) naming what is not installed.
const rosidl_message_type_support_t& message_type_support(const std::string& type);

/// A part of a type, and how messages of it are made.
struct MessageFunctions {
  using Create = void* (*)();
  using Destroy = void (*)(void*);
  const rosidl_message_type_support_t* type;
  Create create;
  Destroy destroy;
};

/// The type of a ROS service.
struct CallTypeSupport {
  const rosidl_service_type_support_t* service;
  MessageFunctions request;
  MessageFunctions response;
};

/// Of `package/srv/Type`. [non-rt] Throws Error (unknown_type) when it is not installed.
CallTypeSupport call_type_support(const std::string& type);

/// The type of a ROS action.
struct ActionTypeSupport {
  const rosidl_action_type_support_t* action;
  MessageFunctions goal_request;
  MessageFunctions goal_response;
  MessageFunctions result_request;
  MessageFunctions result_response;
  MessageFunctions feedback;
  const rosidl_message_type_support_t* result;  // of the result alone
  std::size_t result_offset;                    // where it begins in the struct of a result_response
};

/// Of `package/action/Type`. [non-rt] Throws Error (unknown_type) when it is not installed.
ActionTypeSupport action_type_support(const std::string& type);

/// One of them. [non-rt] Throws Error (unknown_type) when it is not installed, or cannot be loaded.
void require_type_support(const std::string& type);

}  // namespace mauve::bridge
