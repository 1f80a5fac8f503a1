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

/// Each code has its meaning, then the remedy.
enum class ErrorCode : std::uint16_t {
  /// A value or a combination of values has the wrong form. Correct the element that the message names.
  invalid_argument,
  /// The architecture has no component of this name. Correct the name, or add the component.
  unknown_component,
  /// No core of this name is registered. Correct the name, or install its package.
  unknown_core,
  /// The core is installed, but not among the alternatives of the component. Add the core to `alternatives`.
  undeclared_core,
  /// No shell of this name is registered. Correct the name, or install its package.
  unknown_shell,
  /// No fsm of this name is registered. Correct the name, or install its package.
  unknown_fsm,
  /// The architecture has no resource, or the registry no kind of resource, of this name. Correct the name.
  unknown_resource,
  /// The resource has no service of this name. Connect to one of the services that the message lists.
  unknown_service,
  /// The shell has no port of this name. Use one of the ports that the message lists.
  unknown_port,
  /// The component has no property of this name. Use one of the properties that the message lists.
  unknown_property,
  /// No library registered a type of this name. Correct the name, or install the package of the type.
  unknown_type,
  /// Two elements that belong together have different types. Give both elements the type that the message expects.
  type_mismatch,
  /// Two connected elements declare different frames. Connect another resource, read it by a TransformedReadPort, or correct a frame.
  frame_mismatch,
  /// A number is outside its range. Choose a number within the range that the message names.
  out_of_range,
  /// The name is already in use. Choose another name, or remove the element that has it.
  duplicate_name,
  /// The fsm has a loop without a wait, so its clock would stand still. Add a wait to the loop.
  loop_without_wait,
  /// The states or transitions of the fsm are wrong. Correct the state that the message names.
  bad_fsm,
  /// The period does not fit the cycles of the fsm. Choose a period that the message allows, or leave it out.
  bad_period,
  /// A part reported a failure from its configure function. Correct the cause that the message names.
  configure_failed,
  /// The component or the executor is not configured. Configure it first.
  not_configured,
  /// A required port has no connection. Connect the port, or declare it optional in the shell.
  not_connected,
  /// The component does not run. Start the component first.
  not_running,
  /// The component already runs. Stop the component first.
  already_running,
  /// The component is FAULTED. Replace its core or configure the component, then start it.
  faulted,
  /// The architecture file protects the component. Set `reconfigurable: true` in the file.
  not_reconfigurable,
  /// A part reads the property only when it is configured. Replace that part in the same transaction.
  structural_property,
  /// The new part refused to take over. Correct the cause that the part reports, then ask again.
  adopt_refused,
  /// A new part could not be made. Correct the cause that the message names.
  prepare_failed,
  /// A state did not end in time. Ask again with a longer time-out, or with `force`.
  timeout,
  /// The architecture changed since the caller read its revision. Read the architecture, then ask again.
  wrong_revision,
  /// A component, or a hook inside a change, asks for a change and would wait for itself. Ask from an ordinary thread.
  would_deadlock,
  /// The system refused real-time rights. Grant the rights that the message names.
  realtime_denied,
  /// A plug-in cannot be loaded or is declared wrongly. Correct or install the package that the message names.
  plugin,
  /// The system refused to read or write. Correct the cause that the message names.
  io,
  /// The system refused a thread or a lock, or a part threw an unexpected exception. Correct the cause that the message names.
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
    {ErrorCode::frame_mismatch, "frame_mismatch", "INVALID"},
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
