// SPDX-License-Identifier: LGPL-3.0-or-later
// After the start the kernel allocates nothing and touches no new page on a component thread: counted, not
// believed.
#include <malloc.h>
#include <sys/mman.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory_resource>
#include <thread>

#include "fixtures.hpp"

namespace mauve::testing::test_hygiene {

constexpr std::size_t kPage = 4096;

struct Wide {
  std::array<std::byte, 64 * kPage> bytes;
};

/// Memory that no page stands behind yet.
class FreshPages {
 public:
  explicit FreshPages(std::size_t count)
      : count_(count),
        memory_(mmap(nullptr, count * kPage, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0)) {
    madvise(memory_, count * kPage, MADV_NOHUGEPAGE);  // one fault a page
  }
  ~FreshPages() { munmap(memory_, count_ * kPage); }
  FreshPages(const FreshPages&) = delete;
  FreshPages& operator=(const FreshPages&) = delete;

  /// As if they had never been touched.
  void give_back() const noexcept {
    mmap(memory_, count_ * kPage, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_FIXED, -1, 0);
    madvise(memory_, count_ * kPage, MADV_NOHUGEPAGE);
  }
  void touch() const noexcept {
    auto* bytes = static_cast<volatile char*>(memory_);
    for (std::size_t page = 0; page < count_; ++page) bytes[page * kPage] = 1;
  }

 private:
  std::size_t count_;
  void* memory_;
};

/// A call, which unlike a new expression the compiler may not leave out.
void allocate_once() { ::operator delete(::operator new(1)); }

/// Of the C library's allocator: a thread that allocates gets one of its own, 64 MiB of addresses, while there are
/// fewer than eight a processor.
std::size_t arenas() {
  char* text = nullptr;
  std::size_t length = 0;
  FILE* file = open_memstream(&text, &length);
  malloc_info(0, file);
  std::fclose(file);
  std::size_t count = 0;
  for (const char* place = text; (place = std::strstr(place, "<heap ")) != nullptr; ++place) ++count;
  std::free(text);
  return count;
}

bool memory_is_locked(const Deployer& deployer) {
  const auto& missing = deployer.realtime_status().missing;
  return std::none_of(missing.begin(), missing.end(),
                      [](const std::string& line) { return line.starts_with("locked memory"); });
}

class Hygiene : public Deployed {
 protected:
  void SetUp() override {
    if (allocation_counting() != AllocationCounting::all)
      GTEST_SKIP() << "a sanitizer's operators new take the place of the counting ones";
  }
};

/// Every command a component's thread can meet while it runs.
class HygieneOfTheKernel : public Hygiene {
 protected:
  void run_through_everything() {
    architecture.add_resource<SharedData<Number>>("shared");
    architecture.add_resource<RingBuffer<Number>>("ring", std::size_t{2}, WhenFull::overwrite);
    Component& component = add("c", 1);
    architecture.connect("c", "input", "shared", "read");
    architecture.connect("c", "output", "shared", "write");
    architecture.connect("c", "held", "ring", "write");
    architecture.publish("shared");
    let_work(core(component));
    deploy();
    wait_runs(component, 20);
    note("the first activations");
    deployer.set_property("c", "gain", 2.0);
    note("a property");
    auto fresh = std::make_unique<TestCore>();
    let_work(*fresh);
    component.swap_core(std::move(fresh));
    wait_runs(component, 5);
    note("a core");
    deployer.stop("c");
    note("a stop");
    deployer.start("c");
    wait_runs(component, 10);
    note("a new start");
    deployer.shutdown();
    note("the end");
  }

  struct Note {
    std::string after;
    std::uint64_t allocations;
    std::uint64_t page_faults;
  };
  std::vector<Note> notes;

