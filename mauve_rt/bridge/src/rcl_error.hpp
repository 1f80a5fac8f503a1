// SPDX-License-Identifier: LGPL-3.0-or-later
// What rcl says when it refuses, as this project's errors.
#pragma once

#include <rcl/types.h>

#include <string>

namespace mauve::bridge {

/// rcl's last message, without the source line; clears it.
std::string take_rcl_message();

/// Throws Error (invalid_argument) unless rcl said it went well. [non-rt]
void check(rcl_ret_t outcome, const std::string& what, const std::string& element);

/// Whether rcl or rmw did it; what they say otherwise is for nobody. [non-rt]
bool went_well(rcl_ret_t outcome);

}  // namespace mauve::bridge
