// SPDX-License-Identifier: LGPL-3.0-or-later
#include "steady_waits.hpp"

#include <link.h>
#include <pthread.h>
#include <semaphore.h>
#include <sys/mman.h>
#include <time.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "mauve_rt/base/time.hpp"

namespace mauve::bridge {

namespace {

/// The time of CLOCK_MONOTONIC that is as far away as a time of CLOCK_REALTIME.
timespec by_the_monotonic_clock(const timespec& deadline) noexcept {
  timespec realtime{};
  timespec until{};
  clock_gettime(CLOCK_REALTIME, &realtime);
  clock_gettime(CLOCK_MONOTONIC, &until);
  until.tv_sec += deadline.tv_sec - realtime.tv_sec;
  until.tv_nsec += deadline.tv_nsec - realtime.tv_nsec;
  while (until.tv_nsec < 0) {
    until.tv_nsec += s_to_ns(1);
    --until.tv_sec;
  }
  while (until.tv_nsec >= s_to_ns(1)) {
    until.tv_nsec -= s_to_ns(1);
    ++until.tv_sec;
  }
  return until;
}

int wait_for_condition(pthread_cond_t* condition, pthread_mutex_t* mutex, const timespec* deadline) {
  const timespec until = by_the_monotonic_clock(*deadline);
  return pthread_cond_clockwait(condition, mutex, CLOCK_MONOTONIC, &until);
}

int wait_for_semaphore(sem_t* semaphore, const timespec* deadline) {
  const timespec until = by_the_monotonic_clock(*deadline);
  return sem_clockwait(semaphore, CLOCK_MONOTONIC, &until);
}

int lock_mutex(pthread_mutex_t* mutex, const timespec* deadline) {
  const timespec until = by_the_monotonic_clock(*deadline);
  return pthread_mutex_clocklock(mutex, CLOCK_MONOTONIC, &until);
}

struct Redirection {
  std::string_view function;
  std::string_view library;  // part of its file's name; "": any
  std::uintptr_t to;
};

// A condition variable may have CLOCK_MONOTONIC, as those of the interpreter, and a mutex with priority inheritance may
// refuse it: those of Fast DDS and of the log of ROS do not. A semaphore always has CLOCK_REALTIME, and interpreters that
// are built for an old glibc wait by semaphores.
const std::array kRedirections{
    Redirection{"pthread_cond_timedwait", "libfastrtps", std::bit_cast<std::uintptr_t>(&wait_for_condition)},
    Redirection{"pthread_cond_timedwait", "spdlog", std::bit_cast<std::uintptr_t>(&wait_for_condition)},
    Redirection{"pthread_mutex_timedlock", "libfastrtps", std::bit_cast<std::uintptr_t>(&lock_mutex)},
    Redirection{"sem_timedwait", "", std::bit_cast<std::uintptr_t>(&wait_for_semaphore)},
};

/// The tables of one loaded library, by which it finds functions of others.
class Imports {
 public:
  explicit Imports(const dl_phdr_info& library) noexcept : library_(library) {
    for (const auto& header : segments())
      if (header.p_type == PT_DYNAMIC)
        read(std::bit_cast<const ElfW(Dyn)*>(library.dlpi_addr + header.p_vaddr));
  }

  void redirect(std::span<const Redirection> redirections) const noexcept {
    if (names_ == nullptr || symbols_ == nullptr) return;
    for (const auto& table : {calls_, pointers_}) {
      for (const ElfW(Rela) & entry : table) {
        const ElfW(Sym) & symbol = symbols_[ELF64_R_SYM(entry.r_info)];
        if (symbol.st_name == 0 || symbol.st_shndx != SHN_UNDEF) continue;
        for (const Redirection& one : redirections) {
          if (one.function == names_ + symbol.st_name && is_of(one.library))
            write(library_.dlpi_addr + entry.r_offset, one.to);
        }
      }
    }
  }

 private:
  std::span<const ElfW(Phdr)> segments() const noexcept { return {library_.dlpi_phdr, library_.dlpi_phnum}; }

  bool is_of(std::string_view name) const noexcept {
    return std::string_view(library_.dlpi_name).find(name) != std::string_view::npos;
  }

  void read(const ElfW(Dyn) * tags) noexcept {
    std::size_t calls_bytes = 0;
    std::size_t pointers_bytes = 0;
    const ElfW(Rela)* calls = nullptr;
    const ElfW(Rela)* pointers = nullptr;
    for (; tags->d_tag != DT_NULL; ++tags) {
      const std::uintptr_t at = address(tags->d_un.d_ptr);
      if (tags->d_tag == DT_STRTAB) names_ = std::bit_cast<const char*>(at);
      if (tags->d_tag == DT_SYMTAB) symbols_ = std::bit_cast<const ElfW(Sym)*>(at);
      if (tags->d_tag == DT_JMPREL) calls = std::bit_cast<const ElfW(Rela)*>(at);
      if (tags->d_tag == DT_RELA) pointers = std::bit_cast<const ElfW(Rela)*>(at);
      if (tags->d_tag == DT_PLTRELSZ) calls_bytes = tags->d_un.d_val;
      if (tags->d_tag == DT_RELASZ) pointers_bytes = tags->d_un.d_val;
    }
    calls_ = {calls, calls_bytes / sizeof(ElfW(Rela))};
    pointers_ = {pointers, pointers_bytes / sizeof(ElfW(Rela))};
  }

  /// The loader has added the base to most of them already, which depends on the processor and the library.
  std::uintptr_t address(std::uintptr_t told) const noexcept {
    return told < library_.dlpi_addr ? told + library_.dlpi_addr : told;
  }

  void write(std::uintptr_t slot, std::uintptr_t function) const noexcept {
    const auto page_bytes = static_cast<std::uintptr_t>(sysconf(_SC_PAGESIZE));
    auto* const page = std::bit_cast<void*>(slot / page_bytes * page_bytes);
    if (mprotect(page, page_bytes, PROT_READ | PROT_WRITE) != 0) return;  // refused: it waits as before
    // relaxed: another thread calls the old function or the new one, and either works.
    std::atomic_ref(*std::bit_cast<std::uintptr_t*>(slot)).store(function, std::memory_order_relaxed);
    for (const auto& header : segments()) {
      const std::uintptr_t begin = library_.dlpi_addr + header.p_vaddr;
      if (header.p_type == PT_GNU_RELRO && slot >= begin && slot < begin + header.p_memsz)
        mprotect(page, page_bytes, PROT_READ);
    }
  }

  const dl_phdr_info& library_;
  const char* names_{nullptr};
  const ElfW(Sym) * symbols_{nullptr};
  std::span<const ElfW(Rela)> calls_{};
  std::span<const ElfW(Rela)> pointers_{};
};

}  // namespace

void wait_by_the_monotonic_clock() noexcept {
  dl_iterate_phdr(
      [](dl_phdr_info* library, std::size_t /*bytes*/, void* /*context*/) {
        Imports(*library).redirect(kRedirections);
        return 0;
      },
      nullptr);
}

}  // namespace mauve::bridge
