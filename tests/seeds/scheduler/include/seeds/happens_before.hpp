// SPDX-License-Identifier: LGPL-3.0-or-later
// What ThreadSanitizer has to know of the seam. It does not see the baton: else nothing would be a race, as one thread runs at a time.
#pragma once

#if defined(MAUVE_SEES_RACES)
extern "C" void __tsan_acquire(void* address);
extern "C" void __tsan_release(void* address);
#endif

namespace mauve::seeds {

/// All that released() was called after, by the same address, has happened before what the caller does from now on.
inline void acquired([[maybe_unused]] const void* address) noexcept {
#if defined(MAUVE_SEES_RACES)
  __tsan_acquire(const_cast<void*>(address));
#endif
}
inline void released([[maybe_unused]] const void* address) noexcept {
#if defined(MAUVE_SEES_RACES)
  __tsan_release(const_cast<void*>(address));
#endif
}

}  // namespace mauve::seeds
