// SPDX-License-Identifier: LGPL-3.0-or-later
// A register for one writer and a fixed number of readers that neither block nor retry.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <type_traits>
#include <vector>

#include "mauve_rt/base/contract.hpp"
#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/base/seam/atomic.hpp"
#include "mauve_rt/base/sequence_cell.hpp"
#include "mauve_rt/data/service.hpp"

namespace mauve {

/// Wait-free multi-word register by counting who took a slot and who gave it back: ARC (M. Ianni, A.
/// Pellegrini, F. Quaglia: "A Wait-free Multi-word Atomic (1,N) Register for Large-scale Data Sharing on
/// Multi-core Machines", CLUSTER 2017).
///
/// One word holds the index of the newest slot and how many readers took that slot while it was the newest. A
/// reader keeps the slot it read last; while that one is still the newest, a read takes one load and the
/// copy. The writer fills a slot that as many gave back as had taken, then exchanges the word, which tells it
/// how many took the slot before. With readers + 2 slots one is always free: each reader keeps at most one,
/// one is the newest.
///
/// Small values lie in front_ too, where a read costs what a sequence lock costs and writes nothing. A reader that
/// meets writes there kCopies times goes to the slots, where it finds nothing older than front_ has shown to anybody before: it
/// has seen a newer write begin, and each write begins after the exchange of the one before. look() asks only the slots, and may
/// be one write behind what read() has shown.
///
/// More readers can come while it is in use: reserve() makes another table, with the same slots and new ones. Who reads the
/// old one goes on with it, so it is kept to the end.
///
/// tests/models/loom has what goes wrong without each order and each guard.
///
/// | member         | written by             | read by         | order                                           |
/// | -------------- | ---------------------- | --------------- | ----------------------------------------------- |
/// | word_          | writer, readers        | writer, readers | acq_rel: the reader finds what the writer filled, the writer finds what a reader gave back before it took |
/// | table_         | reserve()              | writer, readers | release / acquire; who finds a slot's index in word_ finds the slot in the table |
/// | slots_, tables_ | reserve()             | reserve()       | one thread at a time                            |
/// | Slot::entry    | writer, nobody else in | who took it     | by word_ and released                           |
/// | Slot::taken    | writer                 | writer          | -                                               |
/// | Slot::released | readers; writer resets | writer          | readers release after the copy, writer acquires |
/// | Slot::is_borrowed | writers             | writers         | the lock that writers hold                      |
template <typename T>
class LatestRegister {
 public:
  struct Entry {
    std::uint64_t sequence{0};  // 0: never written
    time_ns_t time_ns{0};
    T value{};
  };

  /// `prepare`: gives a slot's value what memory it needs. [setup]
  explicit LatestRegister(std::size_t readers, std::function<void(T&)> prepare = {})
      : prepare_(std::move(prepare)) {
    reserve(readers);
  }

  /// Trivially copyable types up to this many bytes are copied from front_ first.
  static constexpr std::size_t kSmall = 112;  // with version and time two cache lines
  static constexpr bool kHasFront = std::is_trivially_copyable_v<T> && sizeof(T) <= kSmall;

  /// Makes room for so many readers, also while the others read and write; and for writers that borrow. [non-rt]
  /// One thread at a time.
  void reserve(std::size_t readers, std::size_t borrowers = 0) {
    borrowers_ = std::max(borrowers_, borrowers);
    if (readers + borrowers_ + 2 <= slots_.size()) return;
    while (slots_.size() < readers + borrowers_ + 2) {
      slots_.push_back(std::make_unique<Slot>());
      if (prepare_) prepare_(slots_.back()->entry.value);
    }
    auto table = std::make_unique<Table>();
    for (const auto& slot : slots_) table->push_back(slot.get());
    tables_.push_back(std::move(table));
    table_.store(tables_.back().get(), std::memory_order_release);
  }
  /// How many values it has memory for. [non-rt] As reserve().
  std::size_t slots() const noexcept { return slots_.size(); }
  /// How many readers may keep a slot. [rt] As reserve().
  std::size_t room() const MAUVE_RT { return slots_.size() - borrowers_ - 2; }

