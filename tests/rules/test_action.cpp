// SPDX-License-Identifier: LGPL-3.0-or-later
// What a rule does, carried out by hand.
#include "mauve_rt/rules/action.hpp"

#include "hosts.hpp"

namespace mauve::rules {
namespace {

using namespace mauve::testing;  // NOLINT(google-build-using-namespace): the kernel's fixtures

template <typename Way>
class ActionTest : public Hosted<Way> {
 protected:
  ~ActionTest() override { this->way.shutdown(); }
};
TYPED_TEST_SUITE(ActionTest, EveryHost, HostNames);

TYPED_TEST(ActionTest, ReportsWhatEndedSinceItWasTended) {
  this->add("c");
  this->deploy();
  Action action({{.kind = "replace_core", .target = "c", .name = "t/Counting"}});
  ASSERT_TRUE(action.tend(this->host(), this->architecture.revision())) << action.problem();
  ASSERT_TRUE(action.begin());
  EXPECT_EQ(Ended::done, action.ended());
  const std::optional<ActionReport> report = action.report();
  ASSERT_TRUE(report && report->report);
  EXPECT_EQ("t/Counting", report->report->steps.at(0).to_core);
  EXPECT_FALSE(action.settle(this->host()));
  EXPECT_FALSE(action.report()) << "once";
}

}  // namespace
}  // namespace mauve::rules
