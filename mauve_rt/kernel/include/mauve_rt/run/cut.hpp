// SPDX-License-Identifier: LGPL-3.0-or-later
// The cut of a change: one atomic word that says whether it is made, and from which instant on.
#pragma once

#include <algorithm>
#include <cstdint>

#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/base/seam/atomic.hpp"
#include "mauve_rt/base/time.hpp"

namespace mauve {

/// What the cut holds at a moment: the frontier, and whether it is decided.
///
/// The frontier is the latest clock at which a participant began to execute with old parts.
struct CutWord {
  std::uint64_t bits{0};  // frontier << 2 | off << 1 | closed

  static constexpr std::uint64_t kClosed = 1, kOff = 2;
  static constexpr unsigned kFlags = 2;  // bits
  /// Clocks are held between 0 and this: 73 years of nanoseconds.
  static constexpr time_ns_t kLastClock = kForever / 4;

  /// An open one with this frontier. [rt]
  static constexpr CutWord open_at(time_ns_t clock_ns) MAUVE_RT {
    const time_ns_t held = clock_ns < 0 ? 0 : clock_ns > kLastClock ? kLastClock : clock_ns;
    return {static_cast<std::uint64_t>(held) << kFlags};
  }
  /// [rt]
  constexpr bool is_open() const MAUVE_RT { return (bits & (kClosed | kOff)) == 0; }
  /// The change is made. [rt]
  constexpr bool is_closed() const MAUVE_RT { return (bits & kClosed) != 0; }
  /// The change was called off. [rt]
  constexpr bool is_off() const MAUVE_RT { return (bits & kOff) != 0; }
  /// [rt]
  constexpr time_ns_t frontier_ns() const MAUVE_RT { return static_cast<time_ns_t>(bits >> kFlags); }
  /// T: of a closed one, the first instant that belongs to the new parts. [rt]
  constexpr time_ns_t instant_ns() const MAUVE_RT { return frontier_ns() + 1; }
};

/// A participant raises the cut to a clock before it executes at that clock with old parts. close() makes the change,
/// call_off() ends it, and both are final. T and the decision are one word, so nothing can come between them.
///
/// Every exchange is acq_rel and every look acquires: a thread that sees the word decided sees all that was written before
/// the decision. A raise that has nothing to raise writes nothing and publishes nothing: the count of the votes does that.
///
/// The checked close (close_if) is of a change that is made only while no participant has a job pending: who closes looks at the
/// cut first, then at each participant, and closes only if the word is still the one that it saw. An open word never comes back,
/// since its frontier only grows. So nothing was executed in between by whoever raises the cut first.
class Cut {
 public:
  constexpr explicit Cut(CutWord word = {}) noexcept : word_(word.bits) {}

  /// [rt]
  CutWord look() const MAUVE_RT { return {word_.load(std::memory_order_acquire)}; }

  /// Raises an open cut to this clock, if it is not there yet. Returns what the cut is then: open, with the clock not
  /// beyond its frontier, so the clock belongs to the old parts; or decided. [rt]
  CutWord raise(time_ns_t clock_ns) MAUVE_RT {
    const CutWord raised = CutWord::open_at(clock_ns);
    CutWord seen = look();
    while (seen.is_open() && seen.frontier_ns() < raised.frontier_ns()) {
      if (exchange(seen, raised)) return raised;
    }
    return seen;
  }

  /// The same, to a frontier that is later than the present one in any case: of a clock that may lie before the frontier although no
  /// participant was seen to have it pending. [rt]
  CutWord raise_always(time_ns_t clock_ns) MAUVE_RT {
    CutWord seen = look();
    while (seen.is_open()) {
      const CutWord raised = CutWord::open_at(std::max(clock_ns, seen.instant_ns()));
      if (exchange(seen, raised)) return raised;
    }
    return seen;
  }

  /// By the last vote. Returns what the cut is then: closed or off. [rt]
  CutWord close() MAUVE_RT {
    CutWord seen = look();
    while (seen.is_open()) {
      const CutWord closed{seen.bits | CutWord::kClosed};
      if (exchange(seen, closed)) return closed;
    }
    return seen;
  }

  /// Closes the cut if it is still this word, which was open. Whether this call did it. [rt]
  bool close_if(CutWord seen) MAUVE_RT {
    // strong: one that fails without a cause would lose an idle instant
    return word_.compare_exchange_strong(seen.bits, seen.bits | CutWord::kClosed, std::memory_order_acq_rel,
                                         std::memory_order_acquire);
  }

  /// Whether this call did it: false when the change is made, or was called off before. [rt]
  bool call_off() MAUVE_RT {
    CutWord seen = look();
    while (seen.is_open()) {
      if (exchange(seen, {seen.bits | CutWord::kOff})) return true;
    }
    return false;
  }

 private:
  bool exchange(CutWord& seen, CutWord to) MAUVE_RT {
    return word_.compare_exchange_weak(seen.bits, to.bits, std::memory_order_acq_rel,
                                       std::memory_order_acquire);
  }

  Atomic<std::uint64_t> word_;
};

}  // namespace mauve
