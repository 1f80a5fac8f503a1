// SPDX-License-Identifier: LGPL-3.0-or-later
// Ports are required unless declared optional, call ports always; large messages need a stack that holds them.
#include <array>

#include "fixtures.hpp"

namespace mauve::testing::test_required_ports {

struct Bulky {
  std::array<std::uint8_t, 3'000'000> bytes{};
};

}  // namespace mauve::testing::test_required_ports

MAUVE_TYPE(mauve::testing::test_required_ports::Bulky, "test_msgs/msg/Bulky", bytes)

namespace mauve::testing::test_required_ports {

using Ask = int(int);

class Oracle final : public Resource {
 public:
  Oracle() : Resource("test/Oracle", "") { offer(ask); }

 private:
  class Answer final : public CallService<Ask> {
   public:
    Answer() : CallService("ask", "test/Ask") {}
    int call(int question) override { return question + 1; }
  };

 public:
  Answer ask;
};

struct AskingShell : Shell {
  ReadPort<Number>& input = read_port<Number>("input");
  ReadPort<Number>& advice = read_port<Number>("advice", Number{7.0}).optional();
  CallPort<Ask>& ask = call_port<Ask>("ask", "test/Ask");
};

struct AskingCore : Core<AskingShell> {
  std::atomic<int> answers{0};
  std::atomic<double> advice{0.0};
  void act() {
    advice = shell().advice.read().value.value;
    answers = shell().ask(answers);
  }
};

struct AskingFsm : Fsm<AskingShell, AskingCore> {
  void define() override {
    State& run = execution("Run", "act", &AskingCore::act);
    State& pause = wait("Pause", ms_to_ns(2));
    set_initial(run);
    next(run, pause);
    next(pause, run);
  }
};

class RequiredPorts : public ::testing::Test {
 protected:
  RequiredPorts() {
    component_ =
        &architecture_.add_component("asker", std::make_unique<AskingShell>(), std::make_unique<AskingCore>(),
                                     std::make_unique<AskingFsm>(), {});
    for (const char* name : {"oracle", "other_oracle"})
      architecture_.add_resource(name, std::make_unique<Oracle>());
    architecture_.add_resource("number", std::make_unique<SharedData<Number>>());
  }
  AskingCore& core() { return dynamic_cast<AskingCore&>(component_->core()); }
  void connect_all() {
    architecture_.connect("asker", "input", "number", "read");
    architecture_.connect("asker", "ask", "oracle", "ask");
  }

