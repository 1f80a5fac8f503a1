// SPDX-License-Identifier: LGPL-3.0-or-later
// Lets the middleware of wheels wait by CLOCK_MONOTONIC, so that a step of CLOCK_REALTIME holds up no service.
#pragma once

namespace mauve::bridge {

/// Redirect waits with a deadline of CLOCK_REALTIME to CLOCK_MONOTONIC, in the libraries that are loaded now.
/// Once the middleware is loaded and before its first participant: waits that have begun stay as they are.
/// Wheels are built for an old glibc. It has no wait by CLOCK_MONOTONIC, so their std::condition_variable turns a
/// steady deadline into one of CLOCK_REALTIME: after a step back by 60 s each wait lasts 60 s longer. A preloaded
/// library would do the same, but each start would need a second process image, and children would inherit it. [setup]
void wait_by_the_monotonic_clock() noexcept;

}  // namespace mauve::bridge
