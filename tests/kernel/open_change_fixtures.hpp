// SPDX-License-Identifier: LGPL-3.0-or-later
// A change that is made and that one component is late to take.
#pragma once

#include "mauve_rt/base/seam/ordinary_thread.hpp"

#include "hosts.hpp"

namespace mauve::testing::open_change {

/// Its hooks call what a test gives it.
struct HookedCore : TestCore {
  std::function<void()> adopting = [] {};
  std::function<void()> taking = [] {};
  std::function<void()> cleaning = [] {};
  time_ns_t declared{0};
  time_ns_t budget_ns() const MAUVE_RT override { return declared; }
  void cleanup_hook() override { cleaning(); }
  bool adopt(const CoreBase& /*old*/) override {
    adopting();
    return true;
  }
  void take(CoreBase& /*old*/) MAUVE_RT override { taking(); }
};

/// Waits for events of its shell's input.

inline constexpr time_ns_t kLong = s_to_ns(30);
inline constexpr CommitTimeouts kShortly{.commit_ns = ms_to_ns(100), .phase_ns = 0};

inline Parts new_parts() {
  return {.shell = std::make_unique<TestShell>(),
          .core = std::make_unique<TestCore>(),
          .fsm = std::make_unique<TestFsm>()};
}

/// The component `late` is late to take a change that is made: on threads it is in a state until let_it_go_on(), in virtual time
/// it has a backlog. The component `b` takes part in the same change, and has taken it.
template <typename Way>
class OpenChange : public Hosted<Way> {
 protected:
  static constexpr bool is_virtual = Hosted<Way>::is_virtual;

  void SetUp() override {
    this->add("b");
    this->add("p");
    TaskSettings settings{.priority = 10, .overrun = OverrunPolicy::catch_up, .max_backlog = 1'000'000};
    settings.states = {DeclaredState{.name = "Run", .simulated_execution_ns = ms_to_ns(5)}};
    late = &this->add("late", 2, settings);
    this->core(*late).work = [held = held, this] {
      if (held->is_armed.exchange(false)) held->doors.pass();
      after_doors();
    };
    this->architecture.template add_resource<LatestValue<Number>>("r");
    this->architecture.template add_resource<LatestValue<Number>>("s");
  }
  void TearDown() override {
    let_it_go_on();
    if (requester.joinable()) requester.join();
    this->way.shutdown();
  }
  /// Makes the change of `late`, of b and of whatever else the transaction has. After deploy().
  void make_late(Transaction transaction) {
    auto fresh = std::make_unique<HookedCore>();
    const auto agree = std::make_shared<Doors>();
    if (!is_virtual) fresh->adopting = [agree] { agree->pass(); };
    transaction.replace_core("b", std::move(fresh));
    this->way.until([&] { return this->core(*late).runs > 5; }, "the one that will be late");
    const auto request = [this, &transaction] {
      first =
          this->host().commit(std::move(transaction), {.timeouts = {.commit_ns = s_to_ns(2), .phase_ns = 0}});
    };
    if (is_virtual) {
      request();
    } else {
      requester = OrdinaryThread([request] { EXPECT_NO_THROW(request()); });
      wait_until([&] { return agree->entered.load(); }, "the adopt of b");
      const int runs = this->core(*late).runs;
      wait_until([&] { return this->core(*late).runs > runs + 5; }, "the late one to vote");
      held->is_armed = true;
      wait_until([&] { return held->doors.entered.load(); }, "the late one to be in its state");
      agree->open = true;
      requester.join();
    }
    ASSERT_FALSE(has_taken()) << "it is late";
  }
  void make_late() { make_late(std::move(Transaction().set_property("late", "gain", 2.0))); }
  /// Some periods; the late one does not count.
  void pass_time() {
    if constexpr (is_virtual) this->run_for(ms_to_ns(6));
    if constexpr (!is_virtual) sleep_for(ms_to_ns(20));
  }
  void let_it_go_on() { held->doors.open = true; }
  bool has_taken() { return late->template shell_as<TestShell>().gain.value() == 2.0; }
  void await_taken() {
    let_it_go_on();
    this->way.until([&] { return is_settled(); }, "the late one");
    EXPECT_TRUE(has_taken());
  }
  bool is_settled() {
    this->host().describe();
    const CommitGate::Look table(this->architecture.commit_gate());
    return !late->change_mark().is_unsettled();
  }
  TransactionReport commit(Transaction& transaction,
                           const CommitTimeouts& timeouts = {.commit_ns = s_to_ns(10), .phase_ns = 0}) {
    return this->host().commit(std::move(transaction), {.timeouts = timeouts});
  }
  double value_of(const char* resource) {
    auto& found = static_cast<LatestValue<Number>&>(this->architecture.resource(resource));
    Number value{.value = -9};
    time_ns_t time_ns = 0;
    ReaderState reader;
    found.read.read(value, time_ns, reader);
    return value.value;
  }
  std::vector<std::string> listed() const {
    std::vector<std::string> names;
    for (const auto& component : this->architecture.components()) names.push_back(component->name());
    return names;
  }

  struct Held {
    std::atomic<bool> is_armed{false};
    Doors doors{};
  };
  const std::shared_ptr<Held> held{std::make_shared<Held>()};
  std::function<void()> after_doors = [] {};
  Component* late{nullptr};
  TransactionReport first;
  OrdinaryThread requester;
};

class OpenChangeBeside : public OpenChange<OnThreads> {};

}  // namespace mauve::testing::open_change
