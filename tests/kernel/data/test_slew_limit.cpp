// SPDX-License-Identifier: LGPL-3.0-or-later
// A write port whose numbers move no faster than a SlewedOutput allows.
#include <cmath>
#include <random>

#include "fixtures.hpp"

namespace mauve::testing::test_slew_limit {

struct Axis {
  double torque{};
  std::int32_t count{};
  std::uint8_t small{};
  float angle{};
  bool on{};
};
struct Axes {
  std::array<Axis, 2> axes{};
  double other{};
};
struct Varying {
  double torque{};
  Sequence<double> list{};
};
struct Large {
  std::array<double, 512> values{};
};

}  // namespace mauve::testing::test_slew_limit

MAUVE_TYPE(mauve::testing::test_slew_limit::Axis, "test_msgs/msg/Axis", torque, count, small, angle, on)
MAUVE_TYPE(mauve::testing::test_slew_limit::Axes, "test_msgs/msg/Axes", axes, other)
MAUVE_TYPE(mauve::testing::test_slew_limit::Varying, "test_msgs/msg/Varying", torque, list)
MAUVE_TYPE(mauve::testing::test_slew_limit::Large, "test_msgs/msg/LargeValues", values)

namespace mauve::testing::test_slew_limit {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinite = std::numeric_limits<double>::infinity();

/// A port that is limited, and what a reader finds; its clock goes on in ms.
template <typename T>
class Limited {
 public:
  explicit Limited(const std::map<std::string, double>& max_slew)
      : output(std::make_shared<SlewedOutput>(max_slew)) {
    data.set_name("data");
    connect(port);
    port.limit_slew(output);
  }
  ~Limited() { port.disconnect(); }
  Limited(const Limited&) = delete;
  Limited& operator=(const Limited&) = delete;

  void connect(WritePort<T>& any) {
    any.set_context(&context_);
    any.connect(data.write, "data");
  }
  void at_ms(double ms) { context_.clock_ns.store(static_cast<time_ns_t>(ms * 1e6)); }
  T written() {
    auto value = std::make_unique<T>();
    time_ns_t time_ns = 0;
    ReaderState reader;
    data.read.read(*value, time_ns, reader);
    return *value;
  }
  const SlewedNumber& number(std::size_t at = 0) const { return output->numbers()[at]; }

  SharedData<T> data;
  std::shared_ptr<SlewedOutput> output;
  WritePort<T> port{"command"};

