// SPDX-License-Identifier: LGPL-3.0-or-later
// Factories, of plug-ins and of programs, that make nothing.
#include "transaction_fixtures.hpp"

namespace mauve::testing::test_factories {

template <typename Make>
void expect_refused(Make&& make, ErrorCode code) {
  try {
    make();
    ADD_FAILURE() << "should have been refused";
  } catch (const Error& error) {
    EXPECT_EQ(code, error.code()) << error.what();
    EXPECT_FALSE(error.detail().element.empty()) << error.what();
    EXPECT_FALSE(error.detail().expected.empty()) << error.what();
    EXPECT_EQ("nullptr", error.detail().found) << error.what();
    EXPECT_FALSE(error.detail().remedy.empty()) << error.what();
  }
}

TEST(Factories, OfARegistryThatMakeNothingAreRefused) {
  PluginRegistry registry;
  registry.add_shell("n/Shell", [] { return std::unique_ptr<Shell>{}; });
  registry.add_core("n/Core", "n/Shell", [] { return std::unique_ptr<CoreBase>{}; });
  registry.add_fsm("n/Fsm", "n/Shell", [] { return std::unique_ptr<FsmBase>{}; });
  registry.add_resource({.name = "nothing"},
                        [](const ResourceParameters&) { return std::unique_ptr<Resource>{}; });
  expect_refused([&] { registry.make_shell("n/Shell"); }, ErrorCode::plugin);
  expect_refused([&] { registry.make_core("n/Core"); }, ErrorCode::plugin);
  expect_refused([&] { registry.make_fsm("n/Fsm"); }, ErrorCode::plugin);
  expect_refused([&] { registry.make_resource("nothing", "", {}); }, ErrorCode::plugin);
}

using FactoriesInFlight = Transacted;

TEST_F(FactoriesInFlight, OfTheRegistryChangeNothing) {
  registry.add_core("n/Core", "t/Shell", [] { return std::unique_ptr<CoreBase>{}; });
  registry.add_fsm("n/Fsm", "t/Shell", [] { return std::unique_ptr<FsmBase>{}; });
  registry.add_shell("n/Shell", [] { return std::unique_ptr<Shell>{}; });
  add("c").allow({"n/Core"}, true);
  deploy();
  const std::string before = described();
  expect_refused([&] { deployer.commit(std::move(Transaction().replace_core("c", "n/Core"))); },
                 ErrorCode::plugin);
  expect_refused([&] { deployer.commit(std::move(Transaction().replace_fsm("c", "n/Fsm"))); },
                 ErrorCode::plugin);
  expect_refused([&] { deployer.commit(std::move(Transaction().replace_shell("c", "n/Shell"))); },
                 ErrorCode::plugin);
  EXPECT_EQ(before, described());
  expect_running("c");
}

TEST_F(FactoriesInFlight, OfAProgramsFsmChangeNothing) {
  auto fsm = std::make_unique<TestFsm>();
  fsm->set_factory([] { return std::unique_ptr<FsmBase>{}; });
  architecture.add_component("c", std::make_unique<TestShell>(), std::make_unique<TestCore>(), std::move(fsm),
                             {});
  deploy();
  expect_refused(
      [&] { deployer.commit(std::move(Transaction().replace_shell("c", std::make_unique<TestShell>()))); },
      ErrorCode::prepare_failed);
  expect_running("c");
}

TEST_F(FactoriesInFlight, AnObjectThatIsNoneIsRefused) {
  add("c");
  deploy();
  const auto code = [&](Transaction& transaction) { return error_of(transaction).code(); };
  EXPECT_EQ(ErrorCode::invalid_argument, code(Transaction().replace_core("c", std::unique_ptr<CoreBase>{})));
  EXPECT_EQ(ErrorCode::invalid_argument, code(Transaction().replace_fsm("c", std::unique_ptr<FsmBase>{})));
  EXPECT_EQ(ErrorCode::invalid_argument, code(Transaction().replace_shell("c", std::unique_ptr<Shell>{})));
  EXPECT_EQ(ErrorCode::invalid_argument, code(Transaction().add_resource("r", std::unique_ptr<Resource>{})));
  EXPECT_EQ(ErrorCode::invalid_argument, code(Transaction().add_component("n", Parts{}, {}, {})));
  expect_running("c");
}

}  // namespace mauve::testing::test_factories
