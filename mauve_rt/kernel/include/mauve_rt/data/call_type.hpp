// SPDX-License-Identifier: LGPL-3.0-or-later
// Calls with one request and one response, as ROS services have them, by the name of their type.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/data/service.hpp"

namespace mauve {

/// How a call ended; the response is the caller's own old one unless it was answered.
enum class CallOutcome : std::uint8_t {
  answered = 0,
  no_server,  // nobody offers the service now
  timed_out,
  stopped,    // the calling component is to stop
  busy,       // another component's call is under way
  malformed,  // the response does not fit the declared type, or a server took the request for such
};

/// "answered", "no server", ... [rt]
std::string_view to_string(CallOutcome outcome) MAUVE_RT;

/// What MAUVE_CALL_TYPE specialises: `name`, the type's identity.
template <typename S>
struct CallTraits;

/// A struct with Request and Response that live in place, so that a component thread may copy them.
template <typename S>
concept DescribedCall =
    requires {
      { CallTraits<S>::name } -> std::convertible_to<std::string_view>;
    } && Described<typename S::Request> && Described<typename S::Response> &&
    std::is_trivially_copyable_v<typename S::Request> && std::is_trivially_copyable_v<typename S::Response>;

/// The signature of its calls.
template <DescribedCall S>
using CallOf = CallOutcome(const typename S::Request&, typename S::Response&);

/// Offers calls of the type to components and, where the file says so, to ROS. Derive from it and implement call().
template <DescribedCall S>
class RequestService : public CallService<CallOf<S>> {
 public:
  explicit RequestService(std::string name)
      : CallService<CallOf<S>>(std::move(name), std::string(CallTraits<S>::name)) {}

  bool is_call_serializable() const noexcept override { return true; }
  CallOutcome call_serialized(std::span<const std::byte> message, std::vector<std::byte>& reply) override {
    const auto request = std::make_unique<typename S::Request>();
    const auto response = std::make_unique<typename S::Response>();
    if (!CdrReader(message).get(*request)) return CallOutcome::malformed;
    const CallOutcome outcome = this->call(*request, *response);
    if (outcome == CallOutcome::answered) CdrWriter(reply).put(*response);
    return outcome;
  }
};

}  // namespace mauve

/// Declares a struct with Request and Response (each a MAUVE_TYPE of its own) as a ROS service's type, once, at
/// global scope:
///   MAUVE_TYPE(my::SetBool::Request, "std_srvs/srv/SetBool_Request", data)
///   MAUVE_TYPE(my::SetBool::Response, "std_srvs/srv/SetBool_Response", success, message)
///   MAUVE_CALL_TYPE(my::SetBool, "std_srvs/srv/SetBool")
#define MAUVE_CALL_TYPE(type, type_name)                \
  template <>                                           \
  struct mauve::CallTraits<type> {                      \
    static constexpr std::string_view name = type_name; \
  };