 private:
  Context context_;
};

/// "torque" of a message whose other fields are left alone.
class SlewLimits : public ::testing::Test {
 protected:
  double write(double ms, double torque) {
    axis.at_ms(ms);
    EXPECT_TRUE(axis.port.write({.torque = torque, .count = 7}));
    EXPECT_EQ(7, axis.written().count);
    return axis.written().torque;
  }
  Limited<Axis> axis{{{"torque", 20.0}}};
};

TEST_F(SlewLimits, TheFirstValueIsFree) {
  EXPECT_EQ(100.0, write(10, 100.0));
  EXPECT_EQ(0U, axis.number().limited);
}

TEST_F(SlewLimits, ANumberMovesByTheTimeSinceTheLastWrite) {
  write(0, 1.0);
  EXPECT_DOUBLE_EQ(1.2, write(10, 5.0));
  EXPECT_DOUBLE_EQ(1.0, write(20, -5.0));
  EXPECT_DOUBLE_EQ(1.0, write(20, 5.0)) << "no time has passed since the write before";
  EXPECT_EQ(3U, axis.number().limited);
  EXPECT_DOUBLE_EQ(1.1, write(30, 1.1)) << "that is slow enough";
  EXPECT_DOUBLE_EQ(5.0, write(1030, 5.0)) << "a second has passed";
  EXPECT_EQ(3U, axis.number().limited);
  EXPECT_DOUBLE_EQ(5.0, write(500, 9.0)) << "a clock that goes back is no time";
}

TEST_F(SlewLimits, WhatIsNoNumberIsNotWritten) {
  EXPECT_EQ(0.0, (axis.at_ms(0), axis.port.write({.torque = kNan, .count = 3}), axis.written().torque));
  EXPECT_EQ(0, axis.written().count) << "nothing was written before it: it is dropped";
  EXPECT_EQ(1U, axis.number().limited);
  write(10, 1.0);
  EXPECT_EQ(1.0, write(20, kNan));
  EXPECT_EQ(2U, axis.number().limited);
  EXPECT_DOUBLE_EQ(1.2, write(30, kInfinite));
  EXPECT_DOUBLE_EQ(1.0, write(40, -kInfinite));
  EXPECT_EQ(4U, axis.number().limited);
}

TEST_F(SlewLimits, AZeroIsApproachedAndThatOfAStopIsWrittenAtOnce) {
  write(0, 1.0);
  axis.at_ms(10);
  axis.port.write_zero();
  EXPECT_DOUBLE_EQ(0.8, axis.written().torque);
  EXPECT_TRUE(axis.port.ramps_down_at(ms_to_ns(20)));
  EXPECT_FALSE(axis.port.ramps_down_at(ms_to_ns(60)));
  EXPECT_EQ(0U, axis.number().not_limited);
  axis.port.write_stopped(ms_to_ns(20));
  EXPECT_EQ(0.0, axis.written().torque);
  EXPECT_EQ(1U, axis.number().not_limited);
  axis.port.write_stopped(ms_to_ns(30));
  EXPECT_EQ(1U, axis.number().not_limited) << "it was there";
  EXPECT_DOUBLE_EQ(0.2, write(40, 1.0)) << "from the value of the stop, at its time";
}

TEST_F(SlewLimits, AClosedPortIsMadeSafeAtOnceAndGoesOnFromThere) {
  write(0, 1.0);
  axis.port.close();
  EXPECT_TRUE(axis.port.make_safe(true, ms_to_ns(10)));
  EXPECT_EQ(0.0, axis.written().torque);
  EXPECT_EQ(1U, axis.number().not_limited);
  axis.port.reopen();
  EXPECT_DOUBLE_EQ(0.2, write(20, 1.0));
}

TEST_F(SlewLimits, AnotherPortGoesOnFromTheLastValue) {
  write(0, 1.0);
  axis.port.disconnect();
  WritePort<Axis> other{"command"};
  axis.connect(other);
  other.limit_slew(axis.output);
  axis.at_ms(10);
  other.write({.torque = -9.0});
  EXPECT_DOUBLE_EQ(0.8, axis.written().torque);
  other.disconnect();
}

TEST_F(SlewLimits, OfAnUnconnectedPortNothingIsWritten) {
  write(0, 1.0);
  axis.port.disconnect();
  axis.at_ms(10);
  EXPECT_TRUE(axis.port.write({.torque = 9.0}));
  EXPECT_EQ(0U, axis.number().limited);
  axis.connect(axis.port);
  EXPECT_DOUBLE_EQ(1.4, write(20, 9.0)) << "from the last value that was written";
}

TEST_F(SlewLimits, TheTimeOfAStopDoesNotCount) {
  write(0, 1.0);
  axis.port.resume_slew(ms_to_ns(990));
  EXPECT_DOUBLE_EQ(1.2, write(1000, 9.0));
}

TEST(SlewLimitOf, AnIntegerIsRoundedTowardItsLastValueAndComesThere) {
  Limited<Axis> axis{{{"count", 150.0}, {"small", 30.0}}};
  axis.port.write({.count = 10, .small = 250});
  std::vector<int> counts;
  std::vector<int> smalls;
  for (int step = 1; step <= 8; ++step) {
    axis.at_ms(10 * step);  // 1.5, and 0.3
    axis.port.write({.count = 100, .small = 0});
    counts.push_back(axis.written().count);
    smalls.push_back(axis.written().small);
  }
  EXPECT_THAT(counts, ::testing::ElementsAre(11, 12, 13, 14, 15, 16, 17, 18));
  EXPECT_THAT(smalls, ::testing::ElementsAre(250, 250, 250, 249, 249, 249, 249, 248))
      << "a step that is too small for it waits for the next ones";
}

TEST(SlewLimitOf, AnElementAndAFieldWithinLeaveTheOthersAlone) {
  Limited<Axes> axes{{{"axes[1].torque", 1000.0}}};
  Axes value;
  axes.port.write(value);
  axes.at_ms(1);
  value.axes[0].torque = value.axes[1].torque = value.other = 5.0;
  axes.port.write(value);
  EXPECT_EQ(5.0, axes.written().axes[0].torque);
  EXPECT_DOUBLE_EQ(1.0, axes.written().axes[1].torque);
  EXPECT_EQ(5.0, axes.written().other);
}

TEST(SlewLimitOf, ALargeValueIsLimitedInItsPlace) {
  Limited<Large> large{{{"values[511]", 1000.0}}};
  const auto fill = [](double number) { return [number](Large& value) { value.values[511] = number; }; };
  EXPECT_TRUE(large.port.write_with(fill(0.0)));
  large.at_ms(1);
  EXPECT_TRUE(large.port.write_with(fill(5.0)));
  EXPECT_DOUBLE_EQ(1.0, large.written().values[511]);
  large.at_ms(2);
  auto value = std::make_unique<Large>();
  value->values[511] = 5.0;
  EXPECT_TRUE(large.port.write(*value));
  EXPECT_DOUBLE_EQ(2.0, large.written().values[511]);
  EXPECT_EQ(2U, large.number().limited);
}

/// Random values at random times, of each kind of number: no step is longer than allowed, and what is wanted for long comes.
TEST(SlewLimitOf, NoStepIsLongerThanAllowed) {
  for (std::uint32_t seed = 1; seed <= 50; ++seed) {
    std::mt19937 random(seed);
    const auto below = [&](double most) { return std::uniform_real_distribution<double>(0, most)(random); };
    const double slew = std::pow(10.0, below(6.0) - 2.0);
    Limited<Axis> axis{{{"torque", slew}, {"count", slew}, {"angle", slew}}};
    double ms = 0;
    const double base = std::pow(10.0, below(8.0)) - 1;
    Axis last{
        .torque = base, .count = static_cast<std::int32_t>(base / 10), .angle = static_cast<float>(base)};
    axis.port.write(last);
    const Axis first = last;
    const auto moved = [](const Axis& from, const Axis& to) {  // in the order of the paths
      return std::array{std::abs(double{to.angle} - double{from.angle}),
                        std::abs(double(to.count) - double(from.count)), std::abs(to.torque - from.torque)};
    };
    for (int i = 0; i < 1'000; ++i) {
      ms += std::floor(below(3.0)) * 0.25;
      axis.at_ms(ms);
      std::array<double, 3> steps{};
      for (std::size_t at = 0; at < steps.size(); ++at)
        steps[at] =
            slew * (ms / 1e3 - static_cast<double>(axis.number(at).since_ns.load()) / 1e9) + 1e-12 * slew;
      const double wanted = base + (below(2.0) - 1.0) * std::pow(10.0, below(8.0));
      axis.port.write({.torque = below(20) < 1 ? kNan : wanted,
                       .count = static_cast<std::int32_t>(wanted / 10),
                       .angle = static_cast<float>(wanted)});
      const Axis now = axis.written();
      for (std::size_t at = 0; at < steps.size(); ++at) {
        ASSERT_LE(moved(last, now)[at], steps[at]) << "seed " << seed << ", write " << i << ", " << at;
        ASSERT_LE(moved(first, now)[at], slew * ms / 1e3 * (1 + 1e-12)) << "seed " << seed << ", " << at;
      }
      last = now;
    }
  }
}

/// What a refusal says of a component's setting.
template <typename T>
std::string refusal(const std::string& path, WritePort<T>& port) {
  try {
    port.limit_slew(std::make_shared<SlewedOutput>(std::map<std::string, double>{{path, 1.0}}));
  } catch (const Error& error) {
    EXPECT_EQ(ErrorCode::invalid_argument, error.code());
    return error.what();
  }
  ADD_FAILURE() << "it was not refused";
  return {};
}

TEST(SlewLimitOf, ANumberThatThereIsNotIsRefused) {
  WritePort<Axis> axis{"axis"};
  using ::testing::HasSubstr;
  EXPECT_THAT(refusal("speed", axis), HasSubstr("max_slew axis.speed"));
  EXPECT_THAT(refusal("on", axis), HasSubstr("the output has no such number")) << "a bool has no speed";
  WritePort<Varying> varying{"varying"};
  EXPECT_THAT(refusal("torque", varying), HasSubstr("cannot be copied in real time"));
  ReadPort<Axis> input{"input"};
  EXPECT_THROW(input.limit_slew(std::make_shared<SlewedOutput>(std::map<std::string, double>{})), Error);
}

}  // namespace mauve::testing::test_slew_limit
