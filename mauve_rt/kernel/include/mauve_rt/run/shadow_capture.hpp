// SPDX-License-Identifier: LGPL-3.0-or-later
// ShadowCapture: the values that a component reads and writes in each release, copied for its shadow.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/base/seam/atomic.hpp"
#include "mauve_rt/base/time.hpp"
#include "mauve_rt/data/port_base.hpp"
#include "mauve_rt/parts/shell.hpp"

namespace mauve {

/// A ring of few releases: the component's thread fills a slot, one other thread empties it. The component's thread never waits and
/// never allocates; a release that finds no free slot is skipped and counted.
///
/// A port has in each release the first sample that was read, and the last value that was written. A port that was not read in a
/// release has the value of before, as old.
///
/// | member           | written by                     | read by              | order                                     |
/// | ---------------- | ------------------------------ | -------------------- | ----------------------------------------- |
/// | ports_           | [setup]                        | both                 | -                                         |
/// | present_ ...     | component's thread             | component's thread   | -                                         |
/// | slots_           | component's thread             | shadow's thread      | filled_, emptied_                         |
/// | filled_          | component's thread             | shadow's thread      | release/acquire: the slot's contents      |
/// | emptied_         | shadow's thread                | component's thread   | release/acquire: the slot is read         |
/// | captured_, skipped_ | component's thread          | anyone               | relaxed: lone numbers                     |
/// | is_attached_     | who attaches, who detaches     | same                 | acq_rel: one of them detaches             |
class ShadowCapture {
 public:
  static constexpr std::size_t kSlots = 8;
  static constexpr std::size_t kMostPortBytes = 16'384;     // a copy of some microseconds
  static constexpr std::size_t kMostReleaseBytes = 65'536;  // all ports together
  /// The component was started: the initial state follows.
  static constexpr std::int64_t kStart = -1;

  struct Release {
    std::uint64_t number{0};    // counted from the begin of the shadow, those skipped included
    time_ns_t instant_ns{0};    // nominal
    std::int64_t from{kStart};  // index of the wait that has ended
    bool is_anew{false};        // the first one since the begin, or since a start of the component
  };
  /// One port in one release.
  struct PortNote {
    time_ns_t time_ns{0};
    DataStatus status{DataStatus::none};
    bool is_noted{false};  // read, or written, in this release
  };

  /// Throws Error (type_mismatch, out_of_range): a port cannot be captured. [non-rt]
  ShadowCapture(const Shell& shell, const std::string& component);
  ~ShadowCapture();
  ShadowCapture(const ShadowCapture&) = delete;
  ShadowCapture& operator=(const ShadowCapture&) = delete;

  /// Makes room for so many bytes of a core's state, with each release. [setup]
  void make_room_for_state(std::size_t bytes);

  // ---- the component's thread, or who acts for a parked component

  /// The state that the core has in this wait, to be written: it goes with the release that follows. [rt]
  std::byte* next_state() MAUVE_RT {
    present_.has_state = true;
    return present_.state.data();
  }
  /// Captures from now on; `from` as in Release. [rt]
  void attach(std::int64_t from) MAUVE_RT;
  /// Captures no longer: no thread uses this afterwards through the ports. May be called again. [rt]
  void detach() MAUVE_RT;
  bool is_attached() const MAUVE_RT { return is_attached_.load(std::memory_order_acquire); }
  /// The component starts anew: forgets the release that was not finished. [rt]
  void start() MAUVE_RT;
  /// A release has reached its next wait, of this index; whether a slot was filled. [rt]
  bool end_release(time_ns_t instant_ns, std::int64_t next_from) MAUVE_RT;
  /// The last value that was read or written, by the port's place in the shell. [rt]
  const std::byte* present(std::size_t port) const MAUVE_RT;
  /// Whether it was read or written since the last release ended. [rt]
  bool is_noted(std::size_t port) const MAUVE_RT { return present_.notes[port].is_noted; }
  /// How the port was read last, by its place in the shell. [rt]
  const PortNote& present_note(std::size_t port) const MAUVE_RT { return present_.notes[port]; }
  /// The release that ends is for no candidate. [rt]
  void forget_release() MAUVE_RT;

  // ---- the shadow's thread

  /// The oldest release not popped; nullptr: none. [rt]
  const Release* front() const MAUVE_RT;
  void pop() MAUVE_RT;
  /// Of the oldest release, by the port's place in the shell. [rt]
  const PortNote& note(std::size_t port) const MAUVE_RT;
  const std::byte* value(std::size_t port) const MAUVE_RT;
  /// The state that the core had before it; nullptr: it was not written. [rt]
  const std::byte* state() const MAUVE_RT;

  // ---- anyone

  /// Releases since the begin, and those of them that found no free slot. [rt]
  std::uint64_t captured() const MAUVE_RT { return captured_.load(std::memory_order_relaxed); }
  std::uint64_t skipped() const MAUVE_RT { return skipped_.load(std::memory_order_relaxed); }

 private:
  class Tap;
  struct Slot {
    Release release{};
    std::vector<PortNote> notes{};
    std::vector<std::byte> values{};
    std::vector<std::byte> state{};
    bool has_state{false};
  };

  std::vector<std::unique_ptr<Tap>> ports_;
  Slot present_;  // the release under way
  std::array<Slot, kSlots> slots_;
  std::uint64_t number_{0};
  std::int64_t from_{kStart};
  bool is_anew_{true};  // no release has told it yet
  Atomic<std::uint64_t> filled_{0};
  Atomic<std::uint64_t> emptied_{0};
  Atomic<std::uint64_t> captured_{0};
  Atomic<std::uint64_t> skipped_{0};
  Atomic<bool> is_attached_{false};
};

}  // namespace mauve