 private:
  static void let_work(TestCore& core) {
    core.work = [&core]() MAUVE_RT {
      TestShell& shell = core.exposed_shell();
      shell.output.write({shell.input.read().value.value + shell.gain});
      shell.held.write({1.0});
      trace_mark(0, 1);
    };
  }
  void note(std::string after) {
    const ThreadCounters& counters = architecture.component("c").task().counters();
    notes.push_back({std::move(after), counters.allocations(), counters.page_faults()});
  }
};

TEST_F(HygieneOfTheKernel, NoAllocationAfterTheStart) {
  run_through_everything();
  for (const Note& note : notes) EXPECT_EQ(0U, note.allocations) << "after " << note.after;
}

TEST_F(HygieneOfTheKernel, NoPageFaultAfterTheStart) {
  run_through_everything();
  if (!memory_is_locked(deployer))
    GTEST_SKIP() << "needs locked memory (CAP_IPC_LOCK or an unlimited memlock limit)";
  for (const Note& note : notes) EXPECT_EQ(0U, note.page_faults) << "after " << note.after;
}

TEST_F(Hygiene, AComponentNeedsNoArenaOfTheAllocator) {
  for (int i = 0; i < 6; ++i) add("c" + std::to_string(i), 1);
  const std::size_t before = arenas();
  deploy();
  for (const auto& component : architecture.components()) wait_runs(*component, 3);
  deployer.shutdown();
  EXPECT_GE(before + 1, arenas()) << "one may be the watchdog's";
}

TEST_F(Hygiene, AllocationsOfAComponentAreCountedOneByOne) {
  Component& component = add("c", 1);
  TestCore& busy = core(component);
  std::unique_ptr<int> number;
  std::unique_ptr<Wide[]> array;
  std::pmr::memory_resource& library = *std::pmr::new_delete_resource();
  void* from_library = nullptr;
  busy.work = [&] {
    if (busy.runs.load() != 3) return;
    number = std::make_unique<int>(1);               // new
    array = std::make_unique<Wide[]>(1);             // new[]
    from_library = library.allocate(kPage, 2 * 64);  // new with an alignment, in the C++ library
    ::operator delete(::operator new(1, std::nothrow));
  };
  deploy();
  wait_runs(component, 3);
  const ThreadCounters& counters = component.task().counters();
  wait_until([&] { return counters.allocations() >= 4; }, "the allocations");
  wait_runs(component, 6);
  EXPECT_EQ(4U, counters.allocations());
  deployer.stop("c");
  EXPECT_EQ(4U, counters.allocations()) << "what a run allocated can be read after it";
  deployer.start("c");
  EXPECT_EQ(0U, counters.allocations()) << "a start counts anew";
  deployer.shutdown();
  library.deallocate(from_library, kPage, 2 * 64);
}

TEST_F(Hygiene, AllocationsOfOthersAreNotTheComponents) {
  Component& component = add("c", 1);
  deploy();
  for (int i = 0; i < 100; ++i) allocate_once();
  wait_runs(component, 5);
  for (int i = 0; i < 100; ++i) allocate_once();
  EXPECT_EQ(0U, component.task().counters().allocations());
}

TEST_F(Deployed, PageFaultsOfAComponentAreCounted) {
  constexpr std::size_t kPages = 50;
  const FreshPages pages(kPages);
  Component& component = add("c", 1);
  TestCore& busy = core(component);
  busy.work = [&] {
    if (busy.runs.load() != 3) return;
    pages.give_back();
    pages.touch();
  };
  deploy();
  wait_runs(component, 4);
  const std::uint64_t faults = component.task().counters().page_faults();
  EXPECT_GE(faults, kPages);
  deployer.shutdown();
  EXPECT_GE(component.task().counters().page_faults(), faults) << "the figure outlives the thread";
}

constexpr std::size_t kLargeBytes = std::size_t{8} << 20U;

/// Allocates much, and leaves it to the component to touch it.
struct LargeCore : TestCore {
  std::unique_ptr<char[]> constructed{new char[kLargeBytes]};
  std::unique_ptr<char[]> configured;
  std::vector<std::unique_ptr<char[]>> small;  // from the heap or an arena, not from a mapping of their own

  bool configure_hook() override {
    configured.reset(new char[kLargeBytes]);
    for (int i = 0; i < 200; ++i) small.emplace_back(new char[2 * kPage]);
    return true;
  }
  void act() override {
    if (runs.load() == 0) {
      touch(constructed.get(), kLargeBytes);
      touch(configured.get(), kLargeBytes);
      for (const auto& bytes : small) touch(bytes.get(), 2 * kPage);
    }
    TestCore::act();
  }

 private:
  static void touch(volatile char* bytes, std::size_t count) noexcept {
    for (std::size_t at = 0; at < count; at += kPage) bytes[at] = 1;
  }
};

/// As large as another one, wherever the system puts it.
struct MappedCore : TestCore {
  FreshPages pages{kLargeBytes / kPage};

  void act() override {
    if (runs.load() == 0) pages.touch();
    TestCore::act();
  }
};

class Prefaulted : public Deployed {
 protected:
  /// Page faults of "c" from here on.
  std::uint64_t faults() { return architecture.component("c").task().counters().page_faults() - before_; }
  void begin() { before_ += faults(); }
  void commit(std::unique_ptr<CoreBase> core) {
    Transaction transaction;
    transaction.replace_core("c", std::move(core));
    deployer.commit(std::move(transaction), {.timeouts = {.commit_ns = s_to_ns(10)}});
  }

