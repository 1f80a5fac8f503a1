// SPDX-License-Identifier: LGPL-3.0-or-later
// Controller, limiter and low-pass filter in virtual time, held against their closed forms.
#include <cmath>
#include <limits>

#include "simulated.hpp"

namespace mauve::testing::test_elements_control {

using types::Float64;
using types::Twist;

constexpr double kPeriodS = 0.01;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kPrecision = 1e-12;

/// One element with a period of 10 ms, and a resource at each of its ports.
template <typename CoreType, Described T>
class ElementInVirtualTime : public Simulated {
 protected:
  using ShellType = typename CoreType::shell_type;

  void deploy_element(const std::vector<std::string>& inputs, const std::string& output,
                      const std::map<std::string, PropertyValue>& properties) {
    element_ = &architecture.add_component<ShellType, CoreType, PeriodicUpdateFsm<ShellType>>("element");
    for (const auto& [name, value] : properties) element_->set_property(name, value);
    for (const std::string& port : inputs) {
      inputs_.push_back(&architecture.add_resource<SharedData<T>>("in_" + port));
      architecture.connect("element", port, "in_" + port, "read");
    }
    output_ = &architecture.add_resource<SharedData<T>>("out");
    architecture.connect("element", output, "out", "write");
    deploy();
    run_to(0);  // the first release finds no input
  }
  void write(std::size_t input, const T& value) { inputs_[input]->write.write(value, simulation.now_ns()); }
  /// The output after so many more periods.
  T after(std::int64_t periods = 1) {
    simulation.run_until(simulation.now_ns() + periods * ms_to_ns(10));
    T value;
    time_ns_t time_ns = 0;
    output_->read.read(value, time_ns, seen_);
    return value;
  }
  /// How many values the element has written, as after() saw it.
  std::uint64_t written() const { return seen_.seen; }

  Component* element_{nullptr};