  /// Publishes a value, in at most as many looks for a free slot as there are. [rt] One thread at a time.
  /// False, and nothing written, only when more readers than declared keep slots.
  bool write(const T& value, time_ns_t time_ns) MAUVE_RT {
    const Table& slots = *table_.load(std::memory_order_acquire);
    const std::size_t i = free_slot(slots);
    if (i == kNone) return false;
    slots[i]->entry.value = value;
    if constexpr (kHasFront) front_.store(value, time_ns, sequence_ + 1);
    publish(i, time_ns, slots);
    return true;
  }

  // Who writes in place holds a slot meanwhile; these two run one at a time with write(), what is between them need not.

  /// A free slot's value, which no reader and no other writer uses; nullptr: there is none. [rt]
  T* borrow() MAUVE_RT {
    const Table& slots = *table_.load(std::memory_order_acquire);
    const std::size_t i = free_slot(slots);
    if (i == kNone) return nullptr;
    slots[i]->is_borrowed = true;
    return &slots[i]->entry.value;
  }
  /// Ends the loan; `time_ns`: and publishes the value, written then. [rt]
  void give_back(const T& borrowed, const time_ns_t* time_ns) MAUVE_RT {
    const Table& slots = *table_.load(std::memory_order_acquire);
    std::size_t i = 0;
    while (&slots[i]->entry.value != &borrowed) ++i;
    slots[i]->is_borrowed = false;
    if (time_ns == nullptr) return;
    if constexpr (kHasFront) front_.store(borrowed, *time_ns, sequence_ + 1);
    publish(i, *time_ns, slots);
  }
  /// How many slots are borrowed. [rt] As borrow().
  std::size_t borrowed() const MAUVE_RT {
    const Table& slots = *table_.load(std::memory_order_acquire);
    return static_cast<std::size_t>(
        std::count_if(slots.begin(), slots.end(), [](const Slot* slot) { return slot->is_borrowed; }));
  }

  /// The newest entry as a port sees it; `fallback` when there is none. [rt] wait-free.
  Sample<T> sample(const T& fallback, ReaderState& reader) MAUVE_RT {
    if constexpr (kHasSequences<T>) {
      return {};  // no port asks: a copy would allocate
    } else if constexpr (kHasFront) {
      Sample<T> sample{.value = fallback};
      sample.status = read(sample.value, sample.time_ns, reader);
      return sample;
    } else {  // one copy
      const Entry& entry = newest(reader.held);
      if (entry.sequence == 0) return {.value = fallback};
      return {.value = entry.value, .status = reader.look(entry.sequence), .time_ns = entry.time_ns};
    }
  }
  /// The same into a place of the caller's, untouched when there is none. [rt] wait-free.
  DataStatus read(T& value, time_ns_t& time_ns, ReaderState& reader) MAUVE_RT {
    std::uint64_t sequence = 0;
    if constexpr (kHasFront) {
      if (!front_.load(value, time_ns, sequence)) [[unlikely]]
        sequence = read_contended(value, time_ns, reader);
    } else {
      sequence = read_slot(value, time_ns, reader);
    }
    return sequence == 0 ? DataStatus::none : reader.look(sequence);
  }
  /// The newest value in place, until the reader lets it go; nullptr: there is none. [rt] wait-free.
  const T* look(std::uint32_t& held) MAUVE_RT {
    const Entry& entry = newest(held);
    return entry.sequence == 0 ? nullptr : &entry.value;
  }
  /// The same with all that a port wants to know; until the reader's next call. [rt] wait-free.
  Loan<T> lend(ReaderState& reader) MAUVE_RT {
    const Entry& entry = newest(reader.held);
    if (entry.sequence == 0) return {};
    return {&entry.value, reader.look(entry.sequence), entry.time_ns};
  }
  /// Gives back what the reader keeps. [rt] wait-free.
  void let_go(std::uint32_t& held) MAUVE_RT {
    if (held == 0) return;
    slot(held).released.fetch_add(1, std::memory_order_release);  // release: the copy is done
    held = 0;
  }

 private:
  static constexpr unsigned kCountBits = 48;
  static constexpr std::uint64_t kCountMask = (std::uint64_t{1} << kCountBits) - 1;
  static constexpr std::size_t kCacheLine = 64;
  static constexpr std::size_t kNone = SIZE_MAX;
  static constexpr int kCopies = 8;  // tries: together about as long as one take of a contended slot
  struct Nothing {};

  struct alignas(kCacheLine) Slot {
    Atomic<std::uint64_t> released{0};
    std::uint64_t taken{0};
    bool is_borrowed{false};
    Entry entry;
  };

  using Table = std::vector<Slot*>;

