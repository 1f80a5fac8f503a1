// SPDX-License-Identifier: LGPL-3.0-or-later
// What keeps changes apart: the gate that commits are known to, and what of an architecture changed when.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <vector>

#include "mauve_rt/base/pi_mutex.hpp"
#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/base/time.hpp"

namespace mauve {

class Commit;
class Task;

/// Locks until the instant, unless the commit that needs the lock is called off: a thread that waits for a lock cannot be woken
/// for that, so it looks every 20 ms. Whether it has the lock. [rt]
template <typename IsOff>
bool lock_unless(PiMutex& mutex, time_ns_t until_ns, IsOff&& is_off) MAUVE_RT {
  constexpr time_ns_t kLook = ms_to_ns(20);
  for (;;) {
    const time_ns_t now = monotonic_now_ns();
    if (mutex.try_lock_until(std::min(until_ns, now + kLook))) return true;
    if (now >= until_ns || is_off()) return false;
  }
}

/// What a prepared commit is about, while it comes to be made. Ordinary commits that would keep it from that are called off.
struct UrgentCommit {
  std::vector<const Task*> tasks{};
  bool is_structural{false};
  UrgentCommit* next{nullptr};  // the gate's
};

/// Commits under way, and the structure that they change. Commits of different components go on in parallel, unless both are
/// structural.
///
/// | member     | written by                | read by | order                                               |
/// | ---------- | ------------------------- | ------- | --------------------------------------------------- |
/// | mutex      | who looks at marks or the structure to rely on it, or changes them; for a moment | - | - |
/// | structural | a structural commit while it is carried out; before mutex | - | -                       |
/// | structure_ | commits, under both mutexes | anyone | release/acquire: a hint; to rely on it, hold one of them |
/// | under_way_ ... | commits, prepared commits, hosts | same | under_way_mutex_                             |
class CommitGate {
 public:
  PiMutex mutex;
  PiMutex structural;

  /// How often components or resources were added or removed, ports wired, or shells replaced. [rt]
  std::uint32_t structure() const MAUVE_RT { return structure_.load(std::memory_order_acquire); }
  /// Under both mutexes. [rt]
  void restructured() MAUVE_RT { structure_.fetch_add(1, std::memory_order_release); }

  /// A commit that is carried out: from begin() to end() others may call it off. [rt]
  void begin(Commit& commit) MAUVE_RT;
  void end(Commit& commit) MAUVE_RT;
  /// Calls off the commits under way that give way and are in the urgent one's way, and each such that comes before relax().
  /// [rt]
  void press(UrgentCommit& urgent) MAUVE_RT;
  void relax(UrgentCommit& urgent) MAUVE_RT;
  /// Threads run, and take part in commits. [non-rt], hosts
  void open() noexcept;
  /// Calls off the commits under way, and each that comes before open(); waits for no commit. Commits of parked components
  /// alone go on. [non-rt], hosts
  void close() noexcept;

 private:
  void call_off_if_unwanted(Commit& commit) MAUVE_RT;

  std::atomic<std::uint32_t> structure_{0};
  PiMutex under_way_mutex_;
  Commit* under_way_{nullptr};     // a list
  UrgentCommit* urgent_{nullptr};  // a list
  bool is_open_{false};
};

/// What a component has been through. A change claims it for as long as it looks at its parts, or changes them.
///
/// | member     | written by                                      | read by | order                                     |
/// | ---------- | ----------------------------------------------- | ------- | ----------------------------------------- |
/// | count_     | changes, under the gate's mutex                 | anyone  | release/acquire: a hint; as structure_    |
/// | unsettled_ | changes, and who completes them; gate's mutex   | same    | -                                         |
class ChangeMark {
 public:
  /// Grows by two with every change; odd while a change has claimed it. [rt]
  std::uint32_t count() const MAUVE_RT { return count_.load(std::memory_order_acquire); }
  /// The same without the claim. [rt]
  std::uint32_t changes() const MAUVE_RT { return count() & ~1U; }
  bool is_claimed() const MAUVE_RT { return (count() & 1U) != 0; }

  // ---- under the gate's mutex

  /// Not of one that is claimed or unsettled. [rt]
  void claim() MAUVE_RT { count_.fetch_add(1, std::memory_order_release); }
  void release() MAUVE_RT { count_.fetch_sub(1, std::memory_order_release); }
  /// By who has claimed it. [rt]
  void set_changed() MAUVE_RT { count_.fetch_add(2, std::memory_order_release); }
  /// By who has changed it: what was put out is there still until settle(). [rt]
  void unsettle() MAUVE_RT { unsettled_ = true; }
  /// [non-rt]
  void settle() noexcept { unsettled_ = false; }
  /// [rt]
  bool is_unsettled() const MAUVE_RT { return unsettled_; }

 private:
  std::atomic<std::uint32_t> count_{0};
  bool unsettled_{false};
};

}  // namespace mauve
