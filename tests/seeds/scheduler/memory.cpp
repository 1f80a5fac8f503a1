// SPDX-License-Identifier: LGPL-3.0-or-later
// Under the seeded scheduler no memory is prefaulted or locked: a page fault takes no virtual time, and both took a seventh of a run.
#include <malloc.h>
#include <sys/mman.h>

#include "base/prefault.hpp"

namespace mauve {

void prefault(void* /*from*/, std::size_t /*bytes*/) noexcept {}
void note_allocated_before() noexcept {}
void prefault_allocated() noexcept {}

}  // namespace mauve

// The kernel finds these before those of the system.
extern "C" int mlockall(int /*flags*/) noexcept { return 0; }
extern "C" int munlockall() noexcept { return 0; }
/// What the allocator has in use depends on the runs before this one.
extern "C" struct mallinfo2 mallinfo2() noexcept { return {}; }
