// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/base/thread_counters.hpp"

#include <fcntl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory_resource>
#include <new>
#include <optional>

#include "base/allocation.hpp"

namespace mauve {

namespace {

std::uint64_t own_page_faults() noexcept {
  rusage usage{};
  getrusage(RUSAGE_THREAD, &usage);
  return static_cast<std::uint64_t>(usage.ru_minflt) + static_cast<std::uint64_t>(usage.ru_majflt);
}

/// Of another thread of this process; nothing when it is gone.
std::optional<std::uint64_t> page_faults_of(pid_t thread) noexcept {
  std::array<char, 64> path{};
  std::snprintf(path.data(), path.size(), "/proc/self/task/%d/stat", thread);
  const int file = open(path.data(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return std::nullopt;
  std::array<char, 1024> line{};
  const ssize_t length = read(file, line.data(), line.size() - 1);
  close(file);
  if (length <= 0) return std::nullopt;
  // proc_pid_stat(5): fields 10 and 12; the second, the name in parentheses, may hold anything.
  constexpr int kMinorFaults = 10;
  constexpr int kMajorFaults = 12;
  const char* place = std::strrchr(line.data(), ')');
  if (place == nullptr) return std::nullopt;
  std::uint64_t faults = 0;
  for (int field = 3; field <= kMajorFaults; ++field) {
    place = std::strchr(place + 1, ' ');
    if (place == nullptr) return std::nullopt;
    if (field == kMinorFaults || field == kMajorFaults) faults += std::strtoull(place, nullptr, 10);
  }
  return faults;
}

template <typename Allocate>
bool is_counted(Allocate&& allocate) {
  std::atomic<std::uint64_t>* const present = allocation_counter();
  std::atomic<std::uint64_t> count{0};
  set_allocation_counter(&count);
  allocate();
  set_allocation_counter(present);
  return count.load(std::memory_order_relaxed) != 0;
}

}  // namespace

std::string_view to_string(AllocationCounting counting) noexcept {
  switch (counting) {
    case AllocationCounting::none:
      return "none";
    case AllocationCounting::some:
      return "some";
    case AllocationCounting::all:
      return "all";
  }
  return "none";
}

AllocationCounting allocation_counting() {
  // Called as functions: a new expression could be optimised away.
  if (!is_counted([] { ::operator delete(::operator new(1)); })) return AllocationCounting::none;
  // This resource calls operator new from within the C++ library.
  std::pmr::memory_resource& library = *std::pmr::new_delete_resource();
  return is_counted([&library] { library.deallocate(library.allocate(1), 1); }) ? AllocationCounting::all
                                                                                : AllocationCounting::some;
}

ThreadCounters::~ThreadCounters() {
  if (allocation_counter() == &allocations_) detach();
}

void ThreadCounters::attach() noexcept {
  set_allocation_counter(&allocations_);
  mark();
  thread_.store(gettid(), std::memory_order_release);
}

void ThreadCounters::mark() noexcept {
  allocations_.store(0, std::memory_order_relaxed);
  faults_at_mark_.store(own_page_faults(), std::memory_order_relaxed);
}

void ThreadCounters::detach() noexcept {
  set_allocation_counter(nullptr);
  faults_at_end_.store(own_page_faults(), std::memory_order_relaxed);
  thread_.store(0, std::memory_order_release);
}

std::uint64_t ThreadCounters::page_faults() const noexcept {
  const pid_t thread = thread_.load(std::memory_order_acquire);
  std::optional<std::uint64_t> faults;
  if (thread != 0) faults = page_faults_of(thread);
  // It detaches before it ends: still attached now, the figures were its own and no later thread's of that number.
  if (thread_.load(std::memory_order_acquire) != thread || !faults) {
    faults = faults_at_end_.load(std::memory_order_relaxed);
  }
  // A start in between can have put the mark past them.
  const std::uint64_t before = faults_at_mark_.load(std::memory_order_relaxed);
  return *faults > before ? *faults - before : 0;
}

}  // namespace mauve
