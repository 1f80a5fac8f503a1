// SPDX-License-Identifier: LGPL-3.0-or-later
// What a rule does, carried out by hand.
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

}  // namespace
}  // namespace mauve::rules::test_action