  static std::size_t index_of(std::uint64_t word) noexcept { return word >> kCountBits; }
  static std::size_t next(std::size_t i, const Table& slots) noexcept {
    return i + 1 == slots.size() ? 0 : i + 1;
  }
  /// One that neither readers nor a borrower use, and that is not the newest; kNone: there is none.
  std::size_t free_slot(const Table& slots) noexcept {
    const std::size_t newest =
        index_of(word_.load(std::memory_order_relaxed));  // relaxed: written by writers only
    MAUVE_AUDIT(newest < slots.size());
    const auto is_free = [&](Slot& slot) MAUVE_RT {
      // acquire: what its readers copied, they have copied
      if (slot.released.load(std::memory_order_acquire) != slot.taken) return false;
      return !kIsLarge<T> || !slot.is_borrowed;
    };
    if constexpr (kIsLarge<T>) {  // the same few, which the caches have
      for (std::size_t i = 0; i < slots.size(); ++i) {
        if (i != newest && is_free(*slots[i])) return i;
      }
    } else {
      for (std::size_t i = next(newest, slots); i != newest; i = next(i, slots)) {
        if (is_free(*slots[i])) return i;
      }
    }
    return kNone;
  }
  /// A free or borrowed slot that was filled becomes the newest.
  void publish(std::size_t i, time_ns_t time_ns, const Table& slots) noexcept {
    const std::size_t newest =
        index_of(word_.load(std::memory_order_relaxed));  // relaxed: written by writers only
    Slot& slot = *slots[i];
    slot.released.store(0, std::memory_order_relaxed);  // relaxed: published with the word
    slot.entry.time_ns = time_ns;
    slot.entry.sequence = ++sequence_;
    // release: publishes the slot. acquire: who has taken one gave another one back before; else none might look free
    const std::uint64_t before = word_.exchange(i << kCountBits, std::memory_order_acq_rel);
    MAUVE_AUDIT(index_of(before) == newest);  // else another thread writes, too
    slots[newest]->taken = before & kCountMask;
  }
  Slot& slot(std::uint32_t held) noexcept {
    const Table& slots = *table_.load(std::memory_order_acquire);
    MAUVE_AUDIT(held != 0 && held <= slots.size());
    return *slots[held - 1];
  }

  /// The newest slot, untouched until the reader's next call.
  const Entry& newest(std::uint32_t& held) noexcept {
    // relaxed: a slot that is kept was acquired when it was taken, and is not filled anew while kept
    if (held != index_of(word_.load(std::memory_order_relaxed)) + 1) take_newest(held);
    return slot(held).entry;
  }
  /// Returns the sequence found.
  std::uint64_t read_slot(T& value, time_ns_t& time_ns, ReaderState& reader) noexcept {
    const Entry& entry = newest(reader.held);
    if (entry.sequence == 0) return 0;
    value = entry.value;
    time_ns = entry.time_ns;
    return entry.sequence;
  }
  /// After a first copy of front_ that failed. Out of line: the common way stays short.
  [[gnu::noinline]] std::uint64_t read_contended(T& value, time_ns_t& time_ns, ReaderState& reader) noexcept {
    std::uint64_t sequence = 0;
    for (int i = 1; i < kCopies; ++i) {
      if (front_.load(value, time_ns, sequence)) return sequence;
    }
    return read_slot(value, time_ns, reader);
  }

  void take_newest(std::uint32_t& held) noexcept {
    let_go(held);
    // acquire: pairs with the exchange, through the additions of other readers. release: with the next exchange
    const std::uint64_t before = word_.fetch_add(1, std::memory_order_acq_rel);
    MAUVE_AUDIT((before & kCountMask) != kCountMask);  // else the count would run into the index
    held = static_cast<std::uint32_t>(index_of(before)) + 1;
  }

  [[no_unique_address]] std::conditional_t<kHasFront, SequenceCell<T>, Nothing> front_;
  alignas(kCacheLine) Atomic<std::uint64_t> word_{0};
  alignas(kCacheLine) std::uint64_t sequence_{0};  // of the writer
  alignas(kCacheLine) Atomic<const Table*> table_{nullptr};
  const std::function<void(T&)> prepare_;
  std::size_t borrowers_{0};
  std::vector<std::unique_ptr<Slot>> slots_;
  std::vector<std::unique_ptr<Table>> tables_;
};

}  // namespace mauve