 private:
  std::uint64_t before_{0};
};

TEST_F(Prefaulted, WhatANewCoreAllocatedIsInMemory) {
  if (allocation_counting() == AllocationCounting::none) GTEST_SKIP() << "a sanitizer's allocator";
  Component& component = add("c", 1);
  deploy();
  wait_runs(component, 3);
  begin();
  for (int change = 0; change < 4; ++change) {  // what one gives back the next may get
    commit(std::make_unique<LargeCore>());
    wait_runs(component, 2);
    EXPECT_EQ(0U, faults()) << "change " << change;
  }
  std::thread([&] {  // with an arena of its own
    commit(std::make_unique<LargeCore>());
    wait_runs(component, 2);
    EXPECT_EQ(0U, faults());
  })
      .join();
}

TEST_F(Prefaulted, WhatTakesThePlaceOfWhatWasGivenBackIsInMemory) {
  if (allocation_counting() == AllocationCounting::none) GTEST_SKIP() << "a sanitizer's allocator";
  Component& component = add("c", 1);
  deploy();
  wait_runs(component, 3);
  auto others = std::make_unique<FreshPages>(kLargeBytes / kPage);
  commit(std::make_unique<TestCore>());
  wait_runs(component, 2);
  begin();
  others.reset();  // the process is as big again with what the core maps
  commit(std::make_unique<MappedCore>());
  wait_runs(component, 2);
  EXPECT_EQ(0U, faults());
}

TEST_F(Prefaulted, WhatTheFirstCoreAllocatedIsInMemory) {
  if (allocation_counting() == AllocationCounting::none) GTEST_SKIP() << "a sanitizer's allocator";
  Component& component = architecture.add_component<TestShell, LargeCore, TestFsm>("c");
  deploy();
  wait_runs(component, 2);
  EXPECT_EQ(0U, faults());
}

TEST_F(Prefaulted, TheWholeDeclaredStackIsInMemory) {
  if (allocation_counting() == AllocationCounting::none) GTEST_SKIP() << "a sanitizer's stacks";
  Component& component = add("c", 1, {.stack_bytes = std::size_t{1} << 20U});
  TestCore& deep = core(component);
  deep.work = [&deep] {
    if (deep.runs.load() != 3) return;
    constexpr std::size_t kDeep = std::size_t{900} * 1024;
    std::array<volatile char, kDeep> place;
    for (std::size_t at = 0; at < kDeep; at += kPage) place[kDeep - 1 - at] = 1;
  };
  deploy();
  wait_runs(component, 4);
  EXPECT_EQ(0U, faults());
}

TEST(ThreadCounters, CountTheThreadTheyAreAttachedTo) {
  if (allocation_counting() == AllocationCounting::none) GTEST_SKIP() << "a sanitizer's operators new";
  ThreadCounters outer;
  outer.attach();
  std::thread(allocate_once).join();
  outer.mark();
  allocate_once();
  EXPECT_EQ(1U, outer.allocations());
  outer.detach();
  allocate_once();
  EXPECT_EQ(1U, outer.allocations());
}

TEST(ThreadCounters, StayReadableWhenTheThreadIsGone) {
  constexpr std::size_t kPages = 20;
  const FreshPages pages(kPages);
  ThreadCounters counters;
  std::thread([&] {
    counters.attach();
    pages.touch();
    counters.detach();
  }).join();
  EXPECT_GE(counters.page_faults(), kPages);
}

TEST(ExecutionTime, KeepsNumberMeanAndMaximum) {
  ExecutionTime time;
  EXPECT_EQ(0, time.mean_ns());
  time.record(10);
  time.record(40);
  time.record(16);
  EXPECT_EQ(3U, time.count());
  EXPECT_EQ(22, time.mean_ns());
  EXPECT_EQ(40, time.max_ns());
}

TEST_F(Deployed, ExecutionTimeIsKeptPerState) {
  Component& component = add("c", 1);
  core(component).work = [] {
    const time_ns_t until = monotonic_now_ns() + us_to_ns(100);
    while (monotonic_now_ns() < until) {
    }
  };
  deploy();
  wait_runs(component, 5);
  deployer.stop("c");
  const auto times = component.state_times();
  ASSERT_EQ(1U, times->size()) << "the wait is none";
  const ExecutionTime& run = times->front().time;
  EXPECT_EQ("Run", times->front().state);
  EXPECT_EQ(static_cast<std::uint64_t>(core(component).runs.load()), run.count());
  EXPECT_GE(run.mean_ns(), us_to_ns(100));
  EXPECT_GE(run.max_ns(), run.mean_ns());
}

}  // namespace mauve::testing::test_hygiene
