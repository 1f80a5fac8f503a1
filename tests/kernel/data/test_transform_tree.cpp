// SPDX-License-Identifier: LGPL-3.0-or-later
// TransformTree: frames, interpolation, refusals, and readers next to writers that never rest.
#include <cmath>
#include <limits>
#include <numbers>

#include "fixtures.hpp"

namespace mauve::testing::test_transform_tree {

using enum TransformOutcome;

Transform at(double x, double y = 0.0, double z = 0.0) { return {.translation = {.x = x, .y = y, .z = z}}; }
/// Turned about z.
Transform turned(double x, double angle) {
  return {.translation = {.x = x}, .rotation = {.z = std::sin(angle / 2), .w = std::cos(angle / 2)}};
}

class Frames : public ::testing::Test {
 protected:
  TransformOutcome set(std::string_view parent, std::string_view child, const Transform& transform,
                       time_ns_t time_ns, bool is_static = false) {
    return buffer.set(parent, child, transform, time_ns, is_static);
  }
  TransformLookup lookup(std::string_view target, std::string_view source, time_ns_t time_ns) {
    return buffer.lookup(buffer.find(target).value(), buffer.find(source).value(), time_ns);
  }

  TransformBuffer buffer{6, 4};
};

TEST_F(Frames, ALookupInterpolatesBetweenTwoTimes) {
  ASSERT_EQ(done, set("map", "base", turned(0.0, 0.0), 100));
  ASSERT_EQ(done, set("map", "base", turned(4.0, std::numbers::pi / 2), 200));
  const TransformLookup found = lookup("map", "base", 125);
  ASSERT_EQ(done, found.outcome);
  EXPECT_DOUBLE_EQ(1.0, found.transform.translation.x);
  EXPECT_NEAR(std::sin(std::numbers::pi / 16), found.transform.rotation.z, 1e-15);
  EXPECT_NEAR(std::cos(std::numbers::pi / 16), found.transform.rotation.w, 1e-15);
  EXPECT_EQ(4.0, lookup("map", "base", 200).transform.translation.x);
  EXPECT_EQ(0.0, lookup("map", "base", 100).transform.translation.x);
}

TEST_F(Frames, TheShorterArcIsTaken) {
  Transform opposite = turned(0.0, 0.2);
  for (double* number : {&opposite.rotation.z, &opposite.rotation.w}) *number = -*number;
  ASSERT_EQ(done, set("map", "base", turned(0.0, 0.0), 100));
  ASSERT_EQ(done, set("map", "base", opposite, 200));
  EXPECT_NEAR(std::sin(0.05), lookup("map", "base", 150).transform.rotation.z, 1e-15);
}

TEST_F(Frames, APathGoesUpAndDown) {
  ASSERT_EQ(done, set("map", "base", at(1.0), 100));
  ASSERT_EQ(done, set("base", "arm", at(10.0), 100));
  ASSERT_EQ(done, set("base", "camera", at(100.0), 0, true));
  EXPECT_EQ(-90.0, lookup("camera", "arm", 100).transform.translation.x);
  EXPECT_EQ(90.0, lookup("arm", "camera", 100).transform.translation.x);
  EXPECT_EQ(11.0, lookup("map", "arm", 100).transform.translation.x);
  EXPECT_EQ(-11.0, lookup("arm", "map", 100).transform.translation.x);
  EXPECT_EQ(0.0, lookup("arm", "arm", 100).transform.translation.x);
}

TEST_F(Frames, ZeroIsTheLatestCommonTime) {
  ASSERT_EQ(done, set("map", "base", at(1.0), 100));
  ASSERT_EQ(done, set("map", "base", at(2.0), 200));
  ASSERT_EQ(done, set("base", "arm", at(10.0), 50));
  ASSERT_EQ(done, set("base", "arm", at(20.0), 150));
  const TransformLookup found = lookup("map", "arm", kLatestCommon);
  ASSERT_EQ(done, found.outcome);
  EXPECT_EQ(150, found.time_ns);
  EXPECT_EQ(21.5, found.transform.translation.x);
}

TEST_F(Frames, AStaticTransformIsValidAtAnyTimeAndReplacesTheLast) {
  ASSERT_EQ(done, set("base", "camera", at(1.0), 0, true));
  EXPECT_EQ(1.0, lookup("base", "camera", 1'000'000).transform.translation.x);
  ASSERT_EQ(done, set("base", "camera", at(2.0), 0, true));
  EXPECT_EQ(2.0, lookup("base", "camera", 5).transform.translation.x);
  EXPECT_EQ(2.0, lookup("base", "camera", kLatestCommon).transform.translation.x);
}

TEST_F(Frames, OutsideTheIntervalTheFailureSaysTheInterval) {
  for (time_ns_t time = 1; time <= 6; ++time) ASSERT_EQ(done, set("map", "base", at(1.0), 100 * time));
  ASSERT_EQ(done, set("map", "other", at(1.0), 0, true));
  const TransformLookup early = lookup("other", "base", 299);
  EXPECT_EQ(before_interval, early.outcome);
  EXPECT_EQ(300, early.first_ns) << "a history of 4";
  EXPECT_EQ(600, early.last_ns);
  EXPECT_EQ("base", buffer.name(early.frame).view());
  EXPECT_EQ(after_interval, lookup("base", "other", 601).outcome);
  EXPECT_EQ(done, lookup("base", "other", 300).outcome);
  EXPECT_EQ(done, lookup("base", "other", 600).outcome);
}

TEST_F(Frames, WhatHasNoCommonAncestorIsNotConnected) {
  ASSERT_EQ(done, set("map", "base", at(1.0), 100));
  ASSERT_EQ(done, set("world", "moon", at(1.0), 100));
  EXPECT_EQ(not_connected, lookup("base", "moon", 100).outcome);
  EXPECT_EQ(std::nullopt, buffer.find("mars"));
  ASSERT_EQ(done, set("world", "map", at(1.0), 100));
  EXPECT_EQ(done, lookup("base", "moon", 100).outcome);
}

TEST_F(Frames, ARefusedSetChangesNothing) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  ASSERT_EQ(done, set("map", "base", at(1.0), 100));
  ASSERT_EQ(done, set("base", "arm", at(1.0), 100));
  EXPECT_EQ(bad_name, set("", "base", at(1.0), 200));
  EXPECT_EQ(bad_name, set("map", std::string(64, 'x'), at(1.0), 200));
  EXPECT_EQ(loop, set("map", "map", at(1.0), 200));
  EXPECT_EQ(loop, set("arm", "map", at(1.0), 200));
  EXPECT_EQ(second_parent, set("map", "arm", at(1.0), 200));
  EXPECT_EQ(second_parent, set("unknown", "arm", at(1.0), 200));
  EXPECT_EQ(static_differs, set("base", "arm", at(1.0), 200, true));
  EXPECT_EQ(not_finite, set("base", "arm", at(kNan), 200));
  EXPECT_EQ(bad_rotation, set("base", "arm", {.rotation = {.w = 0.9}}, 200));
  EXPECT_EQ(bad_rotation, set("base", "arm", {.rotation = {.w = 0.0}}, 200));
  EXPECT_EQ(not_newer, set("base", "arm", at(2.0), 100));
  EXPECT_EQ(3U, buffer.frames());
  EXPECT_EQ(100, lookup("map", "arm", kLatestCommon).time_ns);
  EXPECT_EQ(2.0, lookup("map", "arm", kLatestCommon).transform.translation.x);
}

