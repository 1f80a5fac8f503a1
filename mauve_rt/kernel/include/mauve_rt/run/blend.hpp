// SPDX-License-Identifier: LGPL-3.0-or-later
// Blend: the outputs of a component go over from the values of its old core to those of its new one.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/base/seam/mutex.hpp"
#include "mauve_rt/base/time.hpp"
#include "mauve_rt/data/number_place.hpp"
#include "mauve_rt/parts/core.hpp"
#include "mauve_rt/parts/fsm.hpp"
#include "mauve_rt/parts/shell.hpp"

namespace mauve {

/// From T on the ports hold what the new core writes. At the end of each release each held value is written: a floating-point number as
/// old + w (new - old), a quaternion along the shorter arc, all else as the new core wrote it, with w = (instant - T) / duration. The old
/// value is the last one that the old core has written in the blend. Ports without such numbers are not held.
///
/// | member                | written by                            | read by              | order                                |
/// | --------------------- | ------------------------------------- | -------------------- | ------------------------------------ |
/// | outputs_, duration_ns_| [setup]                               | component's thread   | the commit publishes it              |
/// | values, begin_ns_     | component's thread                    | same                 | -                                    |
/// | core, binding         | [setup]; component's thread, who cleans up | same            | mutex, and the shadow's phase        |
/// | fault                 | component's thread                    | anyone               | the shadow's phase: it has ended     |
class Blend {
 public:
  static constexpr time_ns_t kLongest = s_to_ns(60);

  /// [non-rt]
  Blend(const Shell& shell, time_ns_t duration_ns);
  ~Blend();
  Blend(const Blend&) = delete;
  Blend& operator=(const Blend&) = delete;

  /// The outputs are held from now on; w is 0 at this instant. [rt], the component's thread
  void begin(time_ns_t instant_ns) MAUVE_RT;
  /// 0 to 1. [rt], the component's thread
  double weight(time_ns_t instant_ns) const MAUVE_RT;
  /// The old core has written this to the port, by its place in the shell; nullptr: nothing. [rt], the component's thread
  void note_old(std::size_t port, const void* value) MAUVE_RT;
  /// Writes the held values. [rt], the component's thread
  void write(double weight) MAUVE_RT;
  /// Forgets them. [rt], the component's thread
  void drop() MAUVE_RT;
  /// The ports hold nothing any longer. May be called again. [rt], the component's thread, or one that has claimed the component
  void end() MAUVE_RT;

  Mutex mutex{};                     // the old core executes, or is cleaned up
  std::unique_ptr<CoreBase> core{};  // the old one, from T on
  CoreBinding binding{};             // of the old core, to the shadow's fsm
  std::string fault{};               // of the old core; empty: none

 private:
  class Output;

  const time_ns_t duration_ns_;
  time_ns_t begin_ns_{0};
  std::vector<std::unique_ptr<Output>> outputs_;
};

}  // namespace mauve
