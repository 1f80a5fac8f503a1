// SPDX-License-Identifier: LGPL-3.0-or-later
// What rcl says when it refuses, as this project's errors.
#pragma once

#include <rcl/context.h>
#include <rcl/types.h>

#include <string>

namespace mauve::bridge {

/// rcl's last message, without the source line; clears it.
std::string take_rcl_message();

/// Throws Error (invalid_argument) unless rcl said it went well. [non-rt]
void check(rcl_ret_t outcome, const std::string& what, const std::string& element);

/// Whether rcl or rmw did it; what they say otherwise is for nobody. [non-rt]
bool went_well(rcl_ret_t outcome);

enum class Waited { well, failed, for_the_last_time };

/// How a wait ended: after the last one the context was shut down. After a failure the thread pauses, and waits again: what it
/// receives is lost for as long, not for good. Logs the error, every 10 s at most. [non-rt]
Waited after_wait(rcl_ret_t outcome, const rcl_context_t& context);

}  // namespace mauve::bridge
