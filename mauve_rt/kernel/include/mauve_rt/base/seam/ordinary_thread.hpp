// SPDX-License-Identifier: LGPL-3.0-or-later
// OrdinaryThread: a thread that runs a callable, with what the system gives a thread.
#pragma once

#include <thread>

namespace mauve {

/// Throws std::system_error where there are no threads to be had. With a name, a priority or blocked signals: Thread.
using OrdinaryThread = std::thread;

}  // namespace mauve
