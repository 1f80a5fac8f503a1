// SPDX-License-Identifier: LGPL-3.0-or-later
// Typed errors: what, where, expected, found and the remedy.
#pragma once

#include <array>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>

#include "mauve_rt/base/rt.hpp"

namespace mauve {

enum class ErrorCode : std::uint16_t {
  invalid_argument,
  unknown_component,
  unknown_core,
  undeclared_core,
  unknown_shell,
  unknown_fsm,
  unknown_resource,
  unknown_service,
  unknown_port,
  unknown_property,
  unknown_type,
  type_mismatch,
  out_of_range,
  duplicate_name,
  loop_without_wait,
  bad_fsm,
  bad_period,
  configure_failed,
  not_configured,
  not_connected,
  not_running,
  already_running,
  faulted,
  not_reconfigurable,
  structural_property,
  adopt_refused,
  prepare_failed,
  timeout,
  wrong_revision,
  would_deadlock,
  realtime_denied,
  plugin,
  io,
  internal,
};

/// A code as users read it, and the constant of mauve_msgs/msg/ReplyCode that a request which it refuses is answered with.
struct ErrorWords {
  ErrorCode code;
  std::string_view name;
  std::string_view reply;
};

/// One line a code, in their order.
inline constexpr auto kErrors = std::to_array<ErrorWords>({
    {ErrorCode::invalid_argument, "invalid_argument", "INVALID"},
    {ErrorCode::unknown_component, "unknown_component", "UNKNOWN_COMPONENT"},
    {ErrorCode::unknown_core, "unknown_core", "UNKNOWN_CORE"},
    {ErrorCode::undeclared_core, "undeclared_core", "UNDECLARED_CORE"},
    {ErrorCode::unknown_shell, "unknown_shell", "UNKNOWN_CORE"},
    {ErrorCode::unknown_fsm, "unknown_fsm", "UNKNOWN_CORE"},
    {ErrorCode::unknown_resource, "unknown_resource", "INVALID"},
    {ErrorCode::unknown_service, "unknown_service", "INVALID"},
    {ErrorCode::unknown_port, "unknown_port", "INVALID"},
    {ErrorCode::unknown_property, "unknown_property", "INVALID"},
    {ErrorCode::unknown_type, "unknown_type", "INVALID"},
    {ErrorCode::type_mismatch, "type_mismatch", "INVALID"},
    {ErrorCode::out_of_range, "out_of_range", "INVALID"},
    {ErrorCode::duplicate_name, "duplicate_name", "INVALID"},
    {ErrorCode::loop_without_wait, "loop_without_wait", "PREPARE_FAILED"},
    {ErrorCode::bad_fsm, "bad_fsm", "PREPARE_FAILED"},
    {ErrorCode::bad_period, "bad_period", "INVALID"},
    {ErrorCode::configure_failed, "configure_failed", "PREPARE_FAILED"},
    {ErrorCode::not_configured, "not_configured", "NOT_ACTIVE"},
    {ErrorCode::not_connected, "not_connected", "INVALID"},
    {ErrorCode::not_running, "not_running", "NOT_RUNNING"},
    {ErrorCode::already_running, "already_running", "ALREADY_RUNNING"},
    {ErrorCode::faulted, "faulted", "FAULTED"},
    {ErrorCode::not_reconfigurable, "not_reconfigurable", "NOT_RECONFIGURABLE"},
    {ErrorCode::structural_property, "structural_property", "NOT_RECONFIGURABLE"},
    {ErrorCode::adopt_refused, "adopt_refused", "ADOPT_REFUSED"},
    {ErrorCode::prepare_failed, "prepare_failed", "PREPARE_FAILED"},
    {ErrorCode::timeout, "timeout", "TIMEOUT"},
    {ErrorCode::wrong_revision, "wrong_revision", "WRONG_REVISION"},
    {ErrorCode::would_deadlock, "would_deadlock", "PREPARE_FAILED"},
    {ErrorCode::realtime_denied, "realtime_denied", "PREPARE_FAILED"},
    {ErrorCode::plugin, "plugin", "PREPARE_FAILED"},
    {ErrorCode::io, "io", "PREPARE_FAILED"},
    {ErrorCode::internal, "internal", "PREPARE_FAILED"},
});

/// Name of a code, e.g. "unknown_port". [rt]
constexpr std::string_view to_string(ErrorCode code) MAUVE_RT {
  return kErrors[static_cast<std::size_t>(code)].name;
}

static_assert(
    [] {
      std::size_t next = 0;
      for (const ErrorWords& words : kErrors)
        if (static_cast<std::size_t>(words.code) != next++) return false;
      return next == static_cast<std::size_t>(ErrorCode::internal) + 1;
    }(),
    "each code has its line");

/// Where an error happened and how to mend it; every field may be empty.
struct ErrorDetail {
  std::string component{};
  std::string element{};
  std::string expected{};
  std::string found{};
  std::string remedy{};
  int step{0};  // of a transaction, from 1; 0: none
  std::string step_name{};
};

/// The kernel's one exception class. what() is one line made of all fields.
class Error : public std::runtime_error {
 public:
  Error(ErrorCode code, const std::string& what, ErrorDetail detail = {});

  /// [rt]
  ErrorCode code() const MAUVE_RT { return code_; }
  const ErrorDetail& detail() const MAUVE_RT { return detail_; }
  /// The bare statement, without where, expected, found and remedy. [rt]
  const std::string& statement() const MAUVE_RT { return statement_; }

 private:
  ErrorCode code_;
  std::string statement_;
  ErrorDetail detail_;
};

/// What the exception being handled says, whatever was thrown. [non-rt], in a handler
std::string caught_text();

/// "a, b, c" of any range of strings; "none" when empty. [non-rt]
template <typename Range>
std::string join(const Range& words) {
  std::string joined;
  for (const auto& word : words) joined += (joined.empty() ? "" : ", ") + std::string(word);
  return joined.empty() ? "none" : joined;
}

}  // namespace mauve
