// SPDX-License-Identifier: LGPL-3.0-or-later
// What a component is at: told by its own thread on entering a state, so that it is seen also while that lasts.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "mauve_rt/base/seam/atomic.hpp"
#include "mauve_rt/base/time.hpp"

namespace mauve {

/// How long a component's present state lasts, at the moment somebody looked.
struct StateAge {
  std::string state;      // executed or waited in, or the last one; empty before the first start
  time_ns_t age_ns{0};    // of an execution since it began, of a wait past its pending instant; 0: parked
  time_ns_t bound_ns{0};  // its declared max_execution; 0: none, or a wait
  time_ns_t hung_after_ns{0};  // an older state is told as hung
  bool is_wait{false};

  /// [rt]
  bool is_hung() const MAUVE_RT { return age_ns > hung_after_ns; }
};

/// The state that a machine is in. One writer, the machine's thread; any number of readers, who cannot delay it.
///
/// | member    | order                                                                                              |
/// | --------- | -------------------------------------------------------------------------------------------------- |
/// | since_ns_ | release: kChanging is seen by who sees any of the others new; acquire: the others are read after it |
/// | bound_ns_ | release: as above; acquire: since_ns_ is read again only after them                                |
/// | what_     | likewise                                                                                           |
class PresentState {
 public:
  struct Fact {
    time_ns_t since_ns{0};  // when an execution began, or a wait's pending instant; 0: parked
    time_ns_t bound_ns{0};  // the execution's declared bound; 0: none
    std::uint32_t name{0};  // in TraceNames; 0: none yet
    bool is_wait{false};
  };

  /// At every boundary of states. [rt] wait-free.
  void tell(const Fact& fact) MAUVE_RT {
    since_ns_.store(kChanging, std::memory_order_release);
    bound_ns_.store(fact.bound_ns, std::memory_order_release);
    what_.store(fact.name | (fact.is_wait ? kWait : 0), std::memory_order_release);
    since_ns_.store(fact.since_ns, std::memory_order_release);
  }

  /// Nothing when the state was changing at each of some looks. [rt] wait-free: who looks may be more urgent than the
  /// writer, and keep it from ending what it writes.
  std::optional<Fact> look() const MAUVE_RT {
    constexpr int kAttempts = 100;
    for (int attempt = 0; attempt < kAttempts; ++attempt) {
      const time_ns_t since_ns = since_ns_.load(std::memory_order_acquire);
      const time_ns_t bound_ns = bound_ns_.load(std::memory_order_acquire);
      const std::uint64_t what = what_.load(std::memory_order_acquire);
      if (since_ns == kChanging || since_ns_.load(std::memory_order_acquire) != since_ns) continue;
      return Fact{since_ns, bound_ns, static_cast<std::uint32_t>(what), (what & kWait) != 0};
    }
    return std::nullopt;
  }

  /// The name of the state alone, by the writer's own thread. [rt]
  std::uint32_t name() const MAUVE_RT {
    return static_cast<std::uint32_t>(what_.load(std::memory_order_relaxed));  // relaxed: its own write
  }

 private:
  static constexpr time_ns_t kChanging = -1;
  static constexpr std::uint64_t kWait = std::uint64_t{1} << 32U;  // beside the name

  Atomic<time_ns_t> since_ns_{0};  // two states never begin at one instant: it tells one from the next
  Atomic<time_ns_t> bound_ns_{0};
  Atomic<std::uint64_t> what_{0};
};

}  // namespace mauve
