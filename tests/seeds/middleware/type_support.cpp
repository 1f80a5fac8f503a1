// SPDX-License-Identifier: LGPL-3.0-or-later
// In place of mauve_rt/bridge/src/type_support.cpp, which loads libraries: a message of rcl's own form is a vector of its bytes.
#include "type_support.hpp"

#include <cstddef>
#include <vector>

namespace mauve::bridge {

namespace {

using Bytes = std::vector<std::byte>;

constexpr rosidl_message_type_support_t kMessage{};
constexpr rosidl_service_type_support_t kService{};

constexpr MessageFunctions kOfAnyType{.type = &kMessage,
                                      .create = []() -> void* { return new Bytes; },
                                      .destroy = [](void* bytes) { delete static_cast<Bytes*>(bytes); }};

}  // namespace

const rosidl_message_type_support_t& message_type_support(const std::string& /*type*/) { return kMessage; }
CallTypeSupport call_type_support(const std::string& /*type*/) {
  return {.service = &kService, .request = kOfAnyType, .response = kOfAnyType};
}

}  // namespace mauve::bridge
