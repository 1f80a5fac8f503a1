// SPDX-License-Identifier: LGPL-3.0-or-later
// The kinds of feeds, a file each.
#pragma once

#include <memory>
#include <string>

#include "mauve_rt/rules/feeds.hpp"

namespace mauve::rules {

enum class Heard { writes, writes_and_arrivals };
/// Of the writes to a resource, or also of messages for it that are not written yet. [setup] Throws Error (unknown_resource).
std::unique_ptr<Feed> open_write_feed(const std::string& resource, Heard what, Signal& signal,
                                      const FeedPlace& place);
/// Of a number in what is written to a resource. [setup] Throws Error: unknown_resource; invalid_argument: there is none.
std::unique_ptr<Feed> open_field_feed(const std::string& resource, const std::string& path, Signal& signal,
                                      const FeedPlace& place);
/// Of the goals of an action: whether the last one was aborted (detail `aborted`), or which one executes (`overdue`).
/// [setup] Throws Error: unknown_resource; invalid_argument: the resource has no goals.
std::unique_ptr<Feed> open_goal_feed(const std::string& resource, const std::string& detail, Signal& signal,
                                     const FeedPlace& place);
/// Of the changes of the whole architecture. [setup]
std::unique_ptr<Feed> open_change_feed(Signal& signal, const FeedPlace& place);

}  // namespace mauve::rules
