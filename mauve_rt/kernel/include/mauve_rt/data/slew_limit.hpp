// SPDX-License-Identifier: LGPL-3.0-or-later
// SlewLimit: numbers of an output that move no faster than allowed, whichever core, shell or part of the kernel writes them.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/base/seam/atomic.hpp"
#include "mauve_rt/base/time.hpp"
#include "mauve_rt/data/number_place.hpp"

namespace mauve {

/// One number of an output: the value that was written last, and how far it may move.
struct SlewedNumber {
  std::string path;      // within the message: linear.x
  double max_slew{0.0};  // units of the number per second

  Atomic<double> last{0.0};
  Atomic<time_ns_t> since_ns{0};     // the time that a step counts from
  Atomic<std::uint64_t> limited{0};  // writes in which it was written otherwise than the component asked for
  Atomic<std::uint64_t> not_limited{0};  // values of a stop that were further away, and written at once

  double next{0.0};  // of the write under way
  bool is_limited{false};
  bool keeps_time{false};  // the step was too small for the number's type: the next one has the time of both
};

/// The limited numbers of one output of a component. They survive the port: the port of a new shell goes on from there.
///
/// | member                  | written by                                   | read by   | order                               |
/// | ----------------------- | -------------------------------------------- | --------- | ----------------------------------- |
/// | numbers_: path, max_slew| [setup]                                      | any       | -                                   |
/// | last ... limited, has_last_ | the component's thread, or who writes for a parked one | any | relaxed: who writes next has it by parking; others read figures |
/// | next ... keeps_time     | the same                                     | the same  | its own                             |
/// | stopped_ns_             | who writes what a stop writes: any thread, also the watchdog; taken by who writes next | same | release/acquire: the port was closed before |
/// | not_limited             | the same                                     | any       | relaxed: a figure                   |
class SlewedOutput {
 public:
  /// By path. [setup]
  explicit SlewedOutput(const std::map<std::string, double>& max_slew);

  /// [rt]
  const std::deque<SlewedNumber>& numbers() const MAUVE_RT { return numbers_; }
  /// Goes on from the last values of another one, of the same numbers; its writer may be in a write still. [setup]
  void continue_from(const SlewedOutput& other) noexcept;

 private:
  friend class SlewLimit;
  static constexpr time_ns_t kNone = INT64_MIN;

  std::deque<SlewedNumber> numbers_;
  Atomic<bool> has_last_{false};
  Atomic<time_ns_t> stopped_ns_{kNone};  // the value of a stop was written then, and last is the one before
};

/// The limit at one port.
class SlewLimit {
 public:
  /// `zero`: what a stop writes; it lives as long as this. [setup]
  SlewLimit(std::shared_ptr<SlewedOutput> output, std::vector<NumberPlace> places, const void* zero);

  /// Moves the numbers of the value no further than allowed from the last ones; a number that is NaN stays where it was. False: there
  /// is no last value, and a number of this one is not finite. [rt], by who writes
  bool apply(void* value, time_ns_t time_ns) MAUVE_RT;
  /// That value was written. [rt], by who writes
  void keep(time_ns_t time_ns) MAUVE_RT;
  /// The value of a stop is written at once. [rt], any thread; the port is closed, or the caller writes
  void note_stop(time_ns_t time_ns) MAUVE_RT;
  /// Whether a number is further from the value of a stop than it may move until then. [rt], by who writes
  bool is_beyond(time_ns_t time_ns) MAUVE_RT;
  /// Steps count from that time on at the earliest. [rt], by who writes
  void resume(time_ns_t time_ns) MAUVE_RT;

 private:
  void take_stop() MAUVE_RT;

  const std::shared_ptr<SlewedOutput> output_;
  const std::vector<NumberPlace> places_;
  const void* const zero_;
};

}  // namespace mauve
