// SPDX-License-Identifier: LGPL-3.0-or-later
// The basic elements allocate on no component thread: counted, in all they do.
#include "fixtures.hpp"

namespace mauve::testing::test_elements_hygiene {

using types::Float64;

struct Served : ServerCore<ServerShell<Float64>> {
  std::atomic<int> count{0};
  void serve() override { ++count; }
};

class ElementsHygiene : public Deployed {
 protected:
  void SetUp() override {
    if (allocation_counting() != AllocationCounting::all)
      GTEST_SKIP() << "a sanitizer's operators new take the place of the counting ones";
  }
  template <typename CoreType>
  void add_element(const std::string& name, const std::string& port, const std::string& output = "output") {
    using ShellType = typename CoreType::shell_type;
    architecture.add_component<ShellType, CoreType, PeriodicUpdateFsm<ShellType>>(name);
    architecture.add_resource<SharedData<Float64>>(name + "_out");
    architecture.connect(name, port, "in", "read");
    architecture.connect(name, output, name + "_out", "write");
  }
  template <template <typename, typename> typename FsmType>
  void add_server(const std::string& name) {
    using ShellType = ServerShell<Float64>;
    auto& server =
        architecture.add_component<ShellType, Served, FsmType<ShellType, ServerCore<ShellType>>>(name);
    server.set_property("period_us", std::int64_t{1000});
    servers_.push_back(&server);
    rings_.push_back(&architecture.add_resource<RingBuffer<Float64>>(name + "_ring", std::size_t{8}));
    architecture.connect(name, "requests", name + "_ring", "read");
  }
  void wait_releases() {
    for (const auto& component : architecture.components()) {
      const auto& releases = component->task().statistics().releases;
      const std::uint64_t before = releases.load();
      wait_until([&] { return releases.load() >= before + 3; }, "the elements to run");
    }
  }

  std::vector<Component*> servers_;
  std::vector<RingBuffer<Float64>*> rings_;
};

TEST_F(ElementsHygiene, NoAllocationOnAComponentThread) {
  auto& in = architecture.add_resource<SharedData<Float64>>("in");
  add_element<RelayCore<Float64>>("relay", "input");
  add_element<MultiplexerCore<Float64, 2>>("multiplexer", "input_1");
  add_element<PriorityMultiplexerCore<Float64, 2>>("priority", "input_1");
  add_element<LimiterCore<Float64>>("limiter", "input");
  add_element<LowPassCore<Float64>>("low_pass", "input");
  add_element<PidCore>("pid", "measured", "command");
  architecture.connect("pid", "set_point", "in", "read");
  deploy();
  in.write.write({1.0}, monotonic_now_ns());
  wait_releases();
  deployer.set_property("multiplexer", "select", std::int64_t{1});
  in.write.write({2.0}, 0);  // too old for the one with a limit
  wait_releases();
  deployer.set_property("relay", "only_new", false);
  wait_releases();
  deployer.shutdown();
  for (const auto& component : architecture.components())
    EXPECT_EQ(0U, component->task().counters().allocations()) << component->name();
}

TEST_F(ElementsHygiene, NoAllocationOnTheThreadOfAServer) {
  add_server<SporadicFsm>("sporadic");
  add_server<PollingServerFsm>("polling");
  add_server<DeferrableServerFsm>("deferrable");
  deploy();
  for (int i = 0; i < 4; ++i) {
    for (RingBuffer<Float64>* const ring : rings_) ring->write.write({1.0}, monotonic_now_ns());
  }
  for (Component* const server : servers_)
    wait_until([&] { return server->core_as<Served>().count == 4; }, "the requests to be served");
  deployer.shutdown();
  for (Component* const server : servers_)
    EXPECT_EQ(0U, server->task().counters().allocations()) << server->name();
}

}  // namespace mauve::testing::test_elements_hygiene
