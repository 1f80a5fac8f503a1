// SPDX-License-Identifier: LGPL-3.0-or-later
// Every write to a resource, kept for one reader: a writer never waits for it.
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "mauve_rt/base/contract.hpp"
#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/base/seam/atomic.hpp"
#include "mauve_rt/base/seam/mutex.hpp"
#include "mauve_rt/base/time.hpp"

namespace mauve {

/// One write, as it is kept.
template <typename T>
struct WrittenValue {
  T value{};
  time_ns_t time_ns{0};

  /// [rt]
  void set(const T& written, time_ns_t at_ns) MAUVE_RT {
    value = written;
    time_ns = at_ns;
  }
};

/// The writes to a resource from open() to close(), between writers, one at a time, and one reader. Writes that find no room
/// are counted.
///
/// | member         | written by      | read by          | under / order                                              |
/// | -------------- | --------------- | ---------------- | ---------------------------------------------------------- |
/// | ring_          | open(), close() | writers          | the lock that writers hold                                 |
/// | kept_          | open(), close() | the reader       | mutex_, which writers never take                           |
/// | Ring::places   | writers         | the reader       | written and taken                                          |
/// | Ring::written  | writers         | the reader       | release / acquire: it publishes the place                  |
/// | Ring::taken    | the reader      | writers          | release / acquire: the place may be written again          |
/// | lost_          | writers         | any              | relaxed: a figure that nothing depends on                  |
template <typename Place>
class WriteLog {
 public:
  static constexpr std::size_t kFewest = 16;
  static constexpr std::size_t kMost = 8192;

  /// Keeps writes from now on, in about so many bytes; again: in a new place, what waited is gone. `prepare`: gives a place what
  /// memory it needs. [non-rt]
  template <typename Lock>
  void open(std::size_t bytes, Lock& writers, std::size_t place_bytes = sizeof(Place),
            const std::function<void(Place&)>& prepare = {}) {
    auto made = std::make_unique<Ring>();
    made->places = std::vector<Place>(std::clamp(bytes / place_bytes, kFewest, kMost));
    if (prepare) std::for_each(made->places.begin(), made->places.end(), prepare);
    exchange(std::move(made), writers);
  }
  /// Keeps no more. [non-rt]
  template <typename Lock>
  void close(Lock& writers) {
    exchange(nullptr, writers);
  }

  /// Keeps a write; without anybody who asked for it, that is one load. [rt] Under the writers' lock.
  template <typename Value>
  void put(const Value& value, time_ns_t time_ns) MAUVE_RT {
    if (ring_ == nullptr) [[likely]]
      return;
    const std::uint64_t written =
        ring_->written.load(std::memory_order_relaxed);  // relaxed: written here only
    const std::uint64_t waiting = written - ring_->taken.load(std::memory_order_acquire);
    MAUVE_AUDIT(waiting <= ring_->places.size());
    if (waiting == ring_->places.size()) {
      lost_.fetch_add(1, std::memory_order_relaxed);
      return;
    }
    ring_->places[written % ring_->places.size()].set(value, time_ns);
    ring_->written.store(written + 1, std::memory_order_release);
  }

  /// The oldest write that was not taken yet, given to `use`; false: there is none. [non-rt]
  template <typename Use>
  bool next(Use use) {
    const LockGuard lock(mutex_);
    if (kept_ == nullptr) return false;
    const std::uint64_t taken = kept_->taken.load(std::memory_order_relaxed);  // relaxed: written here only
    if (taken == kept_->written.load(std::memory_order_acquire)) return false;
    use(kept_->places[taken % kept_->places.size()]);
    kept_->taken.store(taken + 1, std::memory_order_release);
    return true;
  }
  /// Writes that found no room, since the start. [rt]
  std::uint64_t lost() const MAUVE_RT { return lost_.load(std::memory_order_relaxed); }

 private:
  struct Ring {
    std::vector<Place> places;
    Atomic<std::uint64_t> written{0};
    Atomic<std::uint64_t> taken{0};
  };

  template <typename Lock>
  void exchange(std::unique_ptr<Ring> ring, Lock& writers) {
    const LockGuard lock(mutex_);
    {
      const LockGuard no_writer(writers);
      ring_ = ring.get();
    }
    kept_.swap(ring);  // the old one ends: no writer has it any more
  }

  Ring* ring_{nullptr};
  Mutex mutex_;
  std::unique_ptr<Ring> kept_ MAUVE_GUARDED_BY(mutex_);
  Atomic<std::uint64_t> lost_{0};
};

}  // namespace mauve
