// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/base/trace.hpp"

#include <bit>
#include <map>

#include "mauve_rt/base/contract.hpp"
#include "mauve_rt/base/seam/mutex.hpp"

namespace mauve {

namespace {

struct NameTable {
  Mutex mutex;
  std::vector<std::string> words MAUVE_GUARDED_BY(mutex){""};  // 0: no name
  std::map<std::string, std::uint32_t, std::less<>> numbers MAUVE_GUARDED_BY(mutex){{"", 0}};
};

NameTable& name_table() {
  static NameTable table;
  return table;
}

}  // namespace

constinit thread_local TraceRing* detail::this_threads_ring = nullptr;

std::uint32_t TraceNames::intern(std::string_view word) {
  NameTable& table = name_table();
  const LockGuard lock(table.mutex);
  if (const auto known = table.numbers.find(word); known != table.numbers.end()) return known->second;
  const auto number = static_cast<std::uint32_t>(table.words.size());
  table.words.emplace_back(word);
  table.numbers.emplace(word, number);
  return number;
}

std::string TraceNames::word(std::uint32_t number) {
  NameTable& table = name_table();
  const LockGuard lock(table.mutex);
  return number < table.words.size() ? table.words[number] : "";
}

std::vector<std::string> TraceNames::all() {
  NameTable& table = name_table();
  const LockGuard lock(table.mutex);
  return table.words;
}

TraceRing::TraceRing(std::uint16_t component, std::size_t capacity)
    : places_(std::make_unique<TraceRecord[]>(std::bit_ceil(capacity))),
      mask_(std::bit_ceil(capacity) - 1),
      component_(component) {}

void TraceRing::drain(std::vector<TraceRecord>& into) {
  const std::uint64_t head = head_.load(std::memory_order_acquire);
  std::uint64_t tail = tail_.load(std::memory_order_relaxed);  // relaxed: only the consumer writes it
  MAUVE_EXPECTS(head - tail <= mask_ + 1);
  for (; tail != head; ++tail) into.push_back(places_[tail & mask_]);
  tail_.store(tail, std::memory_order_release);
}

}  // namespace mauve
