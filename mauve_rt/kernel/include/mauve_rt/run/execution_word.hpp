// SPDX-License-Identifier: LGPL-3.0-or-later
// Who ends an execution: the thread that runs it, or who times it out. One atomic word decides.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>

#include "mauve_rt/base/contract.hpp"
#include "mauve_rt/base/seam/atomic.hpp"
#include "mauve_rt/base/seam/futex.hpp"
#include "mauve_rt/base/time.hpp"

namespace mauve {

/// The executions of one component, one after another. A watched one has a number of its own, and a bound, a budget of CPU time,
/// or both.
///
/// The component's thread enters its fsm, leaves it, and in between begins and ends what is watched: a state with a bound or a
/// budget, and an adopt or take of a commit. The watchdog, or a commit's requester, times out exactly the watched execution that is over
/// its bound; a stop by force times out all that the thread does between entering and leaving. All change the word by
/// compare-and-exchange: who comes first has decided, and the other one finds so. The thread finds out where it ends the
/// watched execution, begins the next one, or leaves the fsm. So a state without a bound costs nothing here; who times it
/// out has ordered a stop before, which the thread sees when the state ends, and then it leaves. The thread of an execution
/// that timed out waits, on coming back, until the time-out is complete; who removes its component meanwhile abandons it.
///
/// The word is the phase, whether the thread is in its fsm (kEntered), and a number that grows with every entry and begin.
///
/// | from             | to               | by                                                                      |
/// | ---------------- | ---------------- | ----------------------------------------------------------------------- |
/// | idle             | idle, entered, +1| the thread: it starts                                                   |
/// | idle, entered    | idle             | the thread: it parks                                                    |
/// | idle             | running, + 1     | the thread                                                              |
/// | running          | idle             | the thread: it ended                                                    |
/// | running          | timed out        | the watchdog, who requests a commit, who stops by force                 |
/// | idle, entered    | timed out        | who stops by force                                                      |
/// | timed out        | demoted          | the same, when FAULTED is told, the thread demoted, the outputs written |
/// | demoted          | idle             | the thread: it came back                                                |
/// | demoted          | claimed          | who is about to remove the component, or to give it a new epoch         |
/// | claimed          | demoted          | the same, when the removal was refused, or the epoch was given          |
/// | claimed          | abandoned        | who removes it, when that is made                                       |
///
/// | member    | order                                                                                               |
/// | --------- | --------------------------------------------------------------------------------------------------- |
/// | word_     | begin: seq_cst, so that whoever looks sees the execution or the thread sees when the watchdog looks  |
/// |           | (Watchdog::wake_before_); else acq_rel: who changes it sees what the one before did                  |
/// | began_ns_ | release: who sees the new one, sees the end of the execution before, and then times out nothing       |
/// | limit_ns_ | likewise                                                                                             |
/// | budget_ns_| likewise                                                                                             |
/// | cpu_end_ns_| likewise; of an execution that is under way the thread sets it, once it has read its CPU clock      |
class ExecutionWord {
 public:
  /// An execution as somebody saw it.
  struct Look {
    std::uint32_t word;
    time_ns_t began_ns;
    time_ns_t limit_ns;   // kForever: it has a budget alone
    time_ns_t budget_ns;  // of CPU time; 0: none
    time_ns_t
        cpu_end_ns;  // what the thread's CPU clock shows when the budget is used up; kForever: it has yet to be read

