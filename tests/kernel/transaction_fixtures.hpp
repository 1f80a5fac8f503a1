// SPDX-License-Identifier: LGPL-3.0-or-later
// An architecture to transact upon: registered parts of every kind, and a witness that loses no release.
#pragma once

#include <map>

#include "fixtures.hpp"

namespace mauve::testing {

/// Carries the number of runs over.
struct CountingCore : TestCore {
  bool adopt(const CoreBase& old) override { return dynamic_cast<const TestCore*>(&old) != nullptr; }
  void take(CoreBase& old) MAUVE_RT override { runs = static_cast<TestCore&>(old).runs.load(); }
};
struct RefusingCore : TestCore {
  bool adopt(const CoreBase& /*old*/) override { return false; }
};
struct ThrowingCore : TestCore {
  bool adopt(const CoreBase& /*old*/) override { throw std::runtime_error("cannot read the old state"); }
};
struct UnreadyCore : TestCore {
  bool configure_hook() override { return false; }
};

/// Two activations, one unit and two units apart: g is three units.
struct SyncopatedFsm : Fsm<TestShell, TestCore> {
  void define() override {
    State& first = execution("First", "act", &TestCore::act);
    State& short_pause = wait("ShortPause", ms_to_ns(shell().period_ms.value()));
    State& second = execution("Second", "act", &TestCore::act);
    State& long_pause = wait("LongPause", 2 * ms_to_ns(shell().period_ms.value()));
    set_initial(first);
    next(first, short_pause);
    next(short_pause, second);
    next(second, long_pause);
    next(long_pause, first);
  }
};

/// Lets a test hold a part up, and know that it has come there.
struct Doors {
  std::atomic<bool> entered{false};
  std::atomic<bool> open{false};
  void pass() {
    entered = true;
    while (!open) sleep_for(ms_to_ns(1));
  }
};
struct HangingCore : TestCore {
  explicit HangingCore(std::shared_ptr<Doors> shared) : doors(std::move(shared)) {}
  bool configure_hook() override {
    doors->pass();
    return true;
  }
  std::shared_ptr<Doors> doors;  // its thread may end after the test
};
/// In a long state, so that a commit waits for it.
struct BusyCore : TestCore {
  explicit BusyCore(std::shared_ptr<Doors> shared) : doors(std::move(shared)) {}
  void act() override {
    TestCore::act();
    doors->pass();
  }
  std::shared_ptr<Doors> doors;
};

struct WideShell : TestShell {
  ReadPort<Number>& second_input = read_port<Number>("second_input").optional();
};
struct NarrowShell : Shell {
  Property<double>& gain = property("gain", 1.0);
};
struct NarrowFsm : Fsm<NarrowShell, TestCore> {
  void define() override {}
};

inline constexpr const char* kNumberType = "std_msgs/msg/Float64";

inline void register_parts(PluginRegistry& registry) {
  registry.type<Number>();
  registry.shell<TestShell>("t/Shell");
  registry.shell<WideShell>("t/WideShell");
  registry.shell<NarrowShell>("t/NarrowShell");
  registry.core<TestCore>("t/Core", "t/Shell");
  registry.core<CountingCore>("t/Counting", "t/Shell");
  registry.core<RefusingCore>("t/Refusing", "t/Shell");
  registry.core<ThrowingCore>("t/Throwing", "t/Shell");
  registry.core<UnreadyCore>("t/Unready", "t/Shell");
  registry.core<CountingCore>("t/Undeclared", "t/Shell");
  registry.fsm<TestFsm>("t/Fsm", "t/Shell");
  registry.fsm<SyncopatedFsm>("t/Syncopated", "t/Shell");
  registry.fsm<NarrowFsm>("t/NarrowFsm", "t/NarrowShell");
}

/// Follows one component's releases through the trace: each comes at the instant that the last one and the overruns
/// in between make due, whatever is done to others.
class ReleaseWitness {
 public:
  ReleaseWitness(const Task& task, time_ns_t period_ns) : number_(task.number()), period_ns_(period_ns) {}

