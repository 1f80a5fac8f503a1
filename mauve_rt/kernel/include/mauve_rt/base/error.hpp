// SPDX-License-Identifier: LGPL-3.0-or-later
// Typed errors: what, where, expected, found and the remedy.
#pragma once

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

/// Name of a code as users read it, e.g. "unknown_port". [rt]
std::string_view to_string(ErrorCode code) MAUVE_RT;

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
