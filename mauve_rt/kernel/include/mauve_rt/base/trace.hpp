// SPDX-License-Identifier: LGPL-3.0-or-later
// Trace records in per-thread wait-free rings; loss is counted, never silent.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "mauve_rt/base/contract.hpp"
#include "mauve_rt/base/seam/atomic.hpp"
#include "mauve_rt/base/time.hpp"

namespace mauve {

/// Kinds of records. The table of what their fields mean is mauve_msgs/msg/TraceRecord.msg, which has every one of them.
enum class TraceKind : std::uint16_t {
  deployment = 1,
  start = 2,
  stop = 3,
  fault = 4,
  release = 5,
  state_begin = 6,
  state_end = 7,
  wait = 8,
  overrun = 9,
  parked = 10,
  armed = 11,
  service_begin = 12,
  service_end = 13,
  contended = 14,
  reconfiguration = 15,
  mark = 16,
  decision = 17,
};

/// One record; in memory as mauve_msgs/msg/TraceRecord is on the wire.
struct TraceRecord {
  std::uint64_t sequence;
  time_ns_t time_ns;
  std::int64_t a;
  std::int64_t b;
  std::int64_t c;
  std::uint32_t name;
  std::uint16_t kind;
  std::uint16_t component;
};
static_assert(sizeof(TraceRecord) == 48, "the bag's readers rely on this layout");

/// The words that records refer to by number; grows only. Ordinary threads.
class TraceNames {
 public:
  /// The number of a word, the same for equal words. [non-rt]
  static std::uint32_t intern(std::string_view word);
  /// The word of a number; empty when there is none. [non-rt]
  static std::string word(std::uint32_t number);
  /// All words by number. [non-rt]
  static std::vector<std::string> all();
};

class TraceRing;

namespace detail {
/// Initial-exec: one instruction to reach, where the general model of shared libraries takes a call.
extern constinit thread_local TraceRing* this_threads_ring [[gnu::tls_model("initial-exec")]];
}  // namespace detail

/// Single producer (the component's thread), single consumer (who drains). wait-free on the producer's side.
///
/// | member    | written by | order                                                               |
/// | --------- | ---------- | ------------------------------------------------------------------- |
/// | head_     | producer   | release: publishes the record written before; the drain acquires    |
/// | seen_tail_| producer   | its own: the tail as it last looked                                 |
/// | dropped_  | producer   | relaxed: a count; its reader takes whatever is newest               |
/// | tail_     | consumer   | release: frees the place only after the copy; the producer acquires |
/// | the rest  | [setup]    | -                                                                   |
class TraceRing {
 public:
  /// Capacity is rounded up to a power of two; all pages are touched. [setup]
  explicit TraceRing(std::uint16_t component, std::size_t capacity = kDefaultCapacity);
  /// Stamps by this clock instead of the monotonic one: simulated time. [setup]
  void set_clock(const Clock* clock) noexcept { clock_ = clock; }
  /// Numbers its records from here on: an earlier ring of the same component has written so many. [setup]
  void set_first(std::uint64_t sequence) noexcept { first_ = sequence; }

  /// 96 KiB: at 1 kHz with one execution state and one wait, half a second.
  static constexpr std::size_t kDefaultCapacity = 2048;

  /// Records an event now, or at the time given; counted as dropped when the ring is full. [rt]
  void push(TraceKind kind, std::uint32_t name = 0, std::int64_t a = 0, std::int64_t b = 0,
            std::int64_t c = 0) MAUVE_RT {
    push_at(clock_ == nullptr ? monotonic_now_ns() : clock_->now_ns(), kind, name, a, b, c);
  }
  void push_at(time_ns_t time_ns, TraceKind kind, std::uint32_t name = 0, std::int64_t a = 0,
               std::int64_t b = 0, std::int64_t c = 0) MAUVE_RT {
    const std::uint64_t head = head_.load(std::memory_order_relaxed);  // relaxed: only this thread writes it
    const std::uint64_t dropped = dropped_.load(std::memory_order_relaxed);
    MAUVE_AUDIT(head - seen_tail_ <= mask_ + 1);
    if (head - seen_tail_ > mask_) [[unlikely]] {
      seen_tail_ = tail_.load(std::memory_order_acquire);
      if (head - seen_tail_ > mask_) {
        dropped_.store(dropped + 1, std::memory_order_relaxed);
        return;
      }
    }
    places_[head & mask_] = {.sequence = first_ + head + dropped,
                             .time_ns = time_ns,
                             .a = a,
                             .b = b,
                             .c = c,
                             .name = name,
                             .kind = static_cast<std::uint16_t>(kind),
                             .component = component_};
    head_.store(head + 1, std::memory_order_release);
  }

  /// Fetches the places that come next to the processor of the producer. [rt]
  void warm_up() const MAUVE_RT {
    constexpr std::uint64_t kPlaces = 16;
    const std::uint64_t head = head_.load(std::memory_order_relaxed);
    for (std::uint64_t at = head; at < head + kPlaces; ++at) __builtin_prefetch(&places_[at & mask_], 1);
  }

  /// Appends all records to the vector and frees their places. [non-rt], one thread at a time.
  void drain(std::vector<TraceRecord>& into);
  /// Records offered to this ring so far, dropped ones among them; exact while the producer rests. [non-rt]
  std::uint64_t offered() const noexcept { return head_.load(std::memory_order_relaxed) + dropped(); }
  std::uint64_t dropped() const noexcept { return dropped_.load(std::memory_order_relaxed); }

  /// The ring of the calling thread, or nullptr where it is no component's. [rt]
  static TraceRing* of_this_thread() MAUVE_RT { return MAUVE_RT_TRUSTED(detail::this_threads_ring); }
  /// Called by the component's thread itself at its start. [setup]
  static void set_for_this_thread(TraceRing* ring) noexcept { detail::this_threads_ring = ring; }

 private:
  std::unique_ptr<TraceRecord[]> places_;
  std::size_t mask_;
  std::uint16_t component_;
  std::uint64_t first_{0};
  const Clock* clock_{nullptr};  // nullptr: monotonic, without a virtual call
  alignas(64) Atomic<std::uint64_t> head_{0};
  std::uint64_t seen_tail_{0};
  Atomic<std::uint64_t> dropped_{0};
  alignas(64) Atomic<std::uint64_t> tail_{0};
};

/// Records an event of the user's own on the calling component's thread; nothing elsewhere. [rt]
inline void trace_mark(std::uint32_t name, std::int64_t a = 0, std::int64_t b = 0, std::int64_t c = 0)
    MAUVE_RT {
  if (TraceRing* ring = TraceRing::of_this_thread()) ring->push(TraceKind::mark, name, a, b, c);
}

/// Records begin and end of a service on the calling thread, also when it throws. All functions [rt].
class ServiceSpan {
 public:
  explicit ServiceSpan(std::uint32_t name) MAUVE_RT : name_(name), ring_(TraceRing::of_this_thread()) {
    if (ring_ != nullptr) ring_->push(TraceKind::service_begin, name_);
  }
  ~ServiceSpan() {
    if (ring_ != nullptr) ring_->push(TraceKind::service_end, name_);
  }
  ServiceSpan(const ServiceSpan&) = delete;
  ServiceSpan& operator=(const ServiceSpan&) = delete;

 private:
  std::uint32_t name_;
  TraceRing* ring_;
};

}  // namespace mauve