TEST_F(Frames, AFullBufferTakesNoNewFrame) {
  for (const char* const child : {"1", "2", "3", "4", "5"}) ASSERT_EQ(done, set("map", child, at(1.0), 100));
  EXPECT_EQ(too_many_frames, set("map", "6", at(1.0), 100));
  EXPECT_EQ(std::nullopt, buffer.find("6"));
  EXPECT_EQ(done, set("map", "5", at(1.0), 200));
}

TEST_F(Frames, ARotationIsNormalised) {
  ASSERT_EQ(done, set("map", "base", {.rotation = {.w = 1.004}}, 100));
  EXPECT_EQ(1.0, lookup("map", "base", 100).transform.rotation.w);
}

TEST(Transforms, SizesAreBounded) {
  EXPECT_THROW(TransformBuffer(1, 10), Error);
  EXPECT_THROW(TransformBuffer(2, 1), Error);
  EXPECT_THROW(TransformBuffer(TransformBuffer::kMostFrames + 1, 10), Error);
}

TEST(Transforms, SetAndLookupAllocateNothing) {
  if (allocation_counting() == AllocationCounting::none)
    GTEST_SKIP() << "a sanitizer counts allocations itself";
  TransformTree tree;
  ThreadCounters counters;
  std::thread thread([&] {
    counters.attach();
    SetTransform::Response answer;
    LookupTransform::Response found;
    for (time_ns_t time = 1; time < 1000; ++time) {
      if (time == 2) counters.mark();
      tree.set.call({.parent = "map", .child = time % 2 == 0 ? "left" : "right", .time_ns = time}, answer);
      tree.lookup.call({.target = "left", .source = "right", .time_ns = time % 3 == 0 ? 0 : time - 1}, found);
    }
    counters.detach();
    EXPECT_EQ(done, found.result());
  });
  thread.join();
  EXPECT_EQ(0U, counters.allocations());
}

