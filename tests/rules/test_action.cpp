// SPDX-License-Identifier: LGPL-3.0-or-later
// What a rule does, carried out by hand.
#include <atomic>
#include <chrono>
#include <thread>

#include "mauve_rt/rules/action.hpp"

#include "hosts.hpp"

namespace mauve::rules::test_action {
namespace {

using namespace mauve::testing;  // NOLINT(google-build-using-namespace): the kernel's fixtures

template <typename Way>
class ActionTest : public Hosted<Way> {
 protected:
  ~ActionTest() override { this->way.shutdown(); }
};
TYPED_TEST_SUITE(ActionTest, EveryHost, HostNames);

TYPED_TEST(ActionTest, ReportsOnceWhatEnded) {
  this->add("c");
  this->deploy();
  Action action(true, {}, "r");
  ASSERT_TRUE(
      action.prepare(this->host(), 1, {{.kind = "replace_core", .target = "c", .name = "t/Counting"}}, 7))
      << action.problem();
  EXPECT_TRUE(action.is_ready(7));
  EXPECT_FALSE(action.is_ready(8)) << "other steps are wanted by now";
  ASSERT_TRUE(action.begin());
  EXPECT_FALSE(action.begin()) << "once";
  EXPECT_TRUE(action.is_unsettled());
  ASSERT_TRUE(action.commit());
  EXPECT_FALSE(action.settle(this->host())) << "whoever decides has not heard of it";
  EXPECT_EQ(Ended::done, action.ended());
  EXPECT_TRUE(action.settle(this->host()));
  EXPECT_FALSE(action.is_unsettled());
  const std::optional<ActionReport> report = action.report();
  ASSERT_TRUE(report && report->report);
  EXPECT_EQ("t/Counting", report->report->steps.at(0).to_core);
  EXPECT_FALSE(action.report()) << "once";
}

TYPED_TEST(ActionTest, WhatIsCalledOffChangesNothing) {
  this->add("c");
  this->deploy();
  Action action(true, {}, "r");
  ASSERT_TRUE(
      action.prepare(this->host(), 1, {{.kind = "replace_core", .target = "c", .name = "t/Counting"}}, 7))
      << action.problem();
  EXPECT_TRUE(action.is_ready(7));
  EXPECT_FALSE(action.is_ready(8)) << "other steps are wanted by now";
  ASSERT_TRUE(action.begin());
  action.call_off();
  ASSERT_TRUE(action.commit());
  EXPECT_EQ(Ended::withdrawn, action.ended());
  EXPECT_TRUE(action.settle(this->host()));
  const std::optional<ActionReport> report = action.report();
  ASSERT_TRUE(report);
  EXPECT_THAT(report->failure, ::testing::HasSubstr("called off"));
  EXPECT_EQ("t/Core", this->architecture.component("c").shown().core);
}

/// Its configure lasts until it is let go.
struct HeldCore : TestCore {
  bool configure_hook() override {
    is_held.store(true);
    while (is_held.load()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    return TestCore::configure_hook();
  }
  static inline std::atomic<bool> is_held{false};
};

TYPED_TEST(ActionTest, IsPreparedAgainWhereAnotherPreparationHinderedIt) {
  if (TestFixture::is_virtual) GTEST_SKIP() << "in virtual time nothing lasts";
  this->registry.template core<HeldCore>("t/Held", "t/Shell");
  this->add("c").allow({"t/Held", "t/Refusing"}, true);
  this->deploy();
  std::thread other(
      [this] { this->host().prepare(std::move(Transaction().replace_core("c", "t/Held")), {}); });
  this->way.until([] { return HeldCore::is_held.load(); }, "the other preparation");
  const ActionSteps gain{{.kind = "set_property", .target = "c", .name = "gain", .value = 2.0}};
  Action action(true, {.timeouts = {.commit_ns = ms_to_ns(10)}}, "r");
  EXPECT_FALSE(action.prepare(this->host(), 1, gain, 7));
  EXPECT_THAT(action.problem(), ::testing::HasSubstr("another change"));
  EXPECT_TRUE(action.may_pass());
  EXPECT_TRUE(action.is_wanting(1, 7)) << "nothing else changes";
  HeldCore::is_held.store(false);
  other.join();
  EXPECT_TRUE(action.prepare(this->host(), 1, gain, 7)) << action.problem();
  EXPECT_FALSE(action.may_pass());
  EXPECT_FALSE(action.is_wanting(1, 7));
}

}  // namespace
}  // namespace mauve::rules::test_action
