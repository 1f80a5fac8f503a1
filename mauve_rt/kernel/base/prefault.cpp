// SPDX-License-Identifier: LGPL-3.0-or-later
#include "base/prefault.hpp"

#include <fcntl.h>
#include <pthread.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <charconv>
#include <cstdint>
#include <exception>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "mauve_rt/base/seam/mutex.hpp"

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

/// What can be read of it at once; empty when it cannot be.
std::string read_text(const char* path) {
  std::string text;
  const int file = open(path, O_RDONLY | O_CLOEXEC);
  if (file < 0) return text;
  std::array<char, 8192> part;
  for (ssize_t got = 0; (got = read(file, part.data(), part.size())) > 0;)
    text.append(part.data(), static_cast<std::size_t>(got));
  close(file);
  return text;
}

/// The next word of a line, which is cut off from it.
std::string_view take_word(std::string_view& line) {
  line.remove_prefix(std::min(line.find_first_not_of(' '), line.size()));
  const std::string_view word = line.substr(0, line.find(' '));
  line.remove_prefix(word.size());
  return word;
}

bool read_range(std::string_view word, Range& range) {
  const char* const first = word.data();
  const char* const last = first + word.size();
  const auto begin = std::from_chars(first, last, range.begin, 16);
  if (begin.ec != std::errc{} || begin.ptr == last) return false;
  return std::from_chars(begin.ptr + 1, last, range.end, 16).ec == std::errc{};
}

bool read_mapping(std::string_view line, Mapping& mapping) {
  if (!read_range(take_word(line), mapping.range)) return false;
  const std::string_view permissions = take_word(line);
  take_word(line);  // the offset
  take_word(line);  // the device
  const std::string_view inode = take_word(line);
  const std::string_view name = take_word(line);
  mapping.is_accessible = !permissions.starts_with("---");
  mapping.is_main_heap = name == "[heap]";
  mapping.is_private_memory = permissions == "rw-p" && inode == "0" &&
                              (name.empty() || mapping.is_main_heap || name.starts_with("[anon"));
  return true;
}

std::vector<Mapping> read_mappings() {
  const std::string text = read_text("/proc/self/maps");
  std::vector<Mapping> found;
  for (std::string_view rest = text; !rest.empty();) {
    const std::string_view line = rest.substr(0, rest.find('\n'));
    rest.remove_prefix(std::min(line.size() + 1, rest.size()));
    if (Mapping mapping; read_mapping(line, mapping)) found.push_back(mapping);
  }
  return found;
}

/// Pages of all private writable mappings: a mapping more, or a bigger heap or arena, makes it more. 0: not known.
std::uintptr_t private_pages() {
  const std::string text = read_text("/proc/self/statm");
  std::string_view rest = text;
  for (int field = 0; field < 5; ++field) take_word(rest);
  const std::string_view word = take_word(rest);
  std::uintptr_t pages = 0;
  const char* const first = word.data();
  std::from_chars(first, first + word.size(), pages);
  return pages;
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

/// Addresses come as text, out of a file.
void* to_pointer(std::uintptr_t address) noexcept {
  return reinterpret_cast<void*>(address);  // NOLINT(performance-no-int-to-ptr)
}

/// Whether the pages are in memory now. Another thread may unmap them at any time: nothing is touched here.
bool populate(Range range) noexcept {
  void* const from = to_pointer(range.begin);
  const std::size_t bytes = range.end - range.begin;
  if (madvise(from, bytes, MADV_POPULATE_WRITE) == 0) return true;
  return errno == EINVAL && mlock(from, bytes) == 0;  // an older kernel; where memory may be locked
}

/// Puts into memory what is missing of it: to ask takes some 1 ns a page, to populate what is there 200. False: some of
/// it is mapped no longer.
bool populate_missing(Range range) noexcept {
  static std::array<unsigned char, 16384> is_there;  // 64 MiB at once; under prefault_mutex
  const auto page = static_cast<std::uintptr_t>(sysconf(_SC_PAGESIZE));
  while (range.begin < range.end) {
    const std::uintptr_t count = std::min((range.end - range.begin) / page, is_there.size());
    if (mincore(to_pointer(range.begin), count * page, is_there.data()) != 0) return false;
    for (std::uintptr_t at = 0; at < count;) {
      const std::uintptr_t first = at;
      while (at < count && (is_there[at] & 1U) == 0) ++at;
      if (at > first) populate({range.begin + first * page, range.begin + at * page});
      if (at == first) ++at;
    }
    range.begin += count * page;
  }
  return true;
}

/// What prefault_allocated() knows of the process.
struct Looked {
  bool is_noted{false};
  std::vector<Range> before;        // what is left of it
  std::vector<Range> populated;     // by the last look
  std::uintptr_t private_pages{0};  // at the last look
};

Mutex prefault_mutex;
Looked looked MAUVE_GUARDED_BY(prefault_mutex);

/// With as many pages as then, and all mappings of then still there, no mapping is new. The allocator may have given
/// back the pages of a mapping, and taken it again: those are put into memory anew.
bool is_as_looked_at(std::uintptr_t pages) noexcept MAUVE_REQUIRES(prefault_mutex) {
  return pages != 0 && pages == looked.private_pages &&
         std::all_of(looked.populated.begin(), looked.populated.end(), populate_missing);
}

/// Reads the list of all mappings: with 850 of them 1 ms.
void look_anew(std::uintptr_t pages) MAUVE_REQUIRES(prefault_mutex) {
  const std::vector<Mapping> mappings = read_mappings();
  std::vector<Range> now;
  now.reserve(mappings.size());
  for (const Mapping& mapping : mappings) now.push_back(mapping.range);
  looked.before = common(looked.before, now);
  std::vector<Range> wanted;
  for (const Candidate& candidate : candidates(mappings)) {
    const std::vector<Range> parts = candidate.is_arena ? std::vector{candidate.range}  //
                                                        : without(candidate.range, looked.before);
    wanted.insert(wanted.end(), parts.begin(), parts.end());
  }
  for (const Range& range : wanted) {
    for (const Range& grown : without(range, looked.populated)) populate(grown);
    populate_missing(range);
  }
  looked.populated = std::move(wanted);
  looked.private_pages = pages;
}

}  // namespace

void prefault(void* from, std::size_t bytes) noexcept {
  const auto page = static_cast<std::uintptr_t>(sysconf(_SC_PAGESIZE));
  const auto begin = reinterpret_cast<std::uintptr_t>(from) / page * page;
  const std::uintptr_t end = reinterpret_cast<std::uintptr_t>(from) + bytes;
  if (begin >= end || populate({begin, end})) return;
  // By an operation that changes nothing whoever else writes there.
  for (std::uintptr_t at = begin; at < end; at += page)
    std::atomic_ref(*static_cast<unsigned char*>(to_pointer(at))).fetch_or(0, std::memory_order_relaxed);
}

void note_allocated_before() noexcept {
  try {
    const LockGuard lock(prefault_mutex);
    if (looked.is_noted) return;
    looked.is_noted = true;
    for (const Mapping& mapping : read_mappings()) looked.before.push_back(mapping.range);
  } catch (const std::exception&) {  // no memory, no /proc: then all of it counts as new
  }
}

void prefault_allocated() noexcept {
  try {
    const LockGuard lock(prefault_mutex);
    const std::uintptr_t pages = private_pages();  // before the look: what comes during it is for the next
    if (!is_as_looked_at(pages)) look_anew(pages);
  } catch (const std::exception&) {  // no memory, no /proc: pages come when they are touched
  }
}

}  // namespace mauve
