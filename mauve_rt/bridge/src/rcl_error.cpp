// SPDX-License-Identifier: LGPL-3.0-or-later
#include "rcl_error.hpp"

#include <rcl/error_handling.h>

#include "mauve_rt/base/error.hpp"

namespace mauve::bridge {

std::string take_rcl_message() {
  std::string message = rcl_get_error_string().str;
  rcl_reset_error();
  return message.substr(0, message.find(", at "));
}

bool went_well(rcl_ret_t outcome) {
  if (outcome != RCL_RET_OK) rcl_reset_error();
  return outcome == RCL_RET_OK;
}

void check(rcl_ret_t outcome, const std::string& what, const std::string& element) {
  if (outcome == RCL_RET_OK) return;
  throw Error(ErrorCode::invalid_argument, what, {.element = element, .found = take_rcl_message()});
}

}  // namespace mauve::bridge
