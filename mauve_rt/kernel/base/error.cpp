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
