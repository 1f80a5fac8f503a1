// SPDX-License-Identifier: LGPL-3.0-or-later
// Replacements of the global operators new and delete: malloc and free, and a count for threads that want one.
// Memory may cross freely between these and the C++ library's own, which are malloc and free as well; so a
// process may load this library at any time. A sanitizer has operators of its own, which must stay.
#include "base/allocation.hpp"

#include <algorithm>
#include <cstdlib>
#include <new>

namespace mauve {

namespace {

// A pointer to the counter, not the counter: other threads read it. One thread-local look-up an allocation.
constinit thread_local std::atomic<std::uint64_t>* this_threads_counter = nullptr;

}  // namespace

std::atomic<std::uint64_t>* allocation_counter() noexcept { return this_threads_counter; }
void set_allocation_counter(std::atomic<std::uint64_t>* counter) noexcept { this_threads_counter = counter; }

}  // namespace mauve

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)

namespace {

void count_one() noexcept {
  // relaxed, and no read-modify-write: only the calling thread writes it
  if (auto* counter = mauve::this_threads_counter) {
    counter->store(counter->load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
  }
}

/// As [new.delete.single] asks: tries until the memory is there or no handler is left.
template <typename Try>
void* allocate(Try&& try_once) {
  count_one();
  for (;;) {
    if (void* memory = try_once()) return memory;
    const std::new_handler handler = std::get_new_handler();
    if (handler == nullptr) throw std::bad_alloc();
    handler();
  }
}

void* allocate(std::size_t size) {
  return allocate([size] { return std::malloc(size == 0 ? 1 : size); });
}

void* allocate(std::size_t size, std::align_val_t alignment) {
  return allocate([size, alignment] {
    void* memory = nullptr;
    const auto bytes = std::max(static_cast<std::size_t>(alignment), sizeof(void*));
    return posix_memalign(&memory, bytes, size == 0 ? 1 : size) == 0 ? memory : nullptr;
  });
}

template <typename... Arguments>
void* allocate_or_null(Arguments... arguments) noexcept {
  try {
    return allocate(arguments...);
  } catch (...) {
    return nullptr;
  }
}

}  // namespace

void* operator new(std::size_t size) { return allocate(size); }
void* operator new[](std::size_t size) { return allocate(size); }
void* operator new(std::size_t size, const std::nothrow_t&) noexcept { return allocate_or_null(size); }
void* operator new[](std::size_t size, const std::nothrow_t&) noexcept { return allocate_or_null(size); }
void* operator new(std::size_t size, std::align_val_t alignment) { return allocate(size, alignment); }
void* operator new[](std::size_t size, std::align_val_t alignment) { return allocate(size, alignment); }
void* operator new(std::size_t size, std::align_val_t alignment, const std::nothrow_t&) noexcept {
  return allocate_or_null(size, alignment);
}
void* operator new[](std::size_t size, std::align_val_t alignment, const std::nothrow_t&) noexcept {
  return allocate_or_null(size, alignment);
}

void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete(void* memory, const std::nothrow_t&) noexcept { std::free(memory); }
void operator delete[](void* memory, const std::nothrow_t&) noexcept { std::free(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::align_val_t, const std::nothrow_t&) noexcept { std::free(memory); }
void operator delete[](void* memory, std::align_val_t, const std::nothrow_t&) noexcept { std::free(memory); }

#endif