 private:
  std::vector<SharedData<T>*> inputs_;
  SharedData<T>* output_{nullptr};
  ReaderState seen_;
};

class PidElement : public ElementInVirtualTime<PidCore, Float64> {
 protected:
  void deploy_pid(double kp, double ki, double kd, std::map<std::string, PropertyValue> more = {}) {
    more.merge(std::map<std::string, PropertyValue>{{"kp", kp}, {"ki", ki}, {"kd", kd}});
    deploy_element({"set_point", "measured"}, "command", more);
  }
  void write_both(double set_point, double measured) {
    write(0, {set_point});
    write(1, {measured});
  }
};

TEST_F(PidElement, WeighsTheSetPointInTheProportionalPart) {
  deploy_pid(2.0, 0.0, 0.0, {{"set_point_weight", 0.5}});
  write_both(0.4, 0.05);
  EXPECT_NEAR(2.0 * (0.5 * 0.4 - 0.05), after().data, kPrecision);
}

TEST_F(PidElement, IntegratesTheErrorOverThePeriod) {
  deploy_pid(0.0, 0.5, 0.0);
  write_both(0.3, 0.1);
  for (int n = 1; n <= 5; ++n) EXPECT_NEAR(0.5 * 0.2 * n * kPeriodS, after().data, kPrecision);
}

TEST_F(PidElement, FiltersTheDerivativeOfTheMeasurement) {
  constexpr double kSlope = 0.3;
  constexpr double kFilterS = 0.05;
  deploy_pid(0.0, 0.0, 2.0, {{"derivative_filter_s", kFilterS}});
  write_both(100.0, 0.0);
  EXPECT_EQ(0.0, after().data);  // neither the first measurement nor a step of the set point is a change
  for (int n = 1; n <= 5; ++n) {
    write_both(-100.0 * n, kSlope * n * kPeriodS);
    const double rate = kSlope * (1.0 - std::pow(kFilterS / (kFilterS + kPeriodS), n));
    EXPECT_NEAR(-2.0 * rate, after().data, kPrecision);
  }
}

TEST_F(PidElement, LeavesALimitInThePeriodInWhichTheErrorChangesItsSign) {
  deploy_pid(0.0, 2.0, 0.0, {{"anti_windup_s", kPeriodS}, {"max_age_ms", std::int64_t{0}}});
  write_both(1.0, 0.0);
  EXPECT_EQ(1.0, after(1000).data);
  write_both(-1.0, 0.0);
  EXPECT_NEAR(1.0 - 2.0 * kPeriodS, after().data, kPrecision);
}

TEST_F(PidElement, FollowsALimitByTheTimeConstantOfItsAntiWindup) {
  constexpr double kAntiWindupS = 0.2;
  deploy_pid(0.0, 2.0, 0.0, {{"anti_windup_s", kAntiWindupS}, {"max_age_ms", std::int64_t{0}}});
  write_both(1.0, 0.0);
  EXPECT_EQ(1.0, after(1000).data);
  // ki e = excess / Tt: the integral has settled at 1 + ki e (Tt - h); the first period below the limit follows from the
  // recursion of the integral, I = 1 + (I - 1 - ki e h) (1 - h / Tt).
  double excess = 2.0 * (kAntiWindupS - kPeriodS);
  int periods = 0;
  for (; excess - 2.0 * kPeriodS > 0.0; ++periods)
    excess = (excess - 2.0 * kPeriodS) * (1.0 - kPeriodS / kAntiWindupS);
  write_both(-1.0, 0.0);
  ASSERT_GT(periods, 1);
  EXPECT_EQ(1.0, after(periods).data);
  EXPECT_NEAR(1.0 + excess - 2.0 * kPeriodS, after().data, 1e-6);
}

TEST_F(PidElement, AnotherGainChangesNothingOfTheIntegral) {
  deploy_pid(0.0, 0.5, 0.0, {{"max_age_ms", std::int64_t{0}}});
  write_both(0.2, 0.0);
  const double before = after(100).data;
  element_->set_property("ki", 5.0);
  const double with_the_new = after().data;
  EXPECT_NEAR(5.0 * 0.2 * kPeriodS, with_the_new - before, kPrecision);
}

TEST_F(PidElement, AnotherCoreGoesOnWithTheState) {
  deploy_pid(0.0, 0.5, 0.1, {{"derivative_filter_s", 0.05}, {"max_age_ms", std::int64_t{0}}});
  write_both(0.2, 0.0);
  after(100);
  write_both(0.2, 0.01);
  const double before = after().data;
  element_->swap_core(std::make_unique<PidCore>());
  const double rate = 0.01 / 0.06;
  const double expected = before + 0.5 * 0.19 * kPeriodS + 0.1 * (rate - rate * 0.05 / 0.06);
  EXPECT_NEAR(expected, after().data, kPrecision);
}

TEST_F(PidElement, EndsWithTheSafeCommandOnceWhereAnInputIsTooOld) {
  deploy_pid(0.0, 0.5, 0.0, {{"max_age_ms", std::int64_t{50}}});
  EXPECT_EQ(0U, (after(5), written()));
  write_both(0.2, 0.0);
  EXPECT_NEAR(5 * 0.5 * 0.2 * kPeriodS, after(5).data, kPrecision);
  EXPECT_EQ(5U, written());
  EXPECT_EQ(0.0, after(10).data);
  EXPECT_EQ(6U, written());
  write(1, {0.0});  // the old set point serves
  EXPECT_NEAR(0.5 * 0.2 * kPeriodS, after().data, kPrecision);
  element_->set_property("set_point_max_age_ms", std::int64_t{1});
  EXPECT_EQ(0.0, after().data);
}

TEST_F(PidElement, EndsWithTheSafeCommandWhereAnInputIsNoNumber) {
  deploy_pid(1.0, 0.5, 0.0);
  write_both(0.2, 0.0);
  EXPECT_NE(0.0, after().data);
  write(1, {kNan});
  EXPECT_EQ(0.0, after().data);
  write(1, {0.0});
  EXPECT_NEAR(0.2 + 0.5 * 0.2 * kPeriodS, after().data, kPrecision);
}

TEST_F(PidElement, ANewCoreAfterAnotherKindWritesTheSafeCommandWhereNothingIsMeasured) {
  struct Full : UpdateCore<PidShell> {
    void update() override { shell().output.write({1.0}); }
  };
  deploy_pid(1.0, 0.0, 0.0);
  element_->swap_core(std::make_unique<Full>());
  EXPECT_EQ(1.0, after().data);
  element_->swap_core(std::make_unique<PidCore>());
  EXPECT_EQ(0.0, after(3).data);
  EXPECT_EQ(2U, written());
}

using Limiter = ElementInVirtualTime<LimiterCore<Float64>, Float64>;

TEST_F(Limiter, ChangesAtItsRateUpToItsRange) {
  deploy_element({"input"}, "output", {{"maximum", 0.5}, {"minimum", -0.1}, {"max_rate", 10.0}});
  write(0, {3.0});
  for (int n = 1; n <= 8; ++n) EXPECT_NEAR(std::min(0.1 * n, 0.5), after().data, kPrecision);
  write(0, {-3.0});
  for (int n = 1; n <= 8; ++n) EXPECT_NEAR(std::max(0.5 - 0.1 * n, -0.1), after().data, kPrecision);
  element_->set_property("max_rate", 0.0);
  write(0, {3.0});
  EXPECT_EQ(0.5, after().data);
}

TEST_F(Limiter, WritesTheDefaultOnceWhereTheInputIsTooOldAndBeginsThere) {
  deploy_element({"input"}, "output", {{"max_rate", 10.0}, {"max_age_ms", std::int64_t{50}}});
  write(0, {0.5});
  EXPECT_NEAR(0.5, after(5).data, kPrecision);
  EXPECT_EQ(0.0, after(5).data);
  EXPECT_EQ(6U, written());
  write(0, {0.5});
  EXPECT_NEAR(0.1, after().data, kPrecision);
  write(0, {kNan});
  EXPECT_EQ(0.0, after().data);
}

TEST_F(Limiter, AnotherCoreGoesOnFromTheOutput) {
  deploy_element({"input"}, "output", {{"max_rate", 10.0}});
  write(0, {1.0});
  EXPECT_NEAR(0.3, after(3).data, kPrecision);
  element_->swap_core(std::make_unique<LimiterCore<Float64>>());
  EXPECT_NEAR(0.4, after().data, kPrecision);
}

using TwistLimiter = ElementInVirtualTime<LimiterCore<Twist>, Twist>;

TEST_F(TwistLimiter, HasLimitsForEachFieldOfTheMessage) {
  deploy_element({"input"}, "output",
                 {{"linear_max_rate", 10.0},
                  {"linear_maximum", 0.15},
                  {"angular_max_rate", 0.0},
                  {"angular_minimum", -0.5}});
  write(0, {.linear = {1.0, 0.02, -1.0}, .angular = {0.0, 0.7, -2.0}});
  Twist out = after();
  EXPECT_NEAR(0.1, out.linear.x, kPrecision);
  EXPECT_NEAR(0.02, out.linear.y, kPrecision);
  EXPECT_NEAR(-0.1, out.linear.z, kPrecision);
  EXPECT_EQ(0.7, out.angular.y);
  EXPECT_EQ(-0.5, out.angular.z);
  out = after();
  EXPECT_NEAR(0.15, out.linear.x, kPrecision);
  EXPECT_NEAR(-0.2, out.linear.z, kPrecision);
}

using LowPass = ElementInVirtualTime<LowPassCore<Float64>, Float64>;

TEST_F(LowPass, AnswersAStepByItsExponential) {
  constexpr double kTimeConstantS = 0.08;
  deploy_element({"input"}, "output", {{"time_constant_s", kTimeConstantS}});
  write(0, {2.0});
  EXPECT_EQ(2.0, after().data);  // begins at its first input
  write(0, {3.0});
  for (int n = 1; n <= 20; ++n)
    EXPECT_NEAR(3.0 - std::exp(-n * kPeriodS / kTimeConstantS), after().data, kPrecision);
  element_->swap_core(std::make_unique<LowPassCore<Float64>>());
  EXPECT_NEAR(3.0 - std::exp(-21 * kPeriodS / kTimeConstantS), after().data, kPrecision);
  element_->set_property("time_constant_s", 0.0);
  EXPECT_EQ(3.0, after().data);
  write(0, {kNan});
  EXPECT_EQ(0.0, after().data);
  write(0, {5.0});
  EXPECT_EQ(5.0, after().data);
}

using TwistLowPass = ElementInVirtualTime<LowPassCore<Twist>, Twist>;

TEST_F(TwistLowPass, FiltersEachNumber) {
  deploy_element({"input"}, "output", {{"time_constant_s", 0.1}});
  write(0, {});
  after();
  write(0, {.linear = {1.0, 2.0, 3.0}, .angular = {4.0, 5.0, 6.0}});
  const Twist out = after();
  const double part = 1.0 - std::exp(-0.1);
  const double numbers[] = {out.linear.x,  out.linear.y,  out.linear.z,
                            out.angular.x, out.angular.y, out.angular.z};
  for (int i = 0; i < 6; ++i) EXPECT_NEAR(part * (i + 1), numbers[i], kPrecision) << i;
}

static_assert(DoubleFields<types::Pose> && !DoubleFields<types::Int64> && !DoubleFields<types::Bool>);

}  // namespace mauve::testing::test_elements_control
