// SPDX-License-Identifier: LGPL-3.0-or-later
// What a component is at: told by its own thread on entering a state, so that it is seen also while that lasts.
#pragma once

#include <optional>
#include <string>

#include "mauve_rt/sequence_cell.hpp"
#include "mauve_rt/time.hpp"

namespace mauve {

/// How long a component's present state lasts, at the moment somebody looked.
struct StateAge {
  std::string state;      // executed or waited in, or the last one; empty before the first start
  time_ns_t age_ns{0};    // of an execution since it began, of a wait past its pending instant; 0: parked
  time_ns_t bound_ns{0};  // its declared max_execution; 0: none, or a wait
  time_ns_t hung_after_ns{0};  // an older state is told as hung
  bool is_wait{false};

  bool is_hung() const noexcept { return age_ns > hung_after_ns; }
};

/// The state that a machine is in. One writer, the machine's thread; any number of readers, who cannot delay it.
class PresentState {
 public:
  struct Fact {
    time_ns_t since_ns{0};  // when an execution began, or a wait's pending instant; 0: parked
    time_ns_t bound_ns{0};  // the execution's declared bound; 0: none
    std::uint32_t name{0};  // in TraceNames; 0: none yet
    bool is_wait{false};
  };

  /// At every boundary of states. [rt] wait-free.
  void tell(const Fact& fact) noexcept { cell_.store(fact, 0, ++told_); }

  /// Nothing when the state was changing at each of some looks. [rt] wait-free: who looks may be more urgent than the
  /// writer, and keep it from ending what it writes.
  std::optional<Fact> look() const noexcept {
    constexpr int kAttempts = 100;
    Fact fact;
    time_ns_t unused = 0;
    std::uint64_t sequence = 0;
    for (int attempt = 0; attempt < kAttempts; ++attempt) {
      if (cell_.load(fact, unused, sequence)) return fact;
    }
    return std::nullopt;
  }

 private:
  SequenceCell<Fact> cell_;
  std::uint64_t told_{0};  // the writer's own
};

}  // namespace mauve
