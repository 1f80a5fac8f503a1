// SPDX-License-Identifier: LGPL-3.0-or-later
// Which waits of two fsms stand for each other, so that a component keeps its place when one fsm replaces the other.
#pragma once

#include <vector>

#include "mauve_rt/base/time.hpp"
#include "mauve_rt/run/machine.hpp"

namespace mauve {

/// Waits of the same name and kind (time or event) of `before` and of `now`, as far as the wait of `now` has a fixed place
/// within a period of `now`. [non-rt] Both fsms are configured.
std::vector<KeptWait> kept_waits(const FsmBase& before, const FsmBase& now, time_ns_t period_ns);

/// Refuses two fsms that do not keep every place of each other: an fsm on probation is to go out at any wait. [non-rt] Throws
/// Error (bad_fsm, bad_period). Both fsms are configured.
void require_places_kept(const FsmBase& before, time_ns_t period_before_ns, const FsmBase& now,
                         time_ns_t period_ns);

}  // namespace mauve
