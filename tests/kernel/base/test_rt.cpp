// SPDX-License-Identifier: LGPL-3.0-or-later
#include <gtest/gtest.h>

#include <cstdlib>

#include "mauve_rt/base/rt.hpp"

namespace {

int twice(int value) MAUVE_RT { return 2 * value; }
static_assert(noexcept(twice(1)));

struct Counter {
  int calls{0};
  int count() { return ++calls; }
};

int trusting(Counter& counter) MAUVE_RT { return MAUVE_RT_TRUSTED(counter.count()) + 1; }

TEST(Rt, TrustedExpressionIsEvaluatedOnceAndHasItsValue) {
  Counter counter;
  EXPECT_EQ(twice(1), 2);
  EXPECT_EQ(trusting(counter), 2);
  EXPECT_EQ(counter.calls, 1);
}

#if defined(__clang__)
#if __has_feature(realtime_sanitizer)

void* allocate() { return std::malloc(1); }
void* lie() MAUVE_RT {
#pragma clang diagnostic ignored "-Wfunction-effects"
  return allocate();
}
void* lie_that_is_trusted() MAUVE_RT { return MAUVE_RT_TRUSTED(allocate()); }

TEST(Rt, SanitizerEndsWhoAllocates) {
  EXPECT_DEATH(std::free(lie()), "malloc");
  std::free(lie_that_is_trusted());
}

#endif
#endif

}  // namespace
