// SPDX-License-Identifier: LGPL-3.0-or-later
// The longest time for which a user holds a resource's lock: declared for the timing analysis, told by descriptions.
#include "transaction_fixtures.hpp"

namespace mauve::testing::test_longest_hold {

struct SlowMap final : Resource {
  SlowMap() : Resource("test/SlowMap", "") { set_longest_hold_ns(ms_to_ns(2)); }
};

TEST(LongestHold, IsNotDeclaredUnlessTheCodeDeclaresIt) {
  EXPECT_EQ(0, SharedData<Number>().longest_hold_ns());
  EXPECT_EQ(ms_to_ns(2), SlowMap().longest_hold_ns());
}

TEST(LongestHold, IsATimeWithinBounds) {
  SharedData<Number> data;
  data.set_name("data");
  data.set_longest_hold_ns(kLongest);
  for (const time_ns_t wrong : {time_ns_t{-1}, kLongest + 1}) {
    try {
      data.set_longest_hold_ns(wrong);
      FAIL() << wrong;
    } catch (const Error& error) {
      EXPECT_EQ(ErrorCode::out_of_range, error.code());
      EXPECT_EQ("resource data, longest_hold_ns", error.detail().element);
    }
  }
  EXPECT_EQ(kLongest, data.longest_hold_ns());
}

TEST_F(Deployed, ThePortsOfItsUsersTellTheHoldOfAResource) {
  architecture.add_resource<SharedData<Number>>("data").set_longest_hold_ns(5000);
  const Component& component = add("c", 1);
  architecture.connect("c", "input", "data", "read");
  for (const ShownPort& port : component.shown().ports)
    EXPECT_EQ(port.name == "input" ? 5000 : 0, port.longest_hold_ns) << port.name;
  const auto described = architecture.describe();
  EXPECT_EQ(5000, described.resources.at(0).longest_hold_ns);
  EXPECT_THAT(to_string(described), ::testing::HasSubstr("longest_hold_ns 5000\n"));
}

TEST_F(Deployed, NothingEnforcesTheLongestHold) {
  architecture.add_resource<SharedData<Number>>("data").set_longest_hold_ns(1);
  Component& component = add("c", 1);
  architecture.connect("c", "output", "data", "write");
  core(component).work = [&] { core(component).exposed_shell().output.write(Number{1.0}); };
  deploy();
  wait_runs(component, 5);
  EXPECT_EQ(ComponentState::running, component.task().state());
}

TEST(LongestHold, OfATransactionTakesPrecedenceOverTheCode) {
  Architecture architecture;
  Transaction transaction;
  transaction.add_resource("own", std::make_unique<SlowMap>())
      .add_resource("given", std::make_unique<SlowMap>(), TopicBinding::none, 7000);
  architecture.commit(std::move(transaction));
  EXPECT_EQ(ms_to_ns(2), architecture.resource("own").longest_hold_ns());
  EXPECT_EQ(7000, architecture.resource("given").longest_hold_ns());
  Transaction wrong;
  wrong.add_resource("wrong", std::make_unique<SlowMap>(), TopicBinding::none, -1);
  EXPECT_THROW(architecture.commit(std::move(wrong)), Error);
}

}  // namespace mauve::testing::test_longest_hold