    /// [rt]
    bool is_over(time_ns_t now_ns) const MAUVE_RT { return now_ns - began_ns > limit_ns; }
    /// Whether CPU time could be used up by then: a thread uses no more than passes. [rt]
    bool may_be_over_budget(time_ns_t now_ns) const MAUVE_RT {
      return budget_ns != 0 && now_ns - began_ns > budget_ns;
    }
    /// By the thread's CPU clock. [rt]
    time_ns_t cpu_left_ns(time_ns_t cpu_now_ns) const MAUVE_RT {
      return cpu_end_ns == kForever ? budget_ns : cpu_end_ns - cpu_now_ns;
    }
    /// The last instant at which it is over neither of them, whatever it does. [rt]
    time_ns_t end_ns() const MAUVE_RT { return ExecutionWord::end_ns(began_ns, limit_ns, budget_ns); }
  };
  /// The last instant at which it is not over its bound; with a budget, at which it can be over neither. [rt]
  static constexpr time_ns_t end_ns(time_ns_t began_ns, time_ns_t limit_ns, time_ns_t budget_ns = 0)
      MAUVE_RT {
    if (budget_ns != 0) limit_ns = std::min(limit_ns, budget_ns);
    return limit_ns < kForever - began_ns ? began_ns + limit_ns : kForever;
  }

  // ---- the component's thread

  /// It is in its fsm from now on. [rt]
  void enter() MAUVE_RT {
    const std::uint32_t before = word_.load(std::memory_order_relaxed);
    if ((before & kEntered) != 0) return;  // it restarts
    MAUVE_EXPECTS((before & kPhase) == kIdle);
    // A plain store: until it has entered nobody else changes an idle word. release: who times it out sees the start.
    word_.store((before + kNext) | kEntered, std::memory_order_release);
  }
  /// It has left, and ended what was under way; false when that timed out before. [rt]
  bool leave() MAUVE_RT {
    std::uint32_t word = word_.load(std::memory_order_relaxed);  // relaxed: the exchange has the last word
    return (word & kPhase) <= kRunning &&
           word_.compare_exchange_strong(word, word & ~(kPhase | kEntered), std::memory_order_acq_rel);
  }
  /// False when the thread has timed out. `budget_ns`: of CPU time, which set_cpu_end() follows; 0: none. [rt]
  bool begin(time_ns_t began_ns, time_ns_t limit_ns, time_ns_t budget_ns = 0) MAUVE_RT {
    began_ns_.store(began_ns, std::memory_order_release);
    limit_ns_.store(limit_ns, std::memory_order_release);
    budget_ns_.store(budget_ns, std::memory_order_release);
    cpu_end_ns_.store(kForever, std::memory_order_release);
    std::uint32_t before = word_.load(std::memory_order_relaxed);  // relaxed: the exchange has the last word
    return (before & kPhase) == kIdle &&
           word_.compare_exchange_strong(before, (before + kNext) | kRunning, std::memory_order_seq_cst);
  }
  /// When the budget of what has begun is used up, by the thread's CPU clock. [rt]
  void set_cpu_end(time_ns_t cpu_end_ns) MAUVE_RT {
    cpu_end_ns_.store(cpu_end_ns, std::memory_order_release);
  }
  /// False when it timed out before it ended; true also when none was under way. [rt]
  bool end() MAUVE_RT {
    std::uint32_t word = word_.load(std::memory_order_relaxed);  // relaxed: the exchange has the last word
    if ((word & kPhase) == kIdle) return true;
    return (word & kPhase) == kRunning &&
           word_.compare_exchange_strong(word, (word & ~kPhase) | kIdle, std::memory_order_acq_rel);
  }
  /// After one that timed out: waits until the time-out is complete; false when the component was removed meanwhile,
  /// and the thread is to end without another trace. [rt]
  bool come_back() MAUVE_RT {
    for (;;) {
      std::uint32_t word = word_.load(std::memory_order_acquire);
      const std::uint32_t phase = word & kPhase;
      if (phase == kAbandoned) return false;
      if (phase == kIdle) return true;
      if (phase != kDemoted) {
        futex_wait_until(word_, word, kForever);
      } else if (word_.compare_exchange_strong(word, word & ~(kPhase | kEntered),
                                               std::memory_order_acq_rel)) {
        return true;
      }
    }
  }

  /// Until who times it out has told FAULTED and written the outputs; also of one that has ended. [rt]
  void await_time_out() const MAUVE_RT {
    for (;;) {
      const std::uint32_t word = word_.load(std::memory_order_acquire);
      if ((word & kPhase) != kTimedOut) return;
      futex_wait_until(word_, word, kForever);
    }
  }

