// SPDX-License-Identifier: LGPL-3.0-or-later
// RecordRing: places of fixed size between one producer and one consumer; loss is counted, never silent.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "mauve_rt/base/contract.hpp"
#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/base/seam/atomic.hpp"

namespace mauve {

/// Single producer, single consumer. wait-free on the producer's side.
///
/// | member     | written by | order                                                               |
/// | ---------- | ---------- | ------------------------------------------------------------------- |
/// | head_      | producer   | release: publishes the record written before; the drain acquires    |
/// | seen_tail_ | producer   | its own: the tail as it last looked                                 |
/// | dropped_   | producer   | relaxed: a count; its reader takes whatever is newest               |
/// | tail_      | consumer   | release: frees the place only after the copy; the producer acquires |
/// | the rest   | [setup]    | -                                                                   |
template <typename Record>
class RecordRing {
 public:
  /// Capacity is rounded up to a power of two; all pages are touched. [setup]
  explicit RecordRing(std::size_t capacity)
      : places_(std::make_unique<Record[]>(std::bit_ceil(capacity))), mask_(std::bit_ceil(capacity) - 1) {}

  /// The place to write, which publish() hands over; nullptr: the ring is full, and that is counted. [rt]
  Record* next_place() MAUVE_RT {
    const std::uint64_t head = head_.load(std::memory_order_relaxed);  // relaxed: only this thread writes it
    MAUVE_AUDIT(head - seen_tail_ <= mask_ + 1);
    if (head - seen_tail_ > mask_) [[unlikely]] {
      seen_tail_ = tail_.load(std::memory_order_acquire);
      if (head - seen_tail_ > mask_) {
        dropped_.store(dropped() + 1, std::memory_order_relaxed);
        return nullptr;
      }
    }
    return &places_[head & mask_];
  }
  /// [rt]
  void publish() MAUVE_RT {
    head_.store(head_.load(std::memory_order_relaxed) + 1, std::memory_order_release);
  }

  /// Fetches the places that come next to the processor of the producer. [rt]
  void warm_up() const MAUVE_RT {
    constexpr std::uint64_t kPlaces = 16;
    const std::uint64_t head = head_.load(std::memory_order_relaxed);
    for (std::uint64_t at = head; at < head + kPlaces; ++at) __builtin_prefetch(&places_[at & mask_], 1);
  }

  /// Appends all records to the vector and frees their places. [non-rt], one thread at a time.
  void drain(std::vector<Record>& into) {
    const std::uint64_t head = head_.load(std::memory_order_acquire);
    std::uint64_t tail = tail_.load(std::memory_order_relaxed);  // relaxed: only the consumer writes it
    MAUVE_EXPECTS(head - tail <= mask_ + 1);
    for (; tail != head; ++tail) into.push_back(places_[tail & mask_]);
    tail_.store(tail, std::memory_order_release);
  }
  /// Records offered so far, dropped ones among them; exact while the producer rests. [rt]
  std::uint64_t offered() const MAUVE_RT { return head_.load(std::memory_order_relaxed) + dropped(); }
  /// [rt]
  std::uint64_t dropped() const MAUVE_RT { return dropped_.load(std::memory_order_relaxed); }

 private:
  std::unique_ptr<Record[]> places_;
  std::size_t mask_;
  alignas(64) Atomic<std::uint64_t> head_{0};
  std::uint64_t seen_tail_{0};
  Atomic<std::uint64_t> dropped_{0};
  alignas(64) Atomic<std::uint64_t> tail_{0};
};

}  // namespace mauve