TEST(Transforms, AMessageGoesFromTreeToTree) {
  TransformTree from;
  TransformTree to;
  Notifier told;
  from.set_notifier(&told, nullptr);
  SetTransform::Response answer;
  const time_ns_t now = monotonic_now_ns();
  ASSERT_EQ(CallOutcome::answered,
            from.set.call({.parent = "map", .child = "base", .transform = at(1.0), .time_ns = now}, answer));
  from.set.call({.parent = "base", .child = "camera", .transform = at(10.0), .is_static = true}, answer);
  std::vector<std::byte> message;
  time_ns_t time = 0;
  ASSERT_TRUE(from.next_published(message, time));
  EXPECT_EQ(now, time);
  EXPECT_TRUE(to.write_sample(message, now));
  EXPECT_FALSE(from.next_published(message, time)) << "the static one has a topic of its own";
  ASSERT_TRUE(from.static_side()->next_published(message, time));
  EXPECT_TRUE(to.static_side()->write_sample(message, now));
  LookupTransform::Response found;
  to.lookup.call({.target = "map", .source = "camera"}, found);
  ASSERT_EQ(done, found.result());
  EXPECT_EQ(11.0, found.transform.translation.x);
  EXPECT_NEAR(static_cast<double>(now), static_cast<double>(found.time_ns), 1e9);

  from.set.call({.parent = "base", .child = "lidar", .transform = at(20.0), .is_static = true}, answer);
  ASSERT_TRUE(from.static_side()->next_published(message, time));
  TransformTree late;
  EXPECT_TRUE(late.static_side()->write_sample(message, now)) << "the last message has all static transforms";
  EXPECT_EQ(3U, late.buffer().frames());

  EXPECT_FALSE(to.write_sample(message, now));
  EXPECT_EQ("frame 'camera': static differs", to.why_refused(message));
  EXPECT_FALSE(to.write_sample(std::span(message).first(20), now));
}

TEST(Transforms, AnUnknownFrameIsNamed) {
  TransformTree tree;
  SetTransform::Response answer;
  tree.set.call({.parent = "map", .child = "base", .time_ns = 5}, answer);
  LookupTransform::Response found;
  tree.lookup.call({.target = "map", .source = "moon"}, found);
  EXPECT_EQ(unknown_frame, found.result());
  EXPECT_EQ("moon", found.frame.view());
  tree.lookup.call({.target = "map", .source = "base", .time_ns = 6}, found);
  EXPECT_EQ(after_interval, found.result());
  EXPECT_EQ("base", found.frame.view());
  EXPECT_EQ(5, found.first_ns);
}

/// A chain of frames whose transforms all have the number of their time: a lookup that mixes two of them shows it.
TEST(TransformStress, ReadersSeeWholeTransformsNextToAWriter) {
  constexpr int kReaders = 2;
  constexpr int kFound = 50'000;
  TransformBuffer buffer(16, 16);
  const auto numbered = [](time_ns_t time) {
    const auto number = static_cast<double>(time);
    return at(number, number, number);
  };
  const auto set = [&](time_ns_t time) {
    ASSERT_EQ(done, buffer.set("a", "b", numbered(time), time, false));
    ASSERT_EQ(done, buffer.set("b", "c", numbered(time), time, false));
  };
  set(1);
  std::atomic<bool> is_over{false};
  std::thread writer([&] {
    for (time_ns_t time = 2; !is_over; ++time) {
      set(time);
      if (time % 1000 == 0 && time <= 10'000) {
        ASSERT_EQ(done, buffer.set("a", "f" + std::to_string(time), numbered(time), time, false));
      }
    }
  });
  std::atomic<int> torn{0};
  std::vector<std::thread> readers;
  for (int reader = 0; reader < kReaders; ++reader) {
    readers.emplace_back([&] {
      const FrameId a = buffer.find("a").value();
      const FrameId c = buffer.find("c").value();
      time_ns_t last = 0;
      for (int i = 0, found_so_far = 0; found_so_far < kFound; ++i) {
        static_cast<void>(buffer.find("f2000"));
        const TransformLookup found = buffer.lookup(a, c, i % 2 == 0 ? kLatestCommon : last);
        if (found.outcome == before_interval || found.outcome == overtaken) continue;
        ++found_so_far;
        const auto& [x, y, z] = found.transform.translation;
        if (found.outcome != done || x != y || y != z || x != 2.0 * static_cast<double>(found.time_ns))
          ++torn;
        last = std::max(last, found.time_ns);
      }
    });
  }
  for (std::thread& reader : readers) reader.join();
  is_over = true;
  writer.join();
  EXPECT_EQ(0, torn.load());
}

}  // namespace mauve::testing::test_transform_tree
