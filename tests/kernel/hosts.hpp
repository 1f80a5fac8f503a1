// SPDX-License-Identifier: LGPL-3.0-or-later
// One test body for every host: an architecture of test components on threads, or in virtual time.
//
//   TYPED_TEST(HostConformance, Says) { this->add("c"); this->deploy(); this->run_for(ms_to_ns(10)); ... }
#pragma once

#include <algorithm>
#include <memory>

#include "transaction_fixtures.hpp"

namespace mauve::testing {

/// How an architecture is run; what tests must do differently, and nothing else.
class OnThreads {
 public:
  explicit OnThreads(Architecture& architecture) : architecture_(architecture), deployer_(architecture) {}

  Host& host() { return deployer_; }
  /// Until every component that runs has been released at all instants up to then.
  void run_for(time_ns_t duration_ns) {
    const time_ns_t until = monotonic_now_ns() + duration_ns;
    sleep_for(duration_ns);
    for (const auto& component : architecture_.components()) {
      const Task& task = component->task();
      const auto is_done = [&] {
        return task.state() != ComponentState::running || clock_of(*component) > until;
      };
      wait_until(is_done, "the component's releases");
    }
  }
  template <typename Condition>
  void until(Condition&& condition, const char* what) {
    wait_until(condition, what);
  }
  void shutdown() { deployer_.shutdown(); }

 private:
  static time_ns_t clock_of(Component& component) {
    return component.task().context().clock_ns.load(std::memory_order_relaxed);
  }

  AwayFromComponents away_;
  Architecture& architecture_;
  Deployer deployer_;
};

class InVirtualTime {
 public:
  explicit InVirtualTime(Architecture& architecture) : architecture_(architecture) {}

  /// Of an architecture that is configured by then.
  Host& host() {
    if (host_ == nullptr) host_ = &simulation_.add(architecture_);
    return *host_;
  }
  void run_for(time_ns_t duration_ns) { simulation_.run_until(simulation_.now_ns() + duration_ns); }
  /// Time passes while the test waits.
  template <typename Condition>
  void until(Condition&& condition, const char* what) {
    const time_ns_t latest = simulation_.now_ns() + s_to_ns(60);
    while (!condition()) {
      ASSERT_LT(simulation_.now_ns(), latest) << "gave up waiting for: " << what;
      run_for(us_to_ns(100));
    }
  }
  void shutdown() { simulation_.shutdown(); }

 private:
  Architecture& architecture_;
  Simulation simulation_;
  SimulatedHost* host_{nullptr};
};

#ifdef __SANITIZE_THREAD__  // in virtual time one thread at a time runs: there is no race to find
using EveryHost = ::testing::Types<OnThreads>;
#else
using EveryHost = ::testing::Types<OnThreads, InVirtualTime>;
#endif

class HostNames {
 public:
  template <typename Way>
  static std::string GetName(int /*number*/) {
    return std::is_same_v<Way, OnThreads> ? "threads" : "virtual";
  }
};

/// An architecture of registered test components (transaction_fixtures.hpp), shut down with the fixture.
template <typename Way>
class Hosted : public ::testing::Test {
 protected:
  Hosted() { register_parts(registry); }
  ~Hosted() override { run_on_where_sanitized(); }

  static constexpr bool is_virtual = std::is_same_v<Way, InVirtualTime>;

