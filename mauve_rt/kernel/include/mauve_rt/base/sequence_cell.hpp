// SPDX-License-Identifier: LGPL-3.0-or-later
// A small value that its readers copy without writing a word of shared memory; a read that meets a write fails.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>

#include "mauve_rt/base/contract.hpp"
#include "mauve_rt/base/seam/atomic.hpp"
#include "mauve_rt/base/time.hpp"

namespace mauve {

/// A sequence lock (H. Boehm: "Can seqlocks get along with programming language memory models?", MSPC 2012)
/// whose reader gives up instead of waiting.
///
/// | member   | written by | order                                                                           |
/// | -------- | ---------- | ------------------------------------------------------------------------------- |
/// | version_ | writer     | odd while it writes; both stores release, both loads acquire                    |
/// | time_ns_ | writer     | release: who sees it also sees version_ odd or newer; acquire: version_ is read |
/// | words_   | writer     | again only after them. Without fences, which ThreadSanitizer does not know      |
template <typename T>
class SequenceCell {
  static_assert(std::is_trivially_copyable_v<T>);
  static constexpr std::size_t kWords = (sizeof(T) + sizeof(std::uint64_t) - 1) / sizeof(std::uint64_t);

 public:
  /// Sequences count from 1, one by one. [rt] One thread at a time.
  void store(const T& value, time_ns_t time_ns, std::uint64_t sequence) MAUVE_RT {
    MAUVE_AUDIT(version_.load(std::memory_order_relaxed) ==
                2 * (sequence - 1));  // relaxed: written here only
    std::array<std::uint64_t, kWords> words{};
    std::memcpy(words.data(), &value, sizeof(T));
    version_.store(2 * sequence - 1, std::memory_order_release);
    time_ns_.store(time_ns, std::memory_order_release);
    for (std::size_t i = 0; i < kWords; ++i) words_[i].store(words[i], std::memory_order_release);
    version_.store(2 * sequence, std::memory_order_release);
  }

  /// The value's sequence, 0 when nothing was ever written; false, and nothing changed, when a write came in
  /// between. [rt] wait-free.
  bool load(T& value, time_ns_t& time_ns, std::uint64_t& sequence) const MAUVE_RT {
    const std::uint64_t before = version_.load(std::memory_order_acquire);
    if (before % 2 != 0) return false;
    const time_ns_t time = time_ns_.load(std::memory_order_acquire);
    std::array<std::uint64_t, kWords> words;
    for (std::size_t i = 0; i < kWords; ++i) words[i] = words_[i].load(std::memory_order_acquire);
    if (version_.load(std::memory_order_acquire) != before) return false;
    sequence = before / 2;
    if (sequence == 0) return true;
    std::memcpy(static_cast<void*>(&value), words.data(), sizeof(T));
    time_ns = time;
    return true;
  }

 private:
  alignas(64) Atomic<std::uint64_t> version_{0};
  Atomic<time_ns_t> time_ns_{0};
  std::array<Atomic<std::uint64_t>, kWords> words_{};
};

}  // namespace mauve
