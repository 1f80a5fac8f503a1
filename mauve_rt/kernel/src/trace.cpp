// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/trace.hpp"

#include <bit>
#include <map>
#include <mutex>

namespace mauve {

namespace {

struct NameTable {
  std::mutex mutex;
  std::vector<std::string> words{""};  // 0: no name
  std::map<std::string, std::uint32_t, std::less<>> numbers{{"", 0}};
};

NameTable& name_table() {
  static NameTable table;
  return table;
}

thread_local TraceRing* this_threads_ring = nullptr;

}  // namespace

std::uint32_t TraceNames::intern(std::string_view word) {
  NameTable& table = name_table();
  const std::lock_guard lock(table.mutex);
  if (const auto known = table.numbers.find(word); known != table.numbers.end()) return known->second;
  const auto number = static_cast<std::uint32_t>(table.words.size());
  table.words.emplace_back(word);
  table.numbers.emplace(word, number);
  return number;
}

std::vector<std::string> TraceNames::all() {
  NameTable& table = name_table();
  const std::lock_guard lock(table.mutex);
  return table.words;
}

TraceRing::TraceRing(std::uint16_t component, std::size_t capacity)
    : places_(std::bit_ceil(capacity)), mask_(places_.size() - 1), component_(component) {}

void TraceRing::push_at(time_ns_t time_ns, TraceKind kind, std::uint32_t name, std::int64_t a, std::int64_t b,
                        std::int64_t c) noexcept {
  const std::uint64_t sequence = offered_.load(std::memory_order_relaxed);
  offered_.store(sequence + 1, std::memory_order_relaxed);
  const std::uint64_t head = head_.load(std::memory_order_relaxed);  // relaxed: only this thread writes it
  if (head - tail_.load(std::memory_order_acquire) == places_.size()) {
    dropped_.store(dropped_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
    return;
  }
  places_[head & mask_] = {.sequence = sequence,
                           .time_ns = time_ns,
                           .a = a,
                           .b = b,
                           .c = c,
                           .name = name,
                           .kind = static_cast<std::uint16_t>(kind),
                           .component = component_};
  head_.store(head + 1, std::memory_order_release);
}

void TraceRing::drain(std::vector<TraceRecord>& into) {
  const std::uint64_t head = head_.load(std::memory_order_acquire);
  std::uint64_t tail = tail_.load(std::memory_order_relaxed);  // relaxed: only the consumer writes it
  for (; tail != head; ++tail) into.push_back(places_[tail & mask_]);
  tail_.store(tail, std::memory_order_release);
}

TraceRing* TraceRing::of_this_thread() noexcept { return this_threads_ring; }
void TraceRing::set_for_this_thread(TraceRing* ring) noexcept { this_threads_ring = ring; }

}  // namespace mauve
