// SPDX-License-Identifier: LGPL-3.0-or-later
// Trace records in per-thread wait-free rings; loss is counted, never silent.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "mauve_rt/base/record_ring.hpp"
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

/// The trace of one component, written by its thread; wait-free there.
class TraceRing {
 public:
  /// As of RecordRing. [setup]
  explicit TraceRing(std::uint16_t component, std::size_t capacity = kDefaultCapacity)
      : ring_(capacity), component_(component) {}
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
    TraceRecord* const place = ring_.next_place();
    if (place == nullptr) [[unlikely]]
      return;
    *place = {.sequence = first_ + ring_.offered(),
              .time_ns = time_ns,
              .a = a,
              .b = b,
              .c = c,
              .name = name,
              .kind = static_cast<std::uint16_t>(kind),
              .component = component_};
    ring_.publish();
  }

  /// As of RecordRing. [non-rt], one thread at a time.
  void drain(std::vector<TraceRecord>& into) { ring_.drain(into); }
  /// Likewise. [rt]
  void warm_up() const MAUVE_RT { ring_.warm_up(); }
  std::uint64_t offered() const MAUVE_RT { return ring_.offered(); }
  std::uint64_t dropped() const MAUVE_RT { return ring_.dropped(); }

  /// The ring of the calling thread, or nullptr where it is no component's. [rt]
  static TraceRing* of_this_thread() MAUVE_RT { return MAUVE_RT_TRUSTED(detail::this_threads_ring); }
  /// Called by the component's thread itself at its start. [setup]
  static void set_for_this_thread(TraceRing* ring) noexcept { detail::this_threads_ring = ring; }

 private:
  RecordRing<TraceRecord> ring_;
  std::uint16_t component_;
  std::uint64_t first_{0};
  const Clock* clock_{nullptr};  // nullptr: monotonic, without a virtual call
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
