// SPDX-License-Identifier: LGPL-3.0-or-later
// What is cleaned up beside changes, lane by lane.
#include "mauve_rt/base/seam/mutex.hpp"

#include "fixtures.hpp"

namespace mauve::testing::test_keeper {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

class KeeperLanes : public ::testing::Test {
 protected:
  void take(const std::string& what, const void* lane, Keeper::Place place = Keeper::Place::last) {
    keeper.take(
        what,
        [this, what] {
          const LockGuard lock(mutex);
          done.push_back(what);
        },
        lane, place);
  }
  void wait_done(std::size_t count) {
    wait_until([&] { return all_done().size() == count; }, "the work");
  }
  std::vector<std::string> all_done() {
    const LockGuard lock(mutex);
    return done;
  }

  const int one{0};
  const int other{0};
  Mutex mutex;
  std::vector<std::string> done;
  Keeper keeper;  // last: its threads use the rest
};

TEST_F(KeeperLanes, AHeldOneBeginsNothingAndKeepsNoOther) {
  keeper.hold(&one);
  take("first", &one);
  take("second", &one);
  take("other", &other);
  wait_done(1);
  EXPECT_THAT(all_done(), ElementsAre("other"));
  EXPECT_TRUE(keeper.is_held(&one));
  EXPECT_TRUE(keeper.is_at(&one));
  keeper.release(&one);
  wait_done(3);
  EXPECT_THAT(all_done(), ElementsAre("other", "first", "second"));
  wait_until([&] { return !keeper.is_at(&one); }, "the end of the lane");
}

TEST_F(KeeperLanes, EachWhoHoldsOneReleasesIt) {
  keeper.hold(&one);
  keeper.hold(&one);
  take("last", &one);
  keeper.release(&one);
  EXPECT_TRUE(keeper.is_held(&one));
  take("first", &one, Keeper::Place::next);
  EXPECT_THAT(all_done(), IsEmpty());
  keeper.release(&one);
  wait_done(2);
  EXPECT_THAT(all_done(), ElementsAre("first", "last"));
}

TEST_F(KeeperLanes, AHeldOneIsNotWaitedFor) {
  keeper.hold(&one);
  take("held", &one);
  keeper.wait(0, monotonic_now_ns() + s_to_ns(3'600));
  EXPECT_THAT(all_done(), IsEmpty());
  keeper.release(&one);
  wait_done(1);
}

TEST_F(KeeperLanes, OneThatNobodyUsesEndsAtItsRelease) {
  keeper.hold(&one);
  keeper.release(&one);
  EXPECT_FALSE(keeper.is_at(&one));
}

TEST_F(KeeperLanes, WhatIsHeldAtTheEndIsLeftBehind) {
  auto own = std::make_unique<Keeper>();
  const auto is_gone = std::make_shared<std::atomic<bool>>(false);
  struct Used {
    explicit Used(std::shared_ptr<std::atomic<bool>> shared) : flag(std::move(shared)) {}
    ~Used() { *flag = true; }
    std::shared_ptr<std::atomic<bool>> flag;
  };
  own->hold(&one);
  own->take("cleanup", [used = std::make_shared<Used>(is_gone)] {}, &one);
  own.reset();
  EXPECT_FALSE(*is_gone);
}

}  // namespace mauve::testing::test_keeper
