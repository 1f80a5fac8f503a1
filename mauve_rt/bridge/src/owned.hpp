// SPDX-License-Identifier: LGPL-3.0-or-later
// Things of rcl that end with their owner.
#pragma once

#include <rcl/error_handling.h>
#include <rcl/node.h>
#include <rcl/types.h>

namespace mauve::bridge {

/// An entity of a node, which outlives it; zero until it is initialised.
template <typename Entity, rcl_ret_t (*finalise)(Entity*, rcl_node_t*)>
class Owned {
 public:
  Owned(rcl_node_t& node, const Entity& zero) : node_(node), entity_(zero) {}
  ~Owned() {
    if (finalise(&entity_, &node_) != RCL_RET_OK) rcl_reset_error();
  }
  Owned(const Owned&) = delete;
  Owned& operator=(const Owned&) = delete;

  Entity* get() noexcept { return &entity_; }
  const Entity* get() const noexcept { return &entity_; }

 private:
  rcl_node_t& node_;
  Entity entity_;
};

/// A buffer that keeps its capacity between messages.
class OwnedMessage {
 public:
  OwnedMessage() : message_(rmw_get_zero_initialized_serialized_message()) {
    const rcl_allocator_t allocator = rcl_get_default_allocator();
    if (rmw_serialized_message_init(&message_, 0, &allocator) != RMW_RET_OK) rcl_reset_error();
  }
  ~OwnedMessage() {
    if (rmw_serialized_message_fini(&message_) != RMW_RET_OK) rcl_reset_error();
  }
  OwnedMessage(const OwnedMessage&) = delete;
  OwnedMessage& operator=(const OwnedMessage&) = delete;

  rcl_serialized_message_t* get() noexcept { return &message_; }

 private:
  rcl_serialized_message_t message_;
};

}  // namespace mauve::bridge
