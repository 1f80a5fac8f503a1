// SPDX-License-Identifier: LGPL-3.0-or-later
// What keeps changes apart: the gate that commits are known to, and what of an architecture changed when.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "mauve_rt/base/contract.hpp"
#include "mauve_rt/base/pi_mutex.hpp"
#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/base/seam/atomic.hpp"
#include "mauve_rt/base/time.hpp"

namespace mauve {

class Commit;
class Task;

/// Locks until the instant, unless the commit that needs the lock is called off: a thread that waits for a lock cannot be woken
/// for that, so it looks every 20 ms. Whether it has the lock. [rt]
template <typename IsOff>
bool lock_unless(PiMutex& mutex, time_ns_t until_ns, IsOff&& is_off) MAUVE_RT MAUVE_TRY_ACQUIRE(true, mutex) {
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

/// What a commit makes of the architecture's table, prepared beforehand. Both under the gate's mutex.
class Publication {
 public:
  Publication() = default;
  virtual ~Publication() = default;
  Publication(const Publication&) = delete;
  Publication& operator=(const Publication&) = delete;

  /// The latest T of the changes that this one builds on; the cut starts there, so that T is later. [rt]
  virtual time_ns_t since_ns() const MAUVE_RT = 0;
  /// Whether the table is still the one that it was prepared for. [rt]
  virtual bool is_current() const MAUVE_RT = 0;
  /// Puts the prepared values into the table, by swaps; once, of a commit that is made. [rt]
  virtual void publish(time_ns_t instant_ns) MAUVE_RT = 0;
};

/// The table of an architecture - what it consists of, who is wired to what, how often each changed - and the commits that are
/// to change it. It changes with the decision of a commit, not when its requester or its components get to run: who takes the
/// mutex takes in every commit that is decided, first (Look). Commits of different components go on in parallel, unless both are
/// structural.
///
/// | member     | written by                | read by | order                                               |
/// | ---------- | ------------------------- | ------- | --------------------------------------------------- |
/// | mutex_     | who looks at the table or changes it, for a moment: no user code, no allocation | - | -    |
/// | structural | a structural commit from its install to its decision; before mutex_ | - | -                |
/// | structure_ | commits, under both mutexes | anyone | release/acquire: a hint; to rely on it, hold one of them |
/// | the rest   | commits, prepared commits, hosts | same | mutex_                                          |
class CommitGate {
 public:
  PiMutex structural;

  /// While it lives the calling thread has the mutex, and the table is what was decided by then. [rt]
  class MAUVE_GUARD Look {
   public:
    explicit Look(CommitGate& gate) MAUVE_RT MAUVE_ACQUIRE(gate.mutex_) : gate_(gate) {
      gate_.mutex_.lock();
      gate_.take_in();
    }
    ~Look() MAUVE_RELEASE() { gate_.mutex_.unlock(); }
    Look(const Look&) = delete;
    Look& operator=(const Look&) = delete;

   private:
    CommitGate& gate_;
  };

  /// Whether a Look of the calling thread lives. [rt]
  bool is_looked_at_here() const MAUVE_RT { return mutex_.is_held_here(); }
  /// How often components or resources were added or removed, ports wired, or shells replaced. [rt]
  std::uint32_t structure() const MAUVE_RT { return structure_.load(std::memory_order_acquire); }
  /// Within a Look, and CommitGate::structural held by who does not commit. [rt]
  void restructured() MAUVE_RT {
    MAUVE_AUDIT(is_looked_at_here());
    structure_.fetch_add(1, std::memory_order_release);
  }

  /// Installs a commit, which is to be carried out: until it is decided others may call it off. False: the table is not the one
  /// that it was prepared for. [rt]
  bool begin(Commit& commit) MAUVE_RT;
  /// It knows by now who takes part: calls it off where no thread of the architecture may. [rt]
  void look_again(Commit& commit) MAUVE_RT;
  /// Whether an open commit is about the task. [rt], within a Look
  bool has_open_about(const Task& task) const MAUVE_RT MAUVE_REQUIRES(mutex_);
  /// Calls off the open commits that are about the task; whether there was one. [rt]
  bool abandon(const Task& task) MAUVE_RT;
  /// Calls off the commits under way that give way and are in the urgent one's way, and each such that comes before relax().
  /// [rt]
  void press(UrgentCommit& urgent) MAUVE_RT;
  void relax(UrgentCommit& urgent) MAUVE_RT;
  /// Whether threads may take part in commits. [rt]
  bool is_open() MAUVE_RT {
    const Look look(*this);
    return is_open_;
  }
  /// Threads run, and take part in commits. [non-rt], hosts
  void open() noexcept;
  /// Calls off the commits under way, and each that comes before open(); waits for no commit. Commits of parked components
  /// alone go on. [non-rt], hosts
  void close() noexcept;

 private:
  void take_in() MAUVE_RT MAUVE_REQUIRES(mutex_);
  void call_off_if_unwanted(Commit& commit) MAUVE_RT MAUVE_REQUIRES(mutex_);

  PiMutex mutex_;
  Atomic<std::uint32_t> structure_{0};
  Commit* under_way_ MAUVE_GUARDED_BY(mutex_){nullptr};     // a list
  UrgentCommit* urgent_ MAUVE_GUARDED_BY(mutex_){nullptr};  // a list
  bool is_open_ MAUVE_GUARDED_BY(mutex_){false};
};

/// What a component has been through. A change claims it while it prepares parts for it: other changes of the component that
/// are not urgent wait, and what others put out of it stays as it is. Under the gate's mutex, but for what is told otherwise.
///
/// | member     | written by                                      | read by | order                                     |
/// | ---------- | ----------------------------------------------- | ------- | ----------------------------------------- |
/// | changes_   | commits that are made, and who settles          | anyone  | release/acquire: a hint; as structure_    |
/// | the rest   | changes, and who settles them                   | same    | -                                         |
class ChangeMark {
 public:
  /// Grows with every change but a mere start or stop. [rt], anyone
  std::uint32_t changes() const MAUVE_RT { return changes_.load(std::memory_order_acquire); }
  /// [rt]
  void set_changed() MAUVE_RT { changes_.fetch_add(1, std::memory_order_release); }

  /// [rt]
  bool is_claimed() const MAUVE_RT { return is_claimed_; }
  void claim() MAUVE_RT {
    MAUVE_EXPECTS(!is_claimed_);
    is_claimed_ = true;
  }
  void release() MAUVE_RT {
    MAUVE_EXPECTS(is_claimed_);
    is_claimed_ = is_held_ = false;
  }
  /// By who has claimed it: not even an urgent change is to be made meanwhile, as this one acts on the parts that are in. [rt]
  void hold() MAUVE_RT {
    MAUVE_EXPECTS(is_claimed_);
    is_held_ = true;
  }
  bool is_held() const MAUVE_RT { return is_held_; }

  /// How many changes are made of which the component's part is not settled: it has not taken it, or what it has put out is
  /// there still. [rt]
  bool is_unsettled() const MAUVE_RT { return unsettled_ != 0; }
  void unsettle() MAUVE_RT { ++unsettled_; }
  void settle() MAUVE_RT {
    MAUVE_EXPECTS(unsettled_ != 0);
    --unsettled_;
  }

  /// T of the last change that was made of it. [rt]
  time_ns_t since_ns() const MAUVE_RT { return since_ns_; }
  void set_since_ns(time_ns_t instant_ns) MAUVE_RT { since_ns_ = instant_ns; }

 private:
  Atomic<std::uint32_t> changes_{0};
  std::uint32_t unsettled_{0};
  bool is_claimed_{false};
  bool is_held_{false};
  time_ns_t since_ns_{0};
};

}  // namespace mauve
