// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/base/trace.hpp"

#include <map>

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

}  // namespace mauve
