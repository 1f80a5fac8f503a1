// SPDX-License-Identifier: LGPL-3.0-or-later
// What is too large for a component's stack ends the process at that place: it reaches nobody else's memory.
#include <sys/mman.h>

#include <csignal>
#include <cstdlib>

#include "fixtures.hpp"

#ifdef __SANITIZE_ADDRESS__
constexpr bool kOwnStacks =
    false;  // AddressSanitizer reports an overflow itself, and ends the process its own way
#else
constexpr bool kOwnStacks = true;
#endif

namespace mauve::testing {
namespace {

constexpr std::size_t kMiB = std::size_t{1024} * 1024;
constexpr std::size_t kNeighbour = 16 * kMiB;
constexpr int kJumpedOver = 3;  // the exit status of a test that reached memory beyond the guard

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

/// Memory of somebody else right below this address, as far as there is none yet.
void put_neighbour_below(char* address) {
  constexpr std::size_t kPage = 4096;
  for (std::size_t below = kPage; below <= kNeighbour; below += kPage)
    mmap(address - below, kPage, PROT_READ | PROT_WRITE,
         MAP_PRIVATE | MAP_ANONYMOUS | MAP_FIXED_NOREPLACE | MAP_NORESERVE, -1, 0);
}

/// Uses the far end of a frame of 4 MB, and nothing in between.
[[gnu::noinline]] void use_a_large_frame() {
  volatile char frame[4'000'000];  // NOLINT(modernize-avoid-c-arrays)
  frame[0] = 1;
  static_cast<void>(frame[0]);
}

/// Ends the process from the state of a component: by the signal, or with kJumpedOver.
void run_in_a_state(const std::function<void()>& work) {
  Architecture architecture;
  Deployer deployer{architecture};
  Component& component =
      architecture.add_component<TestShell, TestCore, TestFsm>("c", {.cpus = {kComponentsCpu}});
  component.core_as<TestCore>().work = [&work] {
    put_neighbour_below(stack_begin());
    work();
    std::_Exit(kJumpedOver);
  };
  architecture.configure();
  deployer.deploy();
  wait_until([] { return false; }, "the end of the process");
}

class StackGuard : public Deployed {
 protected:
  void SetUp() override {
    if (!kOwnStacks) GTEST_SKIP() << "AddressSanitizer has its own answer to a stack that overflows";
    GTEST_FLAG_SET(death_test_style, "threadsafe");
  }
};

TEST_F(StackGuard, IsAMegabyteWide) {
  Component& component = add("c");
  deploy();
  EXPECT_GE(component.task().facts().guard_bytes, kMiB);
}

TEST_F(StackGuard, ALargeFrameDiesAtItsPlace) {
  EXPECT_EXIT(run_in_a_state(use_a_large_frame), ::testing::KilledBySignal(SIGSEGV), "");
}

TEST_F(StackGuard, CodeThatWasCompiledWithoutProtectionMeetsItToo) {
  const auto reach = [] { *static_cast<volatile char*>(stack_begin() - kMiB + 4096) = 1; };
  EXPECT_EXIT(run_in_a_state(reach), ::testing::KilledBySignal(SIGSEGV), "");
}

}  // namespace
}  // namespace mauve::testing
