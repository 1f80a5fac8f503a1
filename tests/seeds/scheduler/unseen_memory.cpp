// SPDX-License-Identifier: LGPL-3.0-or-later
// For test_seeds under ThreadSanitizer: these functions of the system report what they touch, even to a caller that it does not compile. The
// scenarios note without locks what they see, in their own strings too: what they call are the functions of this source.
#include <cstddef>
#include <cstdlib>

extern "C" {

void AnnotateIgnoreReadsBegin(const char* file, int line);
void AnnotateIgnoreReadsEnd(const char* file, int line);
void AnnotateIgnoreWritesBegin(const char* file, int line);
void AnnotateIgnoreWritesEnd(const char* file, int line);

/// The counts of a std::shared_ptr are updated in sources that ThreadSanitizer does not compile, too: it sees the last user free them alone.
const char* __tsan_default_suppressions() { return "race:std::_Sp_counted_*::_M_destroy\n"; }

/// A thread that is about to end is not waited for when the process ends.
const char* __tsan_default_options() { return "atexit_sleep_ms=0"; }

#pragma GCC visibility push(hidden)  // the kernel goes on calling those of the system

void* memmove(void* to, const void* from, std::size_t length) {
  auto* const target = static_cast<unsigned char*>(to);
  const auto* const source = static_cast<const unsigned char*>(from);
  if (target < source) {
    for (std::size_t i = 0; i < length; ++i) target[i] = source[i];
  } else {
    for (std::size_t i = length; i > 0; --i) target[i - 1] = source[i - 1];
  }
  return to;
}
void* memcpy(void* to, const void* from, std::size_t length) { return memmove(to, from, length); }
void* memset(void* to, int value, std::size_t length) {
  for (std::size_t i = 0; i < length; ++i)
    static_cast<unsigned char*>(to)[i] = static_cast<unsigned char>(value);
  return to;
}
int memcmp(const void* one, const void* other, std::size_t length) {
  const auto* const left = static_cast<const unsigned char*>(one);
  const auto* const right = static_cast<const unsigned char*>(other);
  for (std::size_t i = 0; i < length; ++i) {
    if (left[i] != right[i]) return left[i] < right[i] ? -1 : 1;
  }
  return 0;
}
std::size_t strlen(const char* text) {
  std::size_t length = 0;
  while (text[length] != '\0') ++length;
  return length;
}

// operator delete. What is used after it AddressSanitizer finds.
void delete_unseen(void* address) noexcept __asm__("_ZdlPv");
void delete_unseen(void* address) noexcept {
  AnnotateIgnoreReadsBegin(__FILE__, __LINE__);
  AnnotateIgnoreWritesBegin(__FILE__, __LINE__);
  std::free(address);
  AnnotateIgnoreWritesEnd(__FILE__, __LINE__);
  AnnotateIgnoreReadsEnd(__FILE__, __LINE__);
}
void delete_sized_unseen(void* address, std::size_t bytes) noexcept __asm__("_ZdlPvm");
void delete_sized_unseen(void* address, std::size_t /*bytes*/) noexcept { delete_unseen(address); }

}  // extern "C"
