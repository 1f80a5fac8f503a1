// SPDX-License-Identifier: LGPL-3.0-or-later
// What may be the name of something.
#include "free_fsm.hpp"

namespace mauve::testing::test_names {

TEST(Names, FollowOneRuleEverywhere) {
  const std::vector<std::string> bad{"",     "a b", "x/y.z", std::string(300, 'a'), "a\nb", "1a", "_a",
                                     "a__b", "é",   "a-b"};
  const auto code_of = [](const std::function<void()>& action) {
    try {
      action();
    } catch (const Error& error) {
      return error.code();
    }
    return ErrorCode::internal;
  };
  struct OfName : Shell {
    OfName(const std::string& port, const std::string& given) {
      read_port<Number>(port);
      property(given, 1.0);
    }
  };
  for (const std::string& name : bad) {
    SCOPED_TRACE(name);
    Architecture architecture;
    constexpr ErrorCode kRefused = ErrorCode::invalid_argument;
    EXPECT_EQ(kRefused, code_of([&] { architecture.add_component<TestShell, TestCore, TestFsm>(name); }));
    EXPECT_EQ(kRefused, code_of([&] { architecture.add_resource<SharedData<Number>>(name); }));
    EXPECT_TRUE(architecture.components().empty() && architecture.resources().empty());
    EXPECT_EQ(kRefused, code_of([&] { OfName(name, "p"); }));
    EXPECT_EQ(kRefused, code_of([&] { OfName("p", name); }));
    EXPECT_EQ(kRefused, error_of([&](FreeFsm& fsm) { fsm.run(name); }));
    architecture.configure();
    Deployer deployer(architecture);
    deployer.deploy();
    EXPECT_EQ(kRefused, code_of([&] {
                Transaction add;
                add.add_component<TestShell, TestCore, TestFsm>(name);
                deployer.commit(std::move(add));
              }));
    EXPECT_EQ(kRefused, code_of([&] {
                Transaction add;
                add.add_resource(name, std::make_unique<SharedData<Number>>());
                deployer.commit(std::move(add));
              }));
  }
  Architecture architecture;
  architecture.add_component<TestShell, TestCore, TestFsm>(std::string(100, 'a'));
  architecture.add_component<TestShell, TestCore, TestFsm>("Arm_2_");
}

}  // namespace mauve::testing::test_names
