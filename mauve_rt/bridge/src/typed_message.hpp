// SPDX-License-Identifier: LGPL-3.0-or-later
// Messages in rcl's own form.
#pragma once

#include <rmw/rmw.h>

#include <cstddef>
#include <memory>
#include <vector>

#include "owned.hpp"
#include "rcl_error.hpp"
#include "type_support.hpp"

namespace mauve::bridge {

/// A message of rcl's own form, which only its type support knows. [non-rt]
class TypedMessage {
 public:
  explicit TypedMessage(const MessageFunctions& type) : type_(type), data_(type.create(), type.destroy) {}
  void* get() const noexcept { return data_.get(); }
  /// The same where its struct begins so. [non-rt]
  template <typename Beginning>
  Beginning& as() const noexcept {
    return *static_cast<Beginning*>(data_.get());
  }
  /// False when it is malformed.
  bool deserialize(std::vector<std::byte>& message) {
    const rcl_serialized_message_t serialized = borrowed(message);
    return went_well(rmw_deserialize(&serialized, type_.type, get()));
  }
  bool serialize(OwnedMessage& into) const { return went_well(rmw_serialize(get(), type_.type, into.get())); }

 private:
  MessageFunctions type_;
  std::unique_ptr<void, MessageFunctions::Destroy> data_;
};

}  // namespace mauve::bridge
