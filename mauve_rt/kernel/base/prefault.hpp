// SPDX-License-Identifier: LGPL-3.0-or-later
// Prefaulting: what a component will touch is put into memory before it does, by who prepares it.
#pragma once

#include <cstddef>

namespace mauve {

/// Puts these pages into memory, which must stay mapped meanwhile; what they hold stays. [non-rt]
void prefault(void* from, std::size_t bytes) noexcept;

/// Tells prefault_allocated() apart what the process has by now: interpreter, middleware, ... The first call counts.
/// [non-rt]
void note_allocated_before() noexcept;

/// Puts into memory what the allocator has taken from the system since: with it all that parts have allocated, in their
/// constructors or in configure, whether they have touched it or not. No kernel can tell who owns which allocation;
/// so this is for the process, not for one part. Left alone: threads' stacks, mappings of files, shared memory, and
/// single mappings over 1 GiB (reserved, hardly meant to be used). Bigger parts of the main heap and of the allocator's
/// arenas that were there before are included: new parts get their memory there too. Cheap while the process has not
/// grown since the last call: then it only asks which pages are missing, 1 ns a page (of the shared page of zeros it is
/// told that it is there). [non-rt]
void prefault_allocated() noexcept;

}  // namespace mauve
