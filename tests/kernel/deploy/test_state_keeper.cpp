// SPDX-License-Identifier: LGPL-3.0-or-later
// What is decided, by a rule or a person, is in the file soon after.
#include <unistd.h>

#include "mauve_rt/architecture/state_file.hpp"
#include "mauve_rt/architecture/state_keeper.hpp"

#include "fixtures.hpp"

namespace mauve::testing::test_state_keeper {

namespace fs = std::filesystem;

Assigned stop() {
  return {.element = {.target = "base", .name = "state"}, .step = {.kind = "stop", .target = "base"}};
}

Assigned core(const std::string& name) {
  return {.element = {.target = "base", .name = "core"},
          .step = {.kind = "replace_core", .target = "base", .name = name}};
}

class StateKeeperTest : public ::testing::Test {
 protected:
  StateKeeperTest() { fs::remove_all(folder); }
  ~StateKeeperTest() override { fs::remove_all(folder); }

  std::vector<std::string> rules() {
    std::vector<std::string> names;
    for (const OverlaySpec& each : read_state_file(path).value_or(KeptState()).active)
      names.push_back(each.rule);
    return names;
  }
  void await_rules(const std::vector<std::string>& names) {
    wait_until([&] { return rules() == names; }, "the rules in the file");
  }

  const fs::path folder = fs::temp_directory_path() / ("mauve_state_keeper_" + std::to_string(::getpid()));
  const fs::path path = folder / "executor.state";
  Architecture architecture;
  Overlays& overlays{architecture.overlays()};
  StateKeeper keeper{architecture, path};
};

TEST_F(StateKeeperTest, KeepsLatchedRulesThatAreActive) {
  keeper.start();
  EXPECT_EQ(KeptState(), read_state_file(path)) << "that it can be written shows at the start";
  const auto loaded = overlays.load({}, {{.rule = "e_stop", .latch = true, .assigns = {stop()}},
                                         {.rule = "slow", .assigns = {core("p/Slow")}}});
  for (const auto& each : loaded) each->set_active(true);  // as a decision thread does
  await_rules({"e_stop"});
  loaded[0]->set_active(false);
  await_rules({});
  EXPECT_EQ("", keeper.problem());
}

TEST_F(StateKeeperTest, KeepsTheQuarantine) {
  keeper.start();
  overlays.reject(core("p/Bad"));
  wait_until([&] { return read_state_file(path)->rejected == std::vector{core("p/Bad")}; }, "the quarantine");
  overlays.note(core("p/Bad"), "operator");
  wait_until([&] { return read_state_file(path)->rejected.empty(); }, "its end");
}

TEST_F(StateKeeperTest, SaysWhyItCannotWriteAndTriesAgain) {
  fs::create_directories(path.string() + ".new");
  keeper.start();
  EXPECT_NE("", keeper.problem());
  const auto loaded = overlays.load({}, {{.rule = "e_stop", .latch = true, .assigns = {stop()}}});
  overlays.set_active(loaded[0], true);
  fs::remove_all(path.string() + ".new");
  await_rules({"e_stop"});
  wait_until([&] { return keeper.problem().empty(); }, "the end of the problem");
}

TEST_F(StateKeeperTest, TheLastStateIsWrittenAtItsEnd) {
  keeper.start();
  const auto loaded = overlays.load({}, {{.rule = "e_stop", .latch = true, .assigns = {stop()}}});
  overlays.set_active(loaded[0], true);
  keeper.stop();
  EXPECT_EQ(std::vector<std::string>{"e_stop"}, rules());
}

TEST_F(StateKeeperTest, WhatWasKeptIsInForceBeforeAnythingRuns) {
  KeptState state;
  state.active.push_back({.rule = "e_stop", .safety = true, .latch = true, .assigns = {stop()}});
  state.active.push_back({.rule = "gone", .safety = true, .latch = true, .assigns = {stop()}});
  state.rejected = {core("p/Bad")};
  EXPECT_TRUE(overlays.restore(state, {"e_stop"}, architecture.describe()).empty());
  EXPECT_TRUE(overlays.is_kept_stopped("base", architecture.describe()));
  ASSERT_EQ(1U, overlays.at_work({}).size());
  EXPECT_EQ("e_stop", overlays.at_work({})[0]->spec().rule);
  ASSERT_EQ(1U, overlays.at_work(std::string(kKept)).size());
  EXPECT_EQ("gone", overlays.at_work(std::string(kKept))[0]->spec().rule);
  EXPECT_EQ(state.rejected, overlays.rejected());
  overlays.set_active(overlays.at_work({})[0], false);
  EXPECT_TRUE(overlays.is_kept_stopped("base", architecture.describe())) << "the other one is active";
}

}  // namespace mauve::testing::test_state_keeper
