// SPDX-License-Identifier: LGPL-3.0-or-later
// What keeps ordinary changes and prepared ones apart: the gate of commits, and what of an architecture changed when.
#pragma once

#include <atomic>
#include <cstdint>

#include "mauve_rt/base/pi_mutex.hpp"
#include "mauve_rt/base/rt.hpp"

namespace mauve {

class Commit;

/// Held while a commit is carried out, not while one is prepared, and for a moment by who begins to look at what a prepared
/// commit may change.
///
/// | member     | written by                | read by | order                                               |
/// | ---------- | ------------------------- | ------- | --------------------------------------------------- |
/// | mutex      | commits                   | -       | -                                                   |
/// | structure_ | commits, under mutex      | anyone  | release/acquire: a hint; whoever relies on it holds mutex |
/// | under_way_, is_open_, pressing_ | commits, prepared commits, hosts | same | under_way_mutex_            |
class CommitGate {
 public:
  PiMutex mutex;

  /// How often components or resources were added or removed, ports wired, shells or fsms replaced. [rt]
  std::uint32_t structure() const MAUVE_RT { return structure_.load(std::memory_order_acquire); }
  /// Under the mutex. [rt]
  void restructured() MAUVE_RT { structure_.fetch_add(1, std::memory_order_release); }

  /// A commit that is carried out, under the mutex: from begin() to end() others may call it off. [rt]
  void begin(Commit& commit) MAUVE_RT;
  void end() MAUVE_RT;
  /// Calls off the commit under way, where that gives way, and each such that comes before relax(). [rt]
  void press() MAUVE_RT;
  void relax() MAUVE_RT;
  /// Threads run, and take part in commits. [non-rt], hosts
  void open() noexcept;
  /// Calls off the commit under way, and each that comes before open(); waits for no commit. Commits of parked components
  /// alone go on. [non-rt], hosts
  void close() noexcept;

 private:
  void call_off_if_unwanted() MAUVE_RT;

  std::atomic<std::uint32_t> structure_{0};
  PiMutex under_way_mutex_;
  Commit* under_way_{nullptr};
  bool is_open_{false};
  int pressing_{0};
};

/// What a component has been through. A change that is made in several steps claims it for as long as it looks at its parts.
///
/// | member     | written by                                      | read by | order                                     |
/// | ---------- | ----------------------------------------------- | ------- | ----------------------------------------- |
/// | count_     | changes, under the gate's mutex                 | anyone  | release/acquire: a hint; as structure_    |
/// | unsettled_ | prepared commits, and who completes them; gate's mutex | same | -                                     |
class ChangeMark {
 public:
  /// Odd while a change has claimed it; the same as before when that one changed nothing. [rt]
  std::uint32_t count() const MAUVE_RT { return count_.load(std::memory_order_acquire); }
  bool is_claimed() const MAUVE_RT { return (count() & 1U) != 0; }

  // ---- under the gate's mutex

  /// [non-rt] By who holds the architecture's change lock. Not of one that is unsettled.
  void claim() noexcept { count_.fetch_add(1, std::memory_order_release); }
  void release(bool changed) noexcept {
    if (changed) {
      count_.fetch_add(1, std::memory_order_release);
    } else {
      count_.fetch_sub(1, std::memory_order_release);
    }
  }
  /// By a prepared commit: what it put out is there still until settle(). [rt]
  void commit() MAUVE_RT {
    unsettled_ = true;
    count_.fetch_add(2, std::memory_order_release);
  }
  /// By a change that has claimed it, is made, and was not taken by all yet. [non-rt]
  void unsettle() noexcept { unsettled_ = true; }
  /// [non-rt]
  void settle() noexcept { unsettled_ = false; }
  /// [non-rt]
  bool is_unsettled() const noexcept { return unsettled_; }

 private:
  std::atomic<std::uint32_t> count_{0};
  bool unsettled_{false};
};

}  // namespace mauve
