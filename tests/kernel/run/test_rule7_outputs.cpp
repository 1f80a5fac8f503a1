// SPDX-License-Identifier: LGPL-3.0-or-later
// Rule 7: a refused change leaves no trace in outputs: in threads, and in virtual time.
#include "simulated.hpp"

namespace mauve::testing::test_rule7_outputs {

struct ZeroedShell : TestShell {
  WritePort<Number>& zeroed = write_port<Number>("zeroed", {.on_commit = OutputPolicy::set_zero}).optional();
};

struct OnceCore : TestCore {
  bool adopt(const CoreBase& /*old*/) override { return agrees; }
  void act() override {
    if (!written) static_cast<ZeroedShell&>(exposed_shell()).zeroed.write({42.0});
    written = true;
    TestCore::act();
  }
  void take(CoreBase& old) noexcept override { written = static_cast<OnceCore&>(old).written; }
  bool written{false};
  bool agrees{true};
};

/// Runs an architecture in threads, or in virtual time.
class Rule7Outputs : public ::testing::TestWithParam<bool> {
 protected:
  Rule7Outputs() {
    architecture.add_component<ZeroedShell, OnceCore, TestFsm>("c", {.cpus = {kComponentsCpu}});
    architecture.connect("c", "zeroed", "z", "write");
    architecture.configure();
    if (GetParam()) {
      host = &simulation.add(architecture);
      simulation.deploy();
      simulation.run_until(simulation.epoch_ns() + ms_to_ns(10));
    } else {
      deployer.deploy();
      wait_until([&] { return output() == 42.0; }, "the output");
    }
  }
  void commit(Transaction change) { host->commit(std::move(change)); }
  double output() {
    Number value;
    time_ns_t written_ns = 0;
    ReaderState state;
    z.read.read(value, written_ns, state);
    return value.value;
  }

  AwayFromComponents away;
  Architecture architecture;
  SharedData<Number>& z{architecture.add_resource<SharedData<Number>>("z")};
  Simulation simulation;
  Deployer deployer{architecture};
  Host* host{&deployer};
};

INSTANTIATE_TEST_SUITE_P(Hosts, Rule7Outputs, ::testing::Bool(), [](const auto& info) {
  return std::string(info.param ? "VirtualTime" : "Threads");
});

TEST_P(Rule7Outputs, AreWrittenByAReplacementThatIsMadeAndByNothingElse) {
  auto refusing = std::make_unique<OnceCore>();
  refusing->agrees = false;
  Transaction refused;
  refused.replace_core("c", std::move(refusing));
  EXPECT_THROW(commit(std::move(refused)), Error);
  EXPECT_EQ(42.0, output());
  Transaction property;
  property.set_property("c", "gain", 2.0);
  commit(std::move(property));
  EXPECT_EQ(42.0, output());
  Transaction replaced;
  replaced.replace_core("c", std::make_unique<OnceCore>());
  commit(std::move(replaced));
  EXPECT_EQ(0.0, output());
}

}  // namespace mauve::testing::test_rule7_outputs