  void look(const TraceDrain& drain) {
    for (const TraceRecord& record : drain.records) {
      if (record.component != number_) continue;
      if (record.kind == static_cast<std::uint16_t>(TraceKind::overrun)) {
        if (due_ns_ != 0) {
          EXPECT_EQ(due_ns_, record.a);
        }
        due_ns_ = record.a + record.c * period_ns_;
      } else if (record.kind == static_cast<std::uint16_t>(TraceKind::armed) && record.c != 0) {
        // Woken late at a gate: the machine stood still, and the trace tells so as of an overrun.
        if (due_ns_ != 0) {
          EXPECT_EQ(due_ns_ + record.c * period_ns_, record.a);
        }
        due_ns_ = record.a;
      } else if (record.kind == static_cast<std::uint16_t>(TraceKind::release)) {
        if (due_ns_ != 0) {
          EXPECT_EQ(due_ns_, record.a) << "release " << releases_;
        }
        due_ns_ = record.a + period_ns_;
        ++releases_;
      }
    }
    EXPECT_EQ(0U, drain.dropped[number_]) << "the trace has a gap: drain it more often";
  }
  int releases() const noexcept { return releases_; }

 private:
  std::uint16_t number_;
  time_ns_t period_ns_;
  time_ns_t due_ns_{0};
  int releases_{0};
};

/// Components by registered names; all run but "idle".
class Transacted : public ::testing::Test {
 protected:
  Transacted() { register_parts(registry); }
  ~Transacted() override { run_on_where_sanitized(); }

  Component& add(const std::string& name, std::int64_t period_ms = 2, const TaskSettings& settings = {}) {
    TaskSettings pinned = settings;
    pinned.cpus = {kComponentsCpu};
    pinned.trace_records = std::size_t{1} << 15U;
    Component& component = architecture.add_component(name, "t/Shell", "t/Core", "t/Fsm", pinned);
    component.allow({"t/Counting", "t/Refusing", "t/Throwing", "t/Unready"}, true);
    component.set_property("period_ms", period_ms);
    return component;
  }
  static ComponentParts parts(std::int64_t period_ms = 2, const std::string& core = "t/Core") {
    ComponentParts parts{.shell = "t/Shell", .core = core, .fsm = "t/Fsm"};
    parts.settings.cpus = {kComponentsCpu};
    parts.properties["period_ms"] = period_ms;
    parts.alternatives = {"t/Counting"};
    return parts;
  }
  void deploy() {
    architecture.configure();
    deployer.deploy();
  }
  TransactionReport commit(Transaction& transaction, TransactionOptions options = {}) {
    if (options.timeouts.commit_ns == CommitTimeouts{}.commit_ns) options.timeouts.commit_ns = s_to_ns(10);
    return deployer.commit(std::move(transaction), options);
  }
  /// The error of a commit that has to fail.
  Error error_of(Transaction& transaction, const TransactionOptions& options = {}) {
    try {
      commit(transaction, options);
    } catch (const Error& error) {
      return error;
    }
    ADD_FAILURE() << "should have been refused";
    return {ErrorCode::internal, "no error"};
  }
  std::string described() const { return to_string(architecture.describe()); }
  ComponentFacts facts(const std::string& name) const {
    for (const ComponentFacts& each : architecture.describe().components) {
      if (each.name == name) return each;
    }
    ADD_FAILURE() << "no component " << name;
    return {};
  }
  std::string wire(const std::string& component, const std::string& port) const {
    for (const ShownPort& each : facts(component).parts.ports) {
      if (each.name == port) return each.resource.empty() ? "" : each.resource + "." + each.service;
    }
    return "no such port";
  }
  PropertyValue property(const std::string& component, const std::string& name) const {
    for (const ShownProperty& each : facts(component).parts.properties) {
      if (each.name == name) return each.value;
    }
    return std::string("no such property");
  }
  int runs(const std::string& name) { return architecture.component(name).core_as<TestCore>().runs.load(); }
  void expect_running(const std::string& name) {
    const int before = runs(name);
    wait_until([&] { return runs(name) > before + 1; }, name.c_str());
  }

  AwayFromComponents away;
  PluginRegistry registry;
  Architecture architecture{&registry};
  Deployer deployer{architecture};
};

}  // namespace mauve::testing
