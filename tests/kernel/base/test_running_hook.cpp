// SPDX-License-Identifier: LGPL-3.0-or-later
#include <gtest/gtest.h>

#include <thread>

#include "mauve_rt/base/configurable.hpp"
#include "mauve_rt/base/error.hpp"
#include "mauve_rt/base/running_hook.hpp"

namespace mauve::testing::test_running_hook {

std::string own() { return RunningHook::of(std::this_thread::get_id()).hook; }

struct Inner : Configurable {
  bool configure_hook() override {
    seen = own();
    return true;
  }
  std::string description() const override { return "inner"; }
  std::string seen{};
};

struct Outer : Configurable {
  bool configure_hook() override {
    before = own();
    inner.configure();
    after = own();
    const std::thread::id thread = std::this_thread::get_id();
    std::thread([&] {
      other = own();
      seen_by_other = RunningHook::of(thread).hook;
    }).join();
    return true;
  }
  void cleanup_hook() override {
    cleaning = own();
    throw 1;
  }
  std::string description() const override { return "outer"; }
  Inner inner;
  std::string before{}, after{}, other{}, seen_by_other{}, cleaning{};
};

TEST(RunningHook, IsTheInnermostOfItsThread) {
  Outer outer;
  outer.configure();
  EXPECT_EQ("configure of outer", outer.before);
  EXPECT_EQ("configure of inner", outer.inner.seen);
  EXPECT_EQ("configure of outer", outer.after);
  EXPECT_EQ("", outer.other);
  EXPECT_EQ("configure of outer", outer.seen_by_other);
  EXPECT_EQ("", own());
  outer.cleanup();
  EXPECT_EQ("cleanup of outer", outer.cleaning);
  EXPECT_EQ("", own()) << "after one that throws";
  EXPECT_EQ(0, RunningHook::of(std::this_thread::get_id()).since_ns);
}

bool call_off_own() {
  return RunningHook::call_off(std::this_thread::get_id(), [] { return true; });
}

TEST(RunningHook, IsCalledOffUntilItIsLeftAndNotAfter) {
  RunningHook late("configure", "late");
  EXPECT_NO_THROW(late.leave());
  EXPECT_FALSE(call_off_own()) << "who has left it would not learn of it";
  RunningHook early("configure", "early");
  EXPECT_TRUE(call_off_own());
  EXPECT_THROW(early.leave(), Error);
}

TEST(RunningHook, IsCalledOffWithTheHookThatItCalls) {
  RunningHook outer("configure", "outer");
  {
    RunningHook inner("configure", "inner");
    EXPECT_TRUE(call_off_own());
    EXPECT_THROW(inner.leave(), Error);
  }
  EXPECT_THROW(outer.leave(), Error);
  EXPECT_EQ("", own());
}

}  // namespace mauve::testing::test_running_hook
