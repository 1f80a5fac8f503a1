// SPDX-License-Identifier: LGPL-3.0-or-later
// Signals: what the conditions of rules hear.
#pragma once

#include <compare>
#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <utility>

#include "mauve_rt/base/contract.hpp"
#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/base/seam/atomic.hpp"
#include "mauve_rt/base/seam/futex.hpp"
#include "mauve_rt/base/time.hpp"

namespace mauve::rules {

/// What a signal tells of.
enum class SignalKind : std::uint8_t {
  message,        // of a topic: one has come; the value means nothing
  write,          // of a resource: it was written; the value means nothing
  arrival,        // of a topic: one has come, perhaps not to be read yet; the value means nothing
  field,          // of a topic or resource (detail: the field's path): the field's value
  overruns,       // of a component: how many there were
  late,           // of a component: how many wake-ups or responses were late
  release,        // of a component: it was released; the value means nothing
  state,          // of a component: its ComponentState
  over_declared,  // of a component: how many executions lasted longer than declared
  peer,           // of an executor: a PeerState
  diagnostic,     // of a status by its name: its level
  change,         // of a component, or with no target of the architecture: it was changed
  node,           // of the executor itself: its Python side works; the value means nothing
  goal,  // of a resource of an action (detail: aborted): 1 or 0; (overdue): the goal that executes, or 0
};

/// What is known of another executor.
enum class PeerState : std::uint8_t { unheard, there, another_instance, faulted, gone };

/// Changes with all that is of interest to an engine (futex); engines of which one follows the other have one.
struct alignas(64) EngineWord {
  Atomic<std::uint32_t> value{0};

  /// Changes it, and wakes who sleeps on it. [rt]
  void bump() MAUVE_RT {
    value.fetch_add(1, std::memory_order_release);
    futex_wake_all(value);
  }
};

/// Names one signal.
struct SignalSpec {
  SignalKind kind{SignalKind::message};
  std::string target{};
  std::string detail{};

  auto operator<=>(const SignalSpec&) const = default;
};

/// Reports of one thing: the last one, and the last crossing of a condition's bounds in each direction. One writer at a
/// time; the writer waits for nobody, and nobody waits for the writer.
///
/// The writer counts the crossings: a value that was beyond a bound between two looks of the engine is not lost.
///
/// | member          | written by   | read by    | order                                                             |
/// | --------------- | ------------ | ---------- | ----------------------------------------------------------------- |
/// | all_            | the writer   | anyone     | Record's; its count is seq_cst with low_ and high_: either the    |
/// |                 |              |            | writer sees the bounds, or the engine sees the report (listen)    |
/// | entered_, left_ | the writer   | the engine | Record's; written before all_: who sees a report in all_ sees     |
/// |                 |              |            | its crossing                                                      |
/// | inner_, outer_  | [setup]      | both       | none: set before the signal is fed                                |
/// | is_outside_,    | the writer,  | the writer | none                                                              |
/// | crossings_      | [setup]      |            |                                                                   |
/// | reported_ns_    | the writer   | the engine | release/acquire: who sees the instant sees what was told before   |
/// | low_, high_     | the engine   | the writer | seq_cst, as all_                                                  |
/// | word_ (futex)   | writers      | the engine | release/acquire: who sees it changed sees the report              |
class Signal {
 public:
  struct Last {
    time_ns_t time_ns{0};
    double value{0.0};
    std::uint64_t count{0};  // its number; 0: nothing was reported yet
  };
  /// A NaN is within no bounds.
  struct Bounds {
    double low{std::numeric_limits<double>::infinity()};
    double high{-std::numeric_limits<double>::infinity()};
    /// [rt]
    bool contains(double value) const MAUVE_RT { return value >= low && value <= high; }
  };

  /// `word` is bumped by what is of interest. [setup]
  explicit Signal(std::shared_ptr<EngineWord> word) : word_(std::move(word)) {}
  Signal(const Signal&) = delete;
  Signal& operator=(const Signal&) = delete;

  /// Counts from now on how often values leave `outer`, and come back into `inner`, which lies within it. Before the
  /// signal is fed. [setup]
  void count_crossings(Bounds inner, Bounds outer, bool begins_outside) {
    MAUVE_EXPECTS(!counts_crossings_ && last().count == 0);
    MAUVE_EXPECTS(!(inner.low < outer.low) && !(inner.high > outer.high));
    inner_ = inner;
    outer_ = outer;
    is_outside_ = begins_outside;
    counts_crossings_ = true;
  }

  /// Whether a value crosses the bounds, seen from one side of them. [rt]
  bool crosses(double value, bool from_outside) const MAUVE_RT {
    return from_outside ? inner_.contains(value) : !outer_.contains(value);
  }

  /// By the receiver's own clock. One writer at a time. [rt]
  void tell(time_ns_t time_ns, double value = 0.0) MAUVE_RT;
  /// All that happened until then was told, so far as who tells can know. Not called: told as it happens. [rt]
  void set_reported_until(time_ns_t until_ns) MAUVE_RT {
    reported_ns_.store(until_ns, std::memory_order_release);
  }
  /// What was told by then last() shows, if it is called after this. [rt]
  time_ns_t reported_until() const MAUVE_RT { return reported_ns_.load(std::memory_order_acquire); }
  /// [rt]
  Last last() const MAUVE_RT { return all_.read(); }
  /// The last crossing inwards, and outwards; their counts number all crossings, from 1 on. [rt]
  Last entered() const MAUVE_RT { return entered_.read(); }
  Last left() const MAUVE_RT { return left_.read(); }
  /// A value from low to high wakes nobody from now on; anything else does, and a NaN always. False when something else
  /// came since `seen`: look again. [rt], the engine's thread
  bool listen(double low, double high, const Last& seen) MAUVE_RT;

 private:
  void cross(time_ns_t time_ns, double value) MAUVE_RT;

  /// The last report of some. One writer.
  ///
  /// | member  | written by | read by | order                                                                      |
  /// | ------- | ---------- | ------- | -------------------------------------------------------------------------- |
  /// | count_  | the writer | anyone  | seq_cst, for listen(); hands over the place that it counts                 |
  /// | places_ | the writer | anyone  | release/acquire: who reads a report of the next round sees the count that  |
  /// |         |            |         | came before it, and reads again                                            |
  class Record {
   public:
    void write(const Last& report) MAUVE_RT;
    Last read() const MAUVE_RT;
    /// How many were written. [rt]
    std::uint64_t written() const MAUVE_RT { return count_.load(std::memory_order_seq_cst); }

   private:
    struct Place {
      Atomic<time_ns_t> time_ns{0};
      Atomic<double> value{0.0};
      Atomic<std::uint64_t> count{0};
    };
    Atomic<std::uint64_t> count_{0};
    Place places_[2];  // NOLINT(modernize-avoid-c-arrays): atomics, which std::array would have to copy
  };

  const std::shared_ptr<EngineWord> word_;
  Record all_, entered_, left_;
  Bounds inner_, outer_;
  bool counts_crossings_{false};
  bool is_outside_{false};
  std::uint64_t crossings_{0};
  Atomic<time_ns_t> reported_ns_{kForever};
  Atomic<double> low_{std::numeric_limits<double>::infinity()};
  Atomic<double> high_{-std::numeric_limits<double>::infinity()};
};

}  // namespace mauve::rules
