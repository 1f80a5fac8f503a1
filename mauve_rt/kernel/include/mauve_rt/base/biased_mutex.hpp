// SPDX-License-Identifier: LGPL-3.0-or-later
// A priority-inheritance mutex that one of its users enters without an atomic read-modify-write.
#pragma once

#include <cstdint>

#include "mauve_rt/base/contract.hpp"
#include "mauve_rt/base/pi_mutex.hpp"
#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/base/seam/atomic.hpp"
#include "mauve_rt/base/seam/process_barrier.hpp"
#include "mauve_rt/base/this_thread.hpp"

namespace mauve {

/// A biased lock (K. Kawachiya, A. Koseki, T. Onodera: "Lock reservation", OOPSLA 2002) with asymmetric barriers (D. Dice,
/// H. Huang, M. Yang: "Asymmetric Dekker synchronization", 2001).
///
/// A frequent user takes a seat. While one seat is taken, its user enters by two plain stores and two loads: it has the bias.
/// A caller without a seat first takes the bias away, by a process_barrier(), and waits until the user has left. A user that is
/// inside then inherits the priority of that caller: the caller locks a futex on the user's behalf, which the user unlocks.
/// With two seats or more no seat has the bias: all users take the PI mutex.
/// tests/models/loom explores the protocol, and has what goes wrong without each order.
///
/// | member          | written by                 | read by          | order                                                    |
/// | --------------- | -------------------------- | ---------------- | -------------------------------------------------------- |
/// | owner_          | who holds mutex_           | users of seats   | release / acquire: the user sees what the others wrote   |
/// | granted_        | add(), remove(), share()   | any              | relaxed: under mutex_, but for who only shows it         |
/// | first_, Seat::next_ | add(), remove()        | the same         | mutex_                                                   |
/// | is_shared_      | share()                    | add(), remove()  | mutex_                                                   |
/// | Seat::inside_   | the seat's user            | who holds mutex_ | after inside_ the user looks at owner_, after owner_ the other one at inside_: a barrier between each; release: who finds 0 sees what the user wrote |
/// | Seat::handover_ | both                       | both             | seq_cst: a futex word; one of them sees the other        |
/// | Seat::id_       | the seat's user            | any              | relaxed: the user finds what it stored itself            |
class MAUVE_LOCK BiasedMutex {
 public:
  /// Of one thread at a time.
  class Seat {
   public:
    Seat() = default;
    Seat(const Seat&) = delete;
    Seat& operator=(const Seat&) = delete;

    /// Whether the calling thread is the one that entered by this seat last. [rt]
    bool is_mine() const MAUVE_RT { return id_.load(std::memory_order_relaxed) == this_thread_id(); }

   private:
    friend class BiasedMutex;

    /// A user of this deployment may be another thread than that of the one before.
    std::uint32_t take_thread() MAUVE_RT {
      const std::uint32_t id = this_thread_id();
      if (id_.load(std::memory_order_relaxed) != id) [[unlikely]]
        id_.store(id, std::memory_order_relaxed);
      return id;
    }
    void hand_over() MAUVE_RT;
    void await_leave() MAUVE_RT;

    Atomic<std::uint32_t> inside_{0};
    Atomic<std::uint32_t> handover_{0};
    Atomic<std::uint32_t> id_{0};
    Seat* next_{nullptr};
  };

  /// Holds the mutex to the end of a block: by the seat, or as one of the others.
  class MAUVE_GUARD Hold {
   public:
    /// [rt]
    Hold(BiasedMutex& mutex, Seat* seat) MAUVE_RT MAUVE_ACQUIRE(mutex) : mutex_(mutex), seat_(seat) {
      if (seat_ == nullptr) {
        mutex_.lock();
      } else if (!mutex_.enter(*seat_)) {
        seat_ = nullptr;
      }
    }
    ~Hold() MAUVE_RELEASE() {
      if (seat_ != nullptr) {
        mutex_.leave(*seat_);
      } else {
        mutex_.unlock();
      }
    }
    Hold(const Hold&) = delete;
    Hold& operator=(const Hold&) = delete;

   private:
    BiasedMutex& mutex_;
    Seat* seat_;  // nullptr: by lock()
  };

  BiasedMutex() = default;
  BiasedMutex(const BiasedMutex&) = delete;
  BiasedMutex& operator=(const BiasedMutex&) = delete;

  /// As one without a seat. [rt]
  void lock() MAUVE_RT MAUVE_ACQUIRE();
  /// Locks if no user is inside; never waits. [rt]
  bool try_lock() MAUVE_RT MAUVE_TRY_ACQUIRE(true);
  /// [rt]
  void unlock() MAUVE_RT MAUVE_RELEASE();

  /// Gives a seat. It must not move, and its user is not inside. [rt] Waits for the user of the only other seat to leave.
  void add(Seat& seat) MAUVE_RT;
  /// Takes a seat away; its user is not inside. [rt]
  void remove(Seat& seat) MAUVE_RT;
  /// From now on no seat has the bias: callers without a seat are frequent. [setup]
  void share() noexcept;
  /// Whether a seat has the bias. [rt]
  bool is_biased() const MAUVE_RT { return granted_.load(std::memory_order_relaxed) != nullptr; }

  /// The name traced when it is contended. [setup]
  void set_trace_id(std::uint32_t id) noexcept { mutex_.set_trace_id(id); }

 private:
  /// True: by the bias, to be left by leave(). False: by lock().
  bool enter(Seat& seat) MAUVE_RT MAUVE_LOCKS_UNSEEN {
    if (owner_.load(std::memory_order_relaxed) == &seat) [[likely]] {  // relaxed: a hint
      MAUVE_AUDIT(seat.inside_.load(std::memory_order_relaxed) == 0);  // relaxed: this thread wrote it last
      seat.inside_.store(seat.take_thread(), std::memory_order_relaxed);
      light_barrier();
      if (owner_.load(std::memory_order_acquire) == &seat) [[likely]]
        return true;
      leave(seat);
    }
    lock_with(seat);
    return false;
  }
  void leave(Seat& seat) MAUVE_RT {
    seat.inside_.store(0, std::memory_order_release);
    light_barrier();
    if (owner_.load(std::memory_order_relaxed) != &seat) [[unlikely]]
      seat.hand_over();
  }
  void lock_with(Seat& seat) MAUVE_RT MAUVE_ACQUIRE();
  void revoke(Seat& granted) MAUVE_RT MAUVE_REQUIRES(mutex_);
  void grant() MAUVE_RT MAUVE_REQUIRES(this);

  Atomic<Seat*> owner_{nullptr};
  PiMutex mutex_;
  Atomic<Seat*> granted_{nullptr};
  Seat* first_ MAUVE_GUARDED_BY(this){nullptr};
  bool is_shared_ MAUVE_GUARDED_BY(this){false};
};

}  // namespace mauve