  Architecture architecture_;
  Component* component_;
};

Error refusal(const std::function<void()>& act) {
  try {
    act();
  } catch (const Error& error) {
    return error;
  }
  return {ErrorCode::internal, "nothing was refused"};
}

TEST_F(RequiredPorts, AnUnconnectedOneIsRefusedAtConfigure) {
  architecture_.connect("asker", "ask", "oracle", "ask");
  const Error error = refusal([&] { architecture_.configure(); });
  EXPECT_EQ(ErrorCode::not_connected, error.code());
  EXPECT_EQ("asker", error.detail().component);
  EXPECT_EQ("port input", error.detail().element);
  EXPECT_NE(std::string::npos, error.detail().remedy.find("optional"));
  EXPECT_FALSE(architecture_.is_configured());
  architecture_.connect("asker", "input", "number", "read");
  architecture_.configure();
}

TEST_F(RequiredPorts, ACallPortIsRequiredWhateverItSays) {
  component_->shell().find_port("ask")->make_optional();
  architecture_.connect("asker", "input", "number", "read");
  const Error error = refusal([&] { architecture_.configure(); });
  EXPECT_EQ(ErrorCode::not_connected, error.code());
  EXPECT_EQ("port ask", error.detail().element);
}

TEST_F(RequiredPorts, AnOptionalOneYieldsItsDefaultOnThreadsAndInVirtualTime) {
  connect_all();
  architecture_.configure();
  {
    Simulation simulation;
    simulation.add(architecture_);
    simulation.deploy();
    simulation.run_until(simulation.now_ns() + ms_to_ns(100));
    EXPECT_GT(core().answers, 10);
    EXPECT_EQ(7.0, core().advice);
  }
}

/// The transactions that would leave a required port without a connection, and those that do not.
template <typename Commit>
void try_transactions(const Commit& commit) {
  const auto refused = [&](Transaction change, int step, const std::string& port) {
    const Error error = refusal([&] { commit(std::move(change)); });
    EXPECT_EQ(ErrorCode::not_connected, error.code()) << error.what();
    EXPECT_EQ(step, error.detail().step);
    EXPECT_EQ("port " + port, error.detail().element);
  };
  Transaction cut;
  cut.disconnect("asker", "ask");
  refused(std::move(cut), 1, "ask");
  Transaction halved;
  halved.disconnect("asker", "ask")
      .connect("asker", "ask", "other_oracle", "ask")
      .disconnect("asker", "input");
  refused(std::move(halved), 3, "input");
  Transaction added;
  added.add_component<AskingShell, AskingCore, AskingFsm>("second", {});
  refused(std::move(added), 1, "input");
  Transaction rewired;
  rewired.disconnect("asker", "ask").connect("asker", "ask", "other_oracle", "ask");
  EXPECT_NO_THROW(commit(std::move(rewired)));
  Transaction advised;
  advised.connect("asker", "advice", "number", "read").disconnect("asker", "advice");
  EXPECT_NO_THROW(commit(std::move(advised)));
}

TEST_F(RequiredPorts, NoTransactionLeavesOneUnconnectedOnThreads) {
  connect_all();
  architecture_.configure();
  Deployer deployer(architecture_);
  deployer.deploy();
  try_transactions([&](Transaction change) { deployer.commit(std::move(change)); });
  const int before = core().answers;
  wait_until([&] { return core().answers > before; }, "more answers");
  deployer.shutdown();
}

TEST_F(RequiredPorts, NoTransactionLeavesOneUnconnectedInVirtualTime) {
  connect_all();
  architecture_.configure();
  Simulation simulation;
  SimulatedHost& host = simulation.add(architecture_);
  simulation.deploy();
  simulation.run_until(simulation.now_ns() + ms_to_ns(10));
  try_transactions([&](Transaction change) { host.commit(std::move(change)); });
  const int before = core().answers;
  simulation.run_until(simulation.now_ns() + ms_to_ns(10));
  EXPECT_GT(core().answers, before);
}

struct BulkyShell : Shell {
  ReadPort<Bulky>& input = read_port<Bulky>("input");
  WritePort<Bulky>& output = write_port<Bulky>("output");
};

struct BulkyCore : Core<BulkyShell> {
  std::atomic<int> passed{0};
  void act() {
    const Sample<Bulky> sample = shell().input.read();
    if (!sample.is_new()) return;
    Bulky copy = sample.value;
    copy.bytes[1] = copy.bytes[0];
    if (shell().output.write(copy)) ++passed;
  }
};

struct BulkyFsm : Fsm<BulkyShell, BulkyCore> {
  void define() override {
    State& run = execution("Run", "act", &BulkyCore::act);
    State& pause = wait("Pause", ms_to_ns(5));
    set_initial(run);
    next(run, pause);
    next(pause, run);
  }
};

Component& add_bulky(Architecture& architecture, std::size_t stack_bytes) {
  TaskSettings settings;
  settings.stack_bytes = stack_bytes;
  Component& component =
      architecture.add_component("bulky", std::make_unique<BulkyShell>(), std::make_unique<BulkyCore>(),
                                 std::make_unique<BulkyFsm>(), settings);
  for (const char* name : {"in", "out"})
    architecture.add_resource(name, std::make_unique<SharedData<Bulky>>());
  architecture.connect("bulky", "input", "in", "read");
  architecture.connect("bulky", "output", "out", "write");
  return component;
}

TEST(LargeMessages, OneThatTheStackDoesNotHoldIsRefusedAtConfigure) {
  Architecture architecture;
  add_bulky(architecture, TaskSettings{}.stack_bytes);
  const Error error = refusal([&] { architecture.configure(); });
  EXPECT_EQ(ErrorCode::out_of_range, error.code());
  EXPECT_NE(std::string::npos, error.detail().expected.find("stack_bytes of at least")) << error.what();
  EXPECT_NE(std::string::npos, error.detail().remedy.find("raise the component's stack_bytes"));
}

TEST(LargeMessages, OneOfThreeMegabytesPassesWhereTheStackIsLargeEnough) {
  Architecture architecture;
  Component& component = add_bulky(architecture, std::size_t{8} * 1024 * 1024);
  architecture.configure();
  Deployer deployer(architecture);
  deployer.deploy();
  Resource& in = architecture.resource("in");
  std::vector<std::byte> message;
  CdrWriter(message).put(*std::make_unique<Bulky>());
  EXPECT_TRUE(in.write_sample(message, monotonic_now_ns()));
  wait_until([&] { return dynamic_cast<BulkyCore&>(component.core()).passed == 1; }, "the message");
  deployer.shutdown();
}

}  // namespace mauve::testing::test_required_ports
