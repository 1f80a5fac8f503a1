// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/base/error.hpp"

namespace mauve {

namespace {

std::string one_line(const std::string& what, const ErrorDetail& detail) {
  std::string line;
  if (detail.step != 0) {
    line += "step " + std::to_string(detail.step);
    line += (detail.step_name.empty() ? "" : " (" + detail.step_name + ")") + ": ";
  }
  if (!detail.component.empty()) line += "component '" + detail.component + "': ";
  if (!detail.element.empty()) line += detail.element + ": ";
  line += what;
  if (!detail.expected.empty()) line += "; expected " + detail.expected;
  if (!detail.found.empty()) line += ", found " + detail.found;
  if (!detail.remedy.empty()) line += "; " + detail.remedy;
  return line;
}

}  // namespace

std::string_view to_string(ErrorCode code) noexcept {
  switch (code) {
    case ErrorCode::invalid_argument:
      return "invalid_argument";
    case ErrorCode::unknown_component:
      return "unknown_component";
    case ErrorCode::unknown_core:
      return "unknown_core";
    case ErrorCode::undeclared_core:
      return "undeclared_core";
    case ErrorCode::unknown_shell:
      return "unknown_shell";
    case ErrorCode::unknown_fsm:
      return "unknown_fsm";
    case ErrorCode::unknown_resource:
      return "unknown_resource";
    case ErrorCode::unknown_service:
      return "unknown_service";
    case ErrorCode::unknown_port:
      return "unknown_port";
    case ErrorCode::unknown_property:
      return "unknown_property";
    case ErrorCode::unknown_type:
      return "unknown_type";
    case ErrorCode::type_mismatch:
      return "type_mismatch";
    case ErrorCode::out_of_range:
      return "out_of_range";
    case ErrorCode::duplicate_name:
      return "duplicate_name";
    case ErrorCode::loop_without_wait:
      return "loop_without_wait";
    case ErrorCode::bad_fsm:
      return "bad_fsm";
    case ErrorCode::bad_period:
      return "bad_period";
    case ErrorCode::configure_failed:
      return "configure_failed";
    case ErrorCode::not_configured:
      return "not_configured";
    case ErrorCode::not_connected:
      return "not_connected";
    case ErrorCode::not_running:
      return "not_running";
    case ErrorCode::already_running:
      return "already_running";
    case ErrorCode::faulted:
      return "faulted";
    case ErrorCode::not_reconfigurable:
      return "not_reconfigurable";
    case ErrorCode::structural_property:
      return "structural_property";
    case ErrorCode::adopt_refused:
      return "adopt_refused";
    case ErrorCode::prepare_failed:
      return "prepare_failed";
    case ErrorCode::timeout:
      return "timeout";
    case ErrorCode::wrong_revision:
      return "wrong_revision";
    case ErrorCode::would_deadlock:
      return "would_deadlock";
    case ErrorCode::realtime_denied:
      return "realtime_denied";
    case ErrorCode::plugin:
      return "plugin";
    case ErrorCode::io:
      return "io";
    case ErrorCode::internal:
      return "internal";
  }
  return "internal";
}

Error::Error(ErrorCode code, const std::string& what, ErrorDetail detail)
    : std::runtime_error(one_line(what, detail)), code_(code), statement_(what), detail_(std::move(detail)) {}

std::string caught_text() {
  try {
    throw;
  } catch (const std::exception& failure) {
    return failure.what();
  } catch (...) {
    return "an exception that is no std::exception";
  }
}

}  // namespace mauve
