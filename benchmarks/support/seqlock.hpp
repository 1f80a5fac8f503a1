// SPDX-License-Identifier: LGPL-3.0-or-later
// The reference of a value that many read and one writes: a sequence lock (Boehm, "Can seqlocks get along with
// programming language memory models?", 2012). Its readers retry while somebody writes, without bound.
#pragma once

#include <array>
#include <atomic>
#include <bit>
#include <cstdint>

namespace bench {

template <typename T>
class Seqlock {
  static_assert(sizeof(T) % sizeof(std::uint64_t) == 0);
  using Words = std::array<std::uint64_t, sizeof(T) / sizeof(std::uint64_t)>;

 public:
  void write(const T& value) noexcept {
    const auto words = std::bit_cast<Words>(value);
    const std::uint64_t sequence = sequence_.load(std::memory_order_relaxed);  // relaxed: one writer
    sequence_.store(sequence + 1,
                    std::memory_order_relaxed);  // relaxed: the fence orders it before the words
    std::atomic_thread_fence(std::memory_order_release);
    for (std::size_t i = 0; i < words.size(); ++i) words_[i].store(words[i], std::memory_order_relaxed);
    sequence_.store(sequence + 2, std::memory_order_release);
  }

  /// Returns how often it had to try again.
  std::int64_t read(T& value) const noexcept {
    Words words;
    for (std::int64_t retries = 0;; ++retries) {
      const std::uint64_t before = sequence_.load(std::memory_order_acquire);
      for (std::size_t i = 0; i < words.size(); ++i) words[i] = words_[i].load(std::memory_order_relaxed);
      std::atomic_thread_fence(std::memory_order_acquire);
      if (before % 2 == 0 && sequence_.load(std::memory_order_relaxed) == before) {
        value = std::bit_cast<T>(words);
        return retries;
      }
    }
  }

 private:
  alignas(64) std::atomic<std::uint64_t> sequence_{0};
  std::array<std::atomic<std::uint64_t>, sizeof(T) / sizeof(std::uint64_t)> words_{};
};

}  // namespace bench
