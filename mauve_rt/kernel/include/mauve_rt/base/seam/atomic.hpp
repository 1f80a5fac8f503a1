// SPDX-License-Identifier: LGPL-3.0-or-later
// Atomic: the std::atomic of the kernel and the rules. The seeded scheduler of tests/seeds has its own, which may switch threads.
#pragma once

#include <atomic>

namespace mauve {

template <typename T>
using Atomic = std::atomic<T>;

}  // namespace mauve