  // ---- who times it out

  /// The watched execution under way, or nothing. [rt]
  std::optional<Look> look() const MAUVE_RT {
    const std::uint32_t word = word_.load(std::memory_order_seq_cst);
    if ((word & kPhase) != kRunning) return std::nullopt;
    return Look{.word = word,
                .began_ns = began_ns_.load(std::memory_order_acquire),
                .limit_ns = limit_ns_.load(std::memory_order_acquire),
                .budget_ns = budget_ns_.load(std::memory_order_acquire),
                .cpu_end_ns = cpu_end_ns_.load(std::memory_order_acquire)};
  }
  /// The same, or whatever else the thread does in its fsm; its numbers say nothing then. [rt]
  std::optional<Look> look_at_any() const MAUVE_RT {
    const std::uint32_t word = word_.load(std::memory_order_acquire);
    if ((word & kPhase) != kRunning && (word & (kPhase | kEntered)) != kEntered) return std::nullopt;
    return Look{.word = word, .began_ns = 0, .limit_ns = kForever, .budget_ns = 0, .cpu_end_ns = kForever};
  }
  /// False when it has ended, or another one was first. [rt]
  bool time_out(const Look& execution) MAUVE_RT {
    std::uint32_t word = execution.word;
    return word_.compare_exchange_strong(word, (word & ~kPhase) | kTimedOut, std::memory_order_acq_rel);
  }
  /// The time-out is complete. [rt]
  void set_demoted() MAUVE_RT { exchange_phase(kTimedOut, kDemoted); }

  // ---- who removes the component, or gives it a new epoch

  /// From now on the thread does not come back; false when it has, or did not time out. [rt]
  bool claim() MAUVE_RT {
    for (;;) {
      std::uint32_t word = word_.load(std::memory_order_acquire);
      if ((word & kPhase) == kTimedOut) {
        futex_wait_until(word_, word, kForever);
      } else if ((word & kPhase) != kDemoted) {
        return false;
      } else if (word_.compare_exchange_strong(word, (word & ~kPhase) | kClaimed,
                                               std::memory_order_acq_rel)) {
        return true;
      }
    }
  }
  /// [rt]
  void give_up_claim() MAUVE_RT { exchange_phase(kClaimed, kDemoted); }
  void abandon() MAUVE_RT { exchange_phase(kClaimed, kAbandoned); }
  /// Whether its thread still runs an execution that timed out. [rt]
  bool has_timed_out() const MAUVE_RT { return phase() >= kTimedOut; }
  bool is_abandoned() const MAUVE_RT { return phase() == kAbandoned; }

 private:
  static constexpr std::uint32_t kIdle = 0, kRunning = 1, kTimedOut = 2, kDemoted = 3, kClaimed = 4,
                                 kAbandoned = 5, kPhase = 7;
  static constexpr std::uint32_t kEntered = 8;
  static constexpr std::uint32_t kNext = 16;  // the number above both

  std::uint32_t phase() const noexcept { return word_.load(std::memory_order_acquire) & kPhase; }
  void exchange_phase(std::uint32_t from, std::uint32_t to) MAUVE_RT {
    std::uint32_t word = (word_.load(std::memory_order_acquire) & ~kPhase) | from;
    const bool was_from =
        word_.compare_exchange_strong(word, (word & ~kPhase) | to, std::memory_order_acq_rel);
    MAUVE_ENSURES(was_from);  // else a thread would sleep for ever on the phase before
    futex_wake_all(word_);
  }

  Atomic<std::uint32_t> word_{kIdle};
  Atomic<time_ns_t> began_ns_{0};
  Atomic<time_ns_t> limit_ns_{0};
  Atomic<time_ns_t> budget_ns_{0};
  Atomic<time_ns_t> cpu_end_ns_{kForever};
};

}  // namespace mauve
