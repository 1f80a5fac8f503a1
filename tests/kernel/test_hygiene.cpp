// SPDX-License-Identifier: LGPL-3.0-or-later
// After the start the kernel allocates on no component thread: counted, not believed.
#include <cstdlib>
#include <new>

#include "fixtures.hpp"

namespace {
thread_local bool counting = false;
std::atomic<int> allocations{0};

void* counted_allocation(std::size_t size) {
  if (counting) ++allocations;
  if (void* memory = std::malloc(size == 0 ? 1 : size)) return memory;
  throw std::bad_alloc();
}
}  // namespace

void* operator new(std::size_t size) { return counted_allocation(size); }
void* operator new[](std::size_t size) { return counted_allocation(size); }
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t) noexcept { std::free(memory); }

namespace mauve::testing {
namespace {

class Hygiene : public Deployed {};

TEST_F(Hygiene, NoAllocationOnAComponentThread) {
  architecture.add_resource<SharedData<Number>>("shared");
  architecture.add_resource<RingBuffer<Number>>("ring", std::size_t{2}, WhenFull::overwrite);
  Component& component = add("c", 1);
  architecture.connect("c", "input", "shared", "read");
  architecture.connect("c", "output", "shared", "write");
  architecture.connect("c", "held", "ring", "write");
  architecture.publish("shared");
  TestCore& busy = core(component);
  busy.work = [&busy] {
    counting = true;  // from the first activation on: the wait, the commit and the stop count too
    TestShell& shell = busy.exposed_shell();
    shell.output.write({shell.input.read().value.value + shell.gain});
    shell.held.write({1.0});
    trace_mark(0, 1);
  };
  deploy();
  wait_runs(component, 20);
  deployer.set_property("c", "gain", 2.0);
  auto fresh = std::make_unique<TestCore>();
  fresh->work = [] {};
  component.swap_core(std::move(fresh));
  wait_runs(component, 5);
  deployer.stop("c");
  deployer.start("c");
  wait_runs(component, 10);
  deployer.shutdown();
  EXPECT_EQ(0, allocations);
}

}  // namespace
}  // namespace mauve::testing
