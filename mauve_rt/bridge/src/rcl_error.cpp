// SPDX-License-Identifier: LGPL-3.0-or-later
#include "rcl_error.hpp"

#include <rcl/error_handling.h>
#include <rcutils/logging_macros.h>

#include "mauve_rt/base/error.hpp"
#include "mauve_rt/base/seam/sleep.hpp"
#include "mauve_rt/base/time.hpp"

namespace mauve::bridge {

namespace {

constexpr time_ns_t kPauseAfterFailure = ms_to_ns(50);
constexpr int kLogEveryMs = 10'000;

}  // namespace

std::string take_rcl_message() {
  std::string message = rcl_get_error_string().str;
  rcl_reset_error();
  return message.substr(0, message.find(", at "));
}

bool went_well(rcl_ret_t outcome) {
  if (outcome != RCL_RET_OK) rcl_reset_error();
  return outcome == RCL_RET_OK;
}

Waited after_wait(rcl_ret_t outcome, const rcl_context_t& context) {
  if (outcome == RCL_RET_TIMEOUT) rcl_reset_error();
  if (outcome == RCL_RET_OK || outcome == RCL_RET_TIMEOUT) return Waited::well;
  const std::string message = take_rcl_message();
  if (!rcl_context_is_valid(&context)) return Waited::for_the_last_time;
  RCUTILS_LOG_ERROR_THROTTLE_NAMED(rcutils_steady_time_now, kLogEveryMs, "bridge",
                                   "waiting for messages and requests failed, and is tried again: %s",
                                   message.c_str());
  sleep_for(kPauseAfterFailure);
  return Waited::failed;
}

void check(rcl_ret_t outcome, const std::string& what, const std::string& element) {
  if (outcome == RCL_RET_OK) return;
  throw Error(ErrorCode::invalid_argument, what, {.element = element, .found = take_rcl_message()});
}

}  // namespace mauve::bridge