  Component& add(const std::string& name, std::int64_t period_ms = 2, TaskSettings settings = {}) {
    settings.cpus = {kComponentsCpu};
    settings.trace_records = std::size_t{1} << 15U;
    Component& component = architecture.add_component(name, "t/Shell", "t/Core", "t/Fsm", settings);
    component.allow({"t/Counting", "t/Refusing", "t/Throwing", "t/Unready"}, true);
    component.set_property("period_ms", period_ms);
    core(component).instants.reserve(10'000);
    return component;
  }
  static TestCore& core(Component& component) { return component.core_as<TestCore>(); }

  void deploy() {
    architecture.configure();
    host().deploy();
  }
  Host& host() { return way.host(); }
  /// Lets so much time pass, the epoch's lead besides.
  void run_for(time_ns_t duration_ns) {
    way.run_for(duration_ns + std::max<time_ns_t>(0, host().epoch_ns() - host().now_ns()));
  }
  TransactionReport commit(Transaction& transaction, TransactionOptions options = {}) {
    if (options.timeouts.commit_ns == CommitTimeouts{}.commit_ns) options.timeouts.commit_ns = s_to_ns(10);
    return host().commit(std::move(transaction), options);
  }
  ComponentState state(const std::string& name) const { return architecture.component(name).task().state(); }
  std::uint64_t releases(const std::string& name) const {
    return architecture.component(name).task().statistics().releases.load();
  }
  std::string described() const { return to_string(architecture.describe()); }
  /// The error of a call that has to be refused.
  template <typename Call>
  static Error refusal(Call&& call) {
    try {
      call();
    } catch (const Error& error) {
      return error;
    }
    ADD_FAILURE() << "should have been refused";
    return {ErrorCode::internal, "no error"};
  }
  /// The error of a transaction that has to be refused, and leave all as it is.
  Error refused(Transaction& transaction, const TransactionOptions& options = {}) {
    const std::string before = described();
    Error error = refusal([&] { commit(transaction, options); });
    EXPECT_EQ(before, described()) << "a refusal changes nothing";
    return error;
  }

  PluginRegistry registry;
  Architecture architecture{&registry};
  Way way{architecture};
};

/// What tests ask of a host of any kind, told shortly.
template <typename Way>
class AnyHost : public Way {
 public:
  using Way::Way;
  Host& operator*() { return this->host(); }
  void start(const std::string& name, std::optional<time_ns_t> clock_ns = {}) {
    this->host().start(name, clock_ns);
  }
  void stop(const std::string& name, time_ns_t timeout_ns = s_to_ns(10)) {
    this->host().stop(name, timeout_ns);
  }
  TransactionReport commit(Transaction transaction, time_ns_t phase_ns = s_to_ns(30)) {
    return this->host().commit(std::move(transaction),
                               {.timeouts = {.commit_ns = s_to_ns(30), .phase_ns = phase_ns}});
  }
  time_ns_t now_ns() { return this->host().now_ns(); }
};

/// An architecture on a host of any kind.
template <typename Way>
class OnBothHosts : public ::testing::Test {
 protected:
  ~OnBothHosts() override {
    if constexpr (!is_virtual) run_on_where_sanitized();
    host.shutdown();
  }
  static constexpr bool is_virtual = std::is_same_v<Way, InVirtualTime>;
  /// For a case that a busy computer has spoilt: an architecture and a host as at the begin.
  void begin_again() {
    if constexpr (!is_virtual) run_on_where_sanitized();
    host.shutdown();
    std::destroy_at(&host);
    std::destroy_at(&architecture);
    std::construct_at(&architecture);
    std::construct_at(&host, architecture);
  }
  Component& add(const std::string& name, std::int64_t period_ms = 1, const TaskSettings& settings = {}) {
    Component& component = architecture.add_component<TestShell, TestCore, TestFsm>(name, settings);
    component.set_property("period_ms", period_ms);
    core(component).instants.reserve(10'000);
    return component;
  }
  static TestCore& core(Component& component) { return component.core_as<TestCore>(); }
  void deploy() {
    architecture.configure();
    (*host).deploy();
  }
  void wait_runs(Component& component, int runs) {
    host.until([&] { return core(component).runs.load() >= runs; }, "the component to run");
  }
  void wait_state(Component& component, ComponentState state) {
    host.until([&] { return component.task().state() == state; }, "the component's state");
  }
  /// The code of the error that the action throws; a failure when it throws none.
  template <typename Action>
  static ErrorCode code_of(Action&& action, std::string* text = nullptr) {
    try {
      action();
    } catch (const Error& error) {
      if (text != nullptr) *text = error.what();
      return error.code();
    }
    ADD_FAILURE() << "it was not refused";
    return ErrorCode::internal;
  }

  Architecture architecture;
  AnyHost<Way> host{architecture};
};

}  // namespace mauve::testing
