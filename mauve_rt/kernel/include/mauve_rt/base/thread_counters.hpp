// SPDX-License-Identifier: LGPL-3.0-or-later
// What a component's thread should not do after its start, counted: allocations and page faults.
#pragma once

#include <sys/types.h>

#include <atomic>
#include <cstdint>
#include <string_view>

#include "mauve_rt/base/rt.hpp"

namespace mauve {

/// Whose allocations the counters see. Counted are the C++ operators new of whatever is bound to libmauve_rt's;
/// malloc, called directly by C code or the interpreter, never is.
enum class AllocationCounting : std::uint8_t {
  none,  // a sanitizer's, or the program's own operators took the place of ours
  some,  // the kernel's, the plug-ins' and what they inline: the C++ library itself was loaded and bound earlier,
         // as in a Python process; LD_PRELOAD=libmauve_rt.so makes it all
  all,  // the C++ library's too (streams, memory resources)
};

/// "none", "some", "all" [rt]
std::string_view to_string(AllocationCounting counting) MAUVE_RT;

/// Found out by trying. [non-rt]
AllocationCounting allocation_counting();

/// Allocations and page faults of one thread since its last start.
///
/// | member           | written by | read by | order                                                              |
/// | ---------------- | ---------- | ------- | ------------------------------------------------------------------ |
/// | allocations_     | the thread | anyone  | relaxed: a count stands for itself                                 |
/// | faults_at_mark_  | the thread | anyone  | relaxed: likewise                                                  |
/// | faults_at_end_   | the thread | anyone  | through thread_                                                    |
/// | thread_          | the thread | anyone  | release/acquire: who finds it 0 after it was set sees faults_at_end_ |
class ThreadCounters {
 public:
  ThreadCounters() = default;
  /// Detaches where the calling thread is the one attached; any other must have detached or ended.
  ~ThreadCounters();
  ThreadCounters(const ThreadCounters&) = delete;
  ThreadCounters& operator=(const ThreadCounters&) = delete;

  /// Counts what the calling thread does from here on. [setup]
  void attach() noexcept;
  /// Counts are from here on; the attached thread only, at each start. [rt], but for one getrusage.
  void mark() noexcept;
  /// The attached thread counts no more, and may end; the figures stay. [non-rt]
  void detach() noexcept;

  /// Calls of operator new. [rt]
  std::uint64_t allocations() const MAUVE_RT { return allocations_.load(std::memory_order_relaxed); }
  /// Page faults, minor and major; asked of the system, so that the thread itself pays nothing. [non-rt]
  std::uint64_t page_faults() const noexcept;

 private:
  std::atomic<std::uint64_t> allocations_{0};
  std::atomic<std::uint64_t> faults_at_mark_{0};
  std::atomic<std::uint64_t> faults_at_end_{0};
  std::atomic<pid_t> thread_{0};  // 0: none attached
};

}  // namespace mauve
