// SPDX-License-Identifier: LGPL-3.0-or-later
// Things of rcl that end with their owner.
#pragma once

#include <rcl/error_handling.h>
#include <rcl/node.h>
#include <rcl/types.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

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

/// A message where it lies, for those of rcl that only read it. [non-rt]
inline rcl_serialized_message_t borrowed(std::vector<std::byte>& message) {
  return {.buffer = reinterpret_cast<std::uint8_t*>(message.data()),
          .buffer_length = message.size(),
          .buffer_capacity = message.size(),
          .allocator = rcl_get_default_allocator()};
}

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
  /// What it holds now. [non-rt]
  std::span<const std::byte> bytes() const noexcept {
    return {reinterpret_cast<const std::byte*>(message_.buffer), message_.buffer_length};
  }

 private:
  rcl_serialized_message_t message_;
};

}  // namespace mauve::bridge
