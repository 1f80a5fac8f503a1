// SPDX-License-Identifier: LGPL-3.0-or-later
// Rules 7 and 9: shell, core and fsm replaced by a transaction.
#include "transaction_fixtures.hpp"

namespace mauve::testing::test_transaction_parts {

class Rule9Parts : public Transacted {
 protected:
  void SetUp() override {
    add("c", 5);
    architecture.add_resource<SharedData<Number>>("x");
    architecture.connect("c", "output", "x", "write");
    architecture.connect("c", "input", "x", "read");
    deploy();
    wait_until([&] { return runs("c") > 0; }, "the component to run");
  }
  /// Nominal instants of the releases after the last time the component was armed.
  std::vector<time_ns_t> releases_since_armed(int count) {
    std::vector<time_ns_t> found;
    TraceDrain all = deployer.drain_trace();
    wait_until(
        [&] {
          const TraceDrain more = deployer.drain_trace();
          all.records.insert(all.records.end(), more.records.begin(), more.records.end());
          const auto armed = records_of(all, TraceKind::armed);
          found.clear();
          for (const TraceRecord& release : records_of(all, TraceKind::release)) {
            if (!armed.empty() && release.sequence > armed.back().sequence) found.push_back(release.a);
          }
          return found.size() >= static_cast<std::size_t>(count);
        },
        "releases");
    return found;
  }
};

TEST_F(Rule9Parts, ACoreKeepsThePositionAndThePendingInstant) {
  Transaction syncopate;
  syncopate.replace_fsm("c", "t/Syncopated");
  commit(syncopate);
  expect_running("c");
  for (int i = 0; i < 20; ++i) {
    deployer.drain_trace();
    Transaction transaction;
    transaction.replace_core("c", "t/Counting");
    const TransactionReport report = commit(transaction, {.timeouts = {.phase_ns = s_to_ns(10)}});
    const TraceDrain drain = deployer.drain_trace();
    const auto parked = records_of(drain, TraceKind::parked);
    const auto armed = records_of(drain, TraceKind::armed);
    ASSERT_FALSE(armed.empty());
    ASSERT_FALSE(parked.empty());
    EXPECT_EQ(parked.back().name, armed.back().name) << "the same wait";
    // The machine stalled the commit past the instant. armed's instant is later by a stall that lost some.
    if (armed.back().time_ns > parked.back().a) continue;
    EXPECT_EQ(parked.back().a, armed.back().a);
    EXPECT_EQ(0, report.steps[0].missed_releases);
  }
}

TEST_F(Rule9Parts, AnFsmStartsInItsInitialStateOnItsOwnPeriodAndTheSameEpoch) {
  Transaction transaction;
  transaction.replace_fsm("c", "t/Syncopated");
  commit(transaction);
  const ComponentFacts now = facts("c");
  EXPECT_EQ("t/Syncopated", now.parts.fsm);
  EXPECT_EQ(ms_to_ns(15), now.period_ns);
  EXPECT_EQ(0, now.reference_ns);
  const auto releases = releases_since_armed(3);
  ASSERT_GE(releases.size(), 3U);
  EXPECT_EQ(0, (releases[0] - deployer.epoch_ns()) % ms_to_ns(15)) << "the initial state's instants";
  Transaction back;
  back.replace_fsm("c", "t/Fsm").set_property("c", "period_ms", 7);
  commit(back);
  EXPECT_EQ("t/Fsm", facts("c").parts.fsm);
}

TEST_F(Rule9Parts, AShellKeepsConnectionsAndPropertiesByName) {
  Transaction set;
  set.set_property("c", "gain", 6.5);
  commit(set);
  Transaction transaction;
  transaction.replace_shell("c", "t/WideShell").connect("c", "second_input", "x", "read");
  commit(transaction);
  EXPECT_EQ("t/WideShell", facts("c").parts.shell);
  EXPECT_EQ("x.write", wire("c", "output"));
  EXPECT_EQ("x.read", wire("c", "input"));
  EXPECT_EQ("x.read", wire("c", "second_input"));
  EXPECT_EQ(PropertyValue(6.5), property("c", "gain"));
  EXPECT_EQ(PropertyValue(std::int64_t{5}), property("c", "period_ms"));
  EXPECT_EQ(ms_to_ns(5), facts("c").period_ns);
  EXPECT_EQ(2U, architecture.resource("x").find_service("read")->ports()) << "the old shell's ports are gone";
  for (const char* port : {"input", "second_input", "output"})
    EXPECT_TRUE(architecture.component("c").shell().find_port(port)->is_seated()) << port;
  EXPECT_EQ(has_process_barrier(), architecture.resource("x").find_service("write")->is_wait_free());
  expect_running("c");
  Transaction back;  // an fsm that was replaced by name is made once more by name
  back.replace_fsm("c", "t/Syncopated");
  commit(back);
  Transaction again;
  again.replace_shell("c", "t/WideShell").disconnect("c", "second_input").set_property("c", "gain", 1.5);
  commit(again);
  EXPECT_EQ("t/Syncopated", facts("c").parts.fsm);
  EXPECT_EQ(ms_to_ns(15), facts("c").period_ns);
  EXPECT_EQ(PropertyValue(1.5), property("c", "gain"));
  EXPECT_EQ("", wire("c", "second_input"));
  expect_running("c");
}

TEST_F(Rule9Parts, AllThreePartsAndAnotherTwoBack) {
  Transaction all;
  all.replace_shell("c", "t/WideShell").replace_fsm("c", "t/Syncopated").replace_core("c", "t/Counting");
  commit(all);
  EXPECT_EQ("t/WideShell", facts("c").parts.shell);
  EXPECT_EQ("t/Syncopated", facts("c").parts.fsm);
  EXPECT_EQ("t/Counting", facts("c").parts.core);
  expect_running("c");
  Transaction stopped;
  stopped.stop("c").replace_shell("c", "t/Shell").replace_fsm("c", "t/Fsm");
  commit(stopped);
  EXPECT_EQ(ComponentState::stopped, facts("c").state);
  EXPECT_EQ("t/Shell", facts("c").parts.shell);
  deployer.start("c");
  expect_running("c");
}

TEST_F(Rule9Parts, AConnectedPortThatTheNewShellLacksIsRefusedUnlessDisconnected) {
  const std::string before = described();
  Transaction transaction;
  transaction.set_property("c", "gain", 2.0).replace_shell("c", "t/NarrowShell");
  const Error error = error_of(transaction);
  EXPECT_EQ(ErrorCode::unknown_port, error.code());
  EXPECT_EQ(2, error.detail().step);
  EXPECT_EQ("c", error.detail().component);
  EXPECT_THAT(error.what(), ::testing::HasSubstr("step 2 (replace_shell c t/NarrowShell)"));
  EXPECT_EQ(before, described());
  Transaction widened;
  widened.replace_shell("c", "t/WideShell").connect("c", "second_input", "x", "read");
  commit(widened);
  Transaction narrowed;
  narrowed.replace_shell("c", "t/Shell").disconnect("c", "second_input");
  commit(narrowed);
  EXPECT_EQ("t/Shell", facts("c").parts.shell);
  EXPECT_EQ("x.read", wire("c", "input"));
  expect_running("c");
}

TEST_F(Rule9Parts, AddedComponentsTakeTheirFallbackAlong) {
  ComponentParts with_fallback = parts();
  with_fallback.fallback = "t/Counting";
  Transaction transaction;
  transaction.add_component("d", with_fallback).start("d");
  commit(transaction);
  EXPECT_EQ("t/Counting", facts("d").fallback);
  expect_running("d");
}

}  // namespace mauve::testing::test_transaction_parts
