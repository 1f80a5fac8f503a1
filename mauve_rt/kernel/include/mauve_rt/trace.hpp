// SPDX-License-Identifier: LGPL-3.0-or-later
// Trace records in per-thread wait-free rings; loss is counted, never silent.
#pragma once

#include <atomic>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "mauve_rt/time.hpp"

namespace mauve {

/// Kinds of records; what a, b and c mean stands in mauve_msgs/msg/TraceRecord.msg, constant by constant.
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
  /// All words by number. [non-rt]
  static std::vector<std::string> all();
};

/// Single producer (the component's thread), single consumer (who drains). wait-free on the producer's side.
///
/// | member   | written by | order                                                               |
/// | -------- | ---------- | ------------------------------------------------------------------- |
/// | head_    | producer   | release: publishes the record written before; the drain acquires    |
/// | tail_    | consumer   | release: frees the place only after the copy; the producer acquires |
/// | offered_ | producer   | relaxed: a count; its reader takes whatever is newest               |
/// | dropped_ | producer   | relaxed: likewise                                                   |
class TraceRing {
 public:
  /// Capacity is rounded up to a power of two; all pages are touched. [setup]
  explicit TraceRing(std::uint16_t component, std::size_t capacity = 4096);

  /// Records an event now, or at the time given; counted as dropped when the ring is full. [rt]
  void push(TraceKind kind, std::uint32_t name = 0, std::int64_t a = 0, std::int64_t b = 0,
            std::int64_t c = 0) noexcept {
    push_at(monotonic_now_ns(), kind, name, a, b, c);
  }
  void push_at(time_ns_t time_ns, TraceKind kind, std::uint32_t name = 0, std::int64_t a = 0,
               std::int64_t b = 0, std::int64_t c = 0) noexcept;

  /// Appends all records to the vector and frees their places. [non-rt], one thread at a time.
  void drain(std::vector<TraceRecord>& into);
  std::uint64_t offered() const noexcept { return offered_.load(std::memory_order_relaxed); }
  std::uint64_t dropped() const noexcept { return dropped_.load(std::memory_order_relaxed); }

  /// The ring of the calling thread, or nullptr where it is no component's. [rt]
  static TraceRing* of_this_thread() noexcept;
  /// Called by the component's thread itself at its start. [setup]
  static void set_for_this_thread(TraceRing* ring) noexcept;

 private:
  std::vector<TraceRecord> places_;
  std::size_t mask_;
  std::uint16_t component_;
  alignas(64) std::atomic<std::uint64_t> head_{0};
  std::atomic<std::uint64_t> offered_{0};
  std::atomic<std::uint64_t> dropped_{0};
  alignas(64) std::atomic<std::uint64_t> tail_{0};
};

/// Records an event of the user's own on the calling component's thread; nothing elsewhere. [rt]
inline void trace_mark(std::uint32_t name, std::int64_t a = 0, std::int64_t b = 0,
                       std::int64_t c = 0) noexcept {
  if (TraceRing* ring = TraceRing::of_this_thread()) ring->push(TraceKind::mark, name, a, b, c);
}

}  // namespace mauve
