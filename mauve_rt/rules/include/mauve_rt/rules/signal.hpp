// SPDX-License-Identifier: LGPL-3.0-or-later
// Signals: what the conditions of rules hear.
#pragma once

#include <atomic>
#include <compare>
#include <cstdint>
#include <limits>
#include <string>

#include "mauve_rt/base/futex.hpp"
#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/base/time.hpp"

namespace mauve::rules {

/// What a signal tells of.
enum class SignalKind : std::uint8_t {
  message,        // of a topic: one has come; the value means nothing
  write,          // of a resource: it was written; the value means nothing
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
};

/// What is known of another executor.
enum class PeerState : std::uint8_t { unheard, there, another_instance, faulted, gone };

/// Names one signal.
struct SignalSpec {
  SignalKind kind{SignalKind::message};
  std::string target{};
  std::string detail{};

  auto operator<=>(const SignalSpec&) const = default;
};

/// The last that was told of one thing: when, a value, and how often something was told. One writer at a time; it waits
/// for nobody, and nobody for it.
///
/// | member       | written by   | read by          | order                                                            |
/// | ------------ | ------------ | ---------------- | ---------------------------------------------------------------- |
/// | count_       | the writer   | anyone           | release/acquire: hands over the place that it counts             |
/// | places_      | the writer   | anyone           | relaxed: a reader looks at count_ again, after a fence           |
/// | low_, high_  | the engine   | the writer       | seq_cst with count_: either the writer sees them, or the engine  |
/// |              |              |                  | sees what it told (Signal::listen)                               |
/// | word_ (futex)| writers      | the engine       | release/acquire: who sees it changed sees what was told          |
class Signal {
 public:
  struct Last {
    time_ns_t time_ns{0};
    double value{0.0};
    std::uint64_t count{0};  // 0: nothing was told yet
  };

  /// `word` is bumped, and who sleeps on it woken, by what is of interest; it outlives the signal. [setup]
  explicit Signal(std::atomic<std::uint32_t>& word) : word_(word) {}
  Signal(const Signal&) = delete;
  Signal& operator=(const Signal&) = delete;

  /// By the receiver's own clock. One writer at a time. [rt]
  void tell(time_ns_t time_ns, double value = 0.0) MAUVE_RT;
  /// [rt]
  Last last() const MAUVE_RT;
  /// A value from low to high wakes nobody from now on; anything else does, and a NaN always. False when something else
  /// came since `seen`: look again. [rt], the engine's thread
  bool listen(double low, double high, const Last& seen) MAUVE_RT;

 private:
  struct Place {
    std::atomic<time_ns_t> time_ns{0};
    std::atomic<double> value{0.0};
  };

  bool is_quiet(double value, double low, double high) const MAUVE_RT {
    return value >= low && value <= high;
  }

  std::atomic<std::uint32_t>& word_;
  std::atomic<std::uint64_t> count_{0};
  Place places_[2];  // NOLINT(modernize-avoid-c-arrays): atomics, which std::array would have to copy
  std::atomic<double> low_{std::numeric_limits<double>::infinity()};
  std::atomic<double> high_{-std::numeric_limits<double>::infinity()};
};

}  // namespace mauve::rules
