// SPDX-License-Identifier: LGPL-3.0-or-later
// RevocableReference: who revokes takes away its own object only, and waits for its users.
#include "mauve_rt/base/revocable_reference.hpp"

#include "fixtures.hpp"

namespace mauve::testing::test_revocable_reference {

TEST(RevocableReference, ALaterObjectStaysWhereAnEarlierOneIsRevoked) {
  RevocableReference<int> reference;
  int first = 1;
  int second = 2;
  reference.set(first);
  reference.set(second);
  EXPECT_TRUE(reference.revoke(first, kForever));
  EXPECT_TRUE(reference.is(second));
  EXPECT_TRUE(reference.revoke(second, kForever));
  EXPECT_FALSE(reference.is_set());
}

/// One thread sets objects one after the other and uses them, another one revokes each: as the ends of probations.
TEST(RevocableReference, NoObjectIsUsedAfterItWasRevokedNorLost) {
  constexpr int kObjects = 5'000;
  RevocableReference<std::atomic<bool>> reference;
  std::vector<std::atomic<bool>> is_revoked(kObjects);
  std::atomic<int> newest{-1};
  int lost = 0;
  int used_late = 0;
  std::thread user([&] {
    for (int i = 0; i < kObjects; ++i) {
      auto& object = is_revoked[static_cast<std::size_t>(i)];
      reference.set(object);
      if (!reference.is(object)) ++lost;  // the other thread waits for `newest`
      newest.store(i);
      for (int turn = 0; turn < 3; ++turn)
        reference.use([&](std::atomic<bool>& used) { used_late += used.load() ? 1 : 0; });
    }
  });
  for (int i = 0; i < kObjects; ++i) {
    while (newest.load() < i) std::this_thread::yield();
    auto& object = is_revoked[static_cast<std::size_t>(i)];
    EXPECT_TRUE(reference.revoke(object, kForever));
    object = true;
  }
  user.join();
  EXPECT_EQ(0, lost);
  EXPECT_EQ(0, used_late);
  EXPECT_FALSE(reference.is_set());
}

}  // namespace mauve::testing::test_revocable_reference
