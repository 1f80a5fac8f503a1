// SPDX-License-Identifier: LGPL-3.0-or-later
// What is too large for a component's stack ends the process at that place: it reaches nobody else's memory.
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdlib>

#include "fixtures.hpp"

namespace mauve::testing::test_stack_guard {

constexpr std::size_t kMiB = std::size_t{1024} * 1024;
constexpr std::size_t kPage = 4096;
constexpr int kJumpedOver = 3;  // the exit status of a process that reached memory beyond the guard

/// The lowest byte of this thread's stack.
char* stack_begin() {
  pthread_attr_t attributes;
  pthread_getattr_np(pthread_self(), &attributes);
  void* begin = nullptr;
  std::size_t size = 0;
  pthread_attr_getstack(&attributes, &begin, &size);
  pthread_attr_destroy(&attributes);
  return static_cast<char*>(begin);
}

/// Maps a page where there is none yet.
bool map_free(char* page) {
  return mmap(page, kPage, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_FIXED_NOREPLACE, -1,
              0) == page;
}

/// How many bytes nobody can read right below this thread's stack, when all that was free there is in use.
std::size_t guarded_bytes() {
  char* const begin = stack_begin();
  int ends[2]{-1, -1};
  if (pipe(ends) != 0) return 0;
  std::size_t guarded = 0;
  for (; guarded < 2 * kMiB; guarded += kPage) {
    char* const page = begin - guarded - kPage;
    if (map_free(page)) break;
    if (write(ends[1], page, 1) == 1 || errno != EFAULT) break;
  }
  close(ends[0]);
  close(ends[1]);
  return guarded;
}

/// Uses the far end of a frame of 4 MB, and nothing in between.
[[gnu::noinline]] void use_a_large_frame() {
  volatile char frame[4'000'000];  // NOLINT(modernize-avoid-c-arrays)
  frame[0] = 1;
  static_cast<void>(frame[0]);
}

/// Uses such a frame in a component's state, where all memory from 2 MiB below its stack on is somebody's. Ends the
/// process: by the signal, or with kJumpedOver.
void overflow() {
  Architecture architecture;
  Deployer deployer{architecture};
  Component& component =
      architecture.add_component<TestShell, TestCore, TestFsm>("c", {.cpus = {kComponentsCpu}});
  component.core_as<TestCore>().work = [] {
    char* const begin = stack_begin();
    for (std::size_t below = 2 * kMiB; below <= 8 * kMiB; below += kPage) {
      // Whatever it is, it can be written: nothing but the guard is to end the process.
      if (!map_free(begin - below)) mprotect(begin - below, kPage, PROT_READ | PROT_WRITE | PROT_EXEC);
    }
    use_a_large_frame();
    std::_Exit(kJumpedOver);
  };
  architecture.configure();
  deployer.deploy();
  wait_until([] { return false; }, "the end of the process");
}

class StackGuard : public Deployed {};

TEST_F(StackGuard, IsAMegabyteWide) {
  Component& component = add("c");
  std::atomic<std::size_t> guarded{0};
  const ComponentsEndFirst ended(deployer);
  core(component).work = [&] {
    if (core(component).runs == 1) guarded = guarded_bytes();
  };
  deploy();
  EXPECT_GE(component.task().facts().guard_bytes, kMiB);
  wait_runs(component, 2);
  EXPECT_GE(guarded, kMiB);
}

TEST_F(StackGuard, ALargeFrameDiesAtItsPlace) {
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "AddressSanitizer has its own answer to a stack that overflows";
#endif
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(overflow(), ::testing::KilledBySignal(SIGSEGV), "");
}

}  // namespace mauve::testing::test_stack_guard
