// SPDX-License-Identifier: LGPL-3.0-or-later
#include "prefault.hpp"

#include <pthread.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <charconv>
#include <cstdint>
#include <fstream>
#include <mutex>
#include <sstream>
#include <string>
#include <vector>

namespace mauve {

namespace {

#ifndef MADV_POPULATE_WRITE
constexpr int MADV_POPULATE_WRITE = 23;  // Linux 5.14
#endif

constexpr std::uintptr_t kMostOfOneMapping = std::uintptr_t{1} << 30U;
constexpr std::uintptr_t kArenaAlignment = std::uintptr_t{64} << 20U;  // glibc's HEAP_MAX_SIZE on 64 bits

/// Addresses, the end not included.
struct Range {
  std::uintptr_t begin{0};
  std::uintptr_t end{0};
};

/// A line of /proc/self/maps.
struct Mapping {
  Range range;
  bool is_accessible{false};
  bool is_private_memory{false};  // writable, private, of no file
  bool is_main_heap{false};
};

bool read_mapping(const std::string& line, Mapping& mapping) {
  const char* const last = line.data() + line.size();
  const auto begin = std::from_chars(line.data(), last, mapping.range.begin, 16);
  if (begin.ec != std::errc{} || begin.ptr == last) return false;
  const auto end = std::from_chars(begin.ptr + 1, last, mapping.range.end, 16);
  if (end.ec != std::errc{}) return false;
  std::istringstream rest(std::string(end.ptr, last));
  std::string permissions;
  std::string offset;
  std::string device;
  std::string inode;
  std::string name;
  if (!(rest >> permissions >> offset >> device >> inode)) return false;
  rest >> name;
  mapping.is_accessible = permissions.compare(0, 3, "---") != 0;
  mapping.is_main_heap = name == "[heap]";
  mapping.is_private_memory = permissions == "rw-p" && inode == "0" &&
                              (name.empty() || mapping.is_main_heap || name.starts_with("[anon"));
  return true;
}

std::vector<Mapping> read_mappings() {
  std::ifstream maps("/proc/self/maps");
  std::vector<Mapping> found;
  for (std::string line; std::getline(maps, line);) {
    if (Mapping mapping; read_mapping(line, mapping)) found.push_back(mapping);
  }
  return found;
}

std::uintptr_t usual_stack_bytes() {
  pthread_attr_t attributes;
  std::size_t bytes = 0;
  if (pthread_getattr_default_np(&attributes) != 0) return 0;
  pthread_attr_getstacksize(&attributes, &bytes);
  pthread_attr_destroy(&attributes);
  return bytes;
}

/// What may be the allocator's of a mapping, and whether it is for sure.
struct Candidate {
  Range range;
  bool is_arena{false};
};

std::vector<Candidate> candidates(const std::vector<Mapping>& mappings) {
  const std::uintptr_t stack_bytes = usual_stack_bytes();
  std::vector<Candidate> found;
  for (std::size_t i = 0; i < mappings.size(); ++i) {
    const Mapping& mapping = mappings[i];
    Range range = mapping.range;
    if (!mapping.is_private_memory || range.end - range.begin > kMostOfOneMapping) continue;
    const auto is_barred = [&](std::size_t other) { return !mappings[other].is_accessible; };
    const bool room_above =
        i + 1 < mappings.size() && mappings[i + 1].range.begin == range.end && is_barred(i + 1);
    const bool guard_below = i > 0 && mappings[i - 1].range.end == range.begin && is_barred(i - 1);
    const bool is_arena = mapping.is_main_heap || (room_above && range.begin % kArenaAlignment == 0);
    // Above a guard lies a thread's stack; what was allocated right above that may be one mapping with it.
    if (guard_below && !is_arena) range.begin += std::min(stack_bytes, range.end - range.begin);
    if (range.begin < range.end) found.push_back({range, is_arena});
  }
  return found;
}

/// The parts of a range that are in none of the others, which are in order.
std::vector<Range> without(Range range, const std::vector<Range>& others) {
  std::vector<Range> left;
  for (const Range& other : others) {
    if (other.end <= range.begin) continue;
    if (other.begin >= range.end) break;
    if (other.begin > range.begin) left.push_back({range.begin, other.begin});
    range.begin = std::max(range.begin, std::min(other.end, range.end));
  }
  if (range.begin < range.end) left.push_back(range);
  return left;
}

/// The parts of the ones that are in the others too; both are in order.
std::vector<Range> common(const std::vector<Range>& ones, const std::vector<Range>& others) {
  std::vector<Range> both;
  for (auto one = ones.begin(), other = others.begin(); one != ones.end() && other != others.end();) {
    const Range part{std::max(one->begin, other->begin), std::min(one->end, other->end)};
    if (part.begin < part.end) both.push_back(part);
    one->end < other->end ? ++one : ++other;
  }
  return both;
}

/// Whether the pages are in memory now. Another thread may unmap them at any time: nothing is touched here.
bool populate(Range range) noexcept {
  void* const from = reinterpret_cast<void*>(range.begin);
  const std::size_t bytes = range.end - range.begin;
  if (madvise(from, bytes, MADV_POPULATE_WRITE) == 0) return true;
  return errno == EINVAL && mlock(from, bytes) == 0;  // an older kernel; where memory may be locked
}

std::mutex before_mutex;
std::vector<Range> before;  // what is left of it
bool is_noted = false;

}  // namespace

void prefault(void* from, std::size_t bytes) noexcept {
  const auto page = static_cast<std::uintptr_t>(sysconf(_SC_PAGESIZE));
  const auto begin = reinterpret_cast<std::uintptr_t>(from) / page * page;
  const std::uintptr_t end = reinterpret_cast<std::uintptr_t>(from) + bytes;
  if (begin >= end || populate({begin, end})) return;
  // By an operation that changes nothing whoever else writes there.
  for (std::uintptr_t at = begin; at < end; at += page)
    std::atomic_ref(*reinterpret_cast<unsigned char*>(at)).fetch_or(0, std::memory_order_relaxed);
}

void note_allocated_before() noexcept {
  try {
    const std::lock_guard lock(before_mutex);
    if (is_noted) return;
    is_noted = true;
    for (const Mapping& mapping : read_mappings()) before.push_back(mapping.range);
  } catch (const std::exception&) {  // no memory, no /proc: then all of it counts as new
  }
}

void prefault_allocated() noexcept {
  try {
    const std::lock_guard lock(before_mutex);
    const std::vector<Mapping> mappings = read_mappings();
    std::vector<Range> now;
    now.reserve(mappings.size());
    for (const Mapping& mapping : mappings) now.push_back(mapping.range);
    before = common(before, now);
    for (const Candidate& candidate : candidates(mappings)) {
      if (candidate.is_arena) {
        populate(candidate.range);
        continue;
      }
      for (const Range& range : without(candidate.range, before)) populate(range);
    }
  } catch (const std::exception&) {  // no memory, no /proc: pages come when they are touched
  }
}

}  // namespace mauve
