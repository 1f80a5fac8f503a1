// SPDX-License-Identifier: LGPL-3.0-or-later
// What a core takes over from the one that it replaces: by name and type, also from another build.
#include "mauve_rt/parts/handover.hpp"

#include "fixtures.hpp"

namespace mauve::testing::test_handover {

struct Pose {
  double x{};
  double y{};
};
/// The same fields in another order.
struct TurnedPose {
  double y{};
  double x{};
};

}  // namespace mauve::testing::test_handover

MAUVE_TYPE(mauve::testing::test_handover::Pose, "handover_tests/Pose", x, y)
MAUVE_TYPE(mauve::testing::test_handover::TurnedPose, "handover_tests/Pose", x, y)

namespace mauve::testing::test_handover {

struct Old : Core<TestShell> {
  double integral_{0.5};
  std::int64_t rounds{7};
  float gain_{2.0F};
  std::array<double, 3> window{1.0, 2.0, 3.0};
  BoundedVector<std::int32_t, 4> codes;
  BoundedString<8> mode{"climb"};
  Pose pose{.x = 1.0, .y = 2.0};
  bool gone{true};
  MAUVE_STATE(integral_, this->rounds, gain_, window, codes, mode, pose, gone)
};

/// Of the same names, as another build has it.
struct New : Core<TestShell> {
  double integral_{0.0};
  std::int64_t rounds{0};
  double gain_{0.0};  // was a float
  std::array<double, 3> window{};
  BoundedVector<std::int32_t, 4> codes;
  BoundedString<8> mode;
  Pose pose;
  double fresh{9.0};
  const CoreBase* adopted_from{nullptr};
  bool has_seen_old{false};
  double integral_in_take{0.0};
  MAUVE_STATE(integral_, rounds, gain_, window, codes, mode, pose, fresh)

 public:
  bool adopt(const CoreBase& old) override {
    adopted_from = &old;
    has_seen_old = dynamic_cast<const Old*>(&old) != nullptr;
    return true;
  }
  void take(CoreBase& /*old*/) noexcept override { integral_in_take = integral_; }
};

struct Turned : Core<TestShell> {
  TurnedPose pose{.y = 8.0, .x = 9.0};
  MAUVE_STATE(pose)
};

TEST(Handover, CopiesTheFieldsOfTheSameNameAndType) {
  Old old;
  ASSERT_TRUE(old.codes.push_back(40));
  New fresh;
  Handover handover(old, fresh);
  EXPECT_EQ((std::vector<std::string>{"integral", "rounds", "window", "codes", "mode", "pose"}),
            handover.taken());
  EXPECT_EQ(
      (std::vector<std::string>{"gain: float32 before, float64 now", "fresh: the old core has no such field",
                                "gone: the new core has no such field"}),
      handover.left());
  old.integral_ = 1.5;  // it runs on until the change
  EXPECT_TRUE(handover.adopt());
  handover.take();
  EXPECT_EQ(1.5, fresh.integral_);
  EXPECT_EQ(1.5, fresh.integral_in_take) << "the fields are there before take";
  EXPECT_EQ(7, fresh.rounds);
  EXPECT_EQ(0.0, fresh.gain_);
  EXPECT_EQ(old.window, fresh.window);
  ASSERT_EQ(1U, fresh.codes.size());
  EXPECT_EQ(40, fresh.codes[0]);
  EXPECT_EQ("climb", fresh.mode.view());
  EXPECT_EQ(2.0, fresh.pose.y);
  EXPECT_EQ(9.0, fresh.fresh);
  EXPECT_TRUE(handover.is_whole());
}

TEST(Handover, ShowsACoreOfAnotherGenerationAsAStranger) {
  Old old;
  New fresh;
  Handover here(old, fresh);
  EXPECT_TRUE(here.adopt());
  EXPECT_TRUE(fresh.has_seen_old);
  fresh.set_generation(2);
  Handover handover(old, fresh);
  EXPECT_TRUE(handover.adopt());
  EXPECT_FALSE(fresh.has_seen_old) << "its layout may be another one";
  EXPECT_NE(&old, fresh.adopted_from);
  handover.take();
  EXPECT_EQ(0.5, fresh.integral_) << "what is named and typed is taken all the same";
  EXPECT_TRUE(handover.is_from(old));
}

TEST(Handover, TakesNoStructOfAnotherLayout) {
  Old old;
  Turned fresh;
  Handover handover(old, fresh);
  EXPECT_TRUE(handover.taken().empty());
  EXPECT_EQ(
      "pose: handover_tests/Pose{x: float64 at 0, y: float64 at 8} of 16 bytes before, "
      "handover_tests/Pose{x: float64 at 8, y: float64 at 0} of 16 bytes now",
      handover.left().front());
  handover.take();
  EXPECT_EQ(9.0, fresh.pose.x);
}

TEST(Handover, SaysThatTwoBuildsShareNothing) {
  TestCore old;
  TestCore fresh;
  EXPECT_TRUE(Handover(old, fresh).left().empty());
  fresh.set_generation(2);
  EXPECT_EQ("everything: the cores are of two builds, and neither declares state fields",
            Handover(old, fresh).left().at(0));
}

class HandoverOfComponents : public Deployed {};

TEST_F(HandoverOfComponents, IsInTheReportOfTheChange) {
  struct Counting : TestCore {
    std::int64_t count{0};
    MAUVE_STATE(count)
  };
  Component& component = add("c", 2);
  deploy();
  wait_runs(component, 1);
  EXPECT_TRUE(component.swap_core(std::make_unique<Counting>()).taken.empty());
  auto second = std::make_unique<Counting>();
  second->set_generation(2);
  const StepReport report = component.swap_core(std::move(second));
  EXPECT_EQ(std::vector<std::string>{"count"}, report.taken);
  EXPECT_TRUE(report.left.empty());
}

}  // namespace mauve::testing::test_handover
