// SPDX-License-Identifier: LGPL-3.0-or-later
// Limiter and low-pass filter for messages of doubles, number by number.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "mauve_rt/data/message_shape.hpp"
#include "mauve_rt/elements/double_fields.hpp"
#include "mauve_rt/elements/guarded_core.hpp"

namespace mauve {

template <DoubleFields T>
struct NumberFilterShell : FilterShell<T> {
  Property<std::int64_t>& max_age_ms = this->property(
      "max_age_ms", 500,
      {.unit = "ms", .description = "older than this the default is written; 0: any age", .minimum = 0});
};

/// Reads one input of numbers; a successor of its kind goes on with the sample that it has.
template <typename ShellType, DoubleFields T>
class NumberFilterCore : public GuardedCore<ShellType> {
 public:
  void take(CoreBase& old) noexcept override {
    GuardedCore<ShellType>::take(old);
    if (const auto* other = dynamic_cast<const NumberFilterCore*>(&old)) input_ = other->input_;
  }

 protected:
  /// The next value of the output. [rt]
  virtual T compute(const T& input) = 0;

  bool read_inputs() final {
    input_.update(this->shell().input);
    return this->is_fresh(input_, this->shell().max_age_ms) && is_finite(input_.value());
  }
  void write_output() final { this->shell().output.write(compute(input_.value())); }
  void write_default() final { this->shell().output.write(default_); }
  bool configure_hook() override {
    input_ = {};
    return GuardedCore<ShellType>::configure_hook();
  }

 private:
  LatestSample<T> input_;
  T default_{};  // kept here, as SelectorCore's
};

/// `minimum`, `maximum` and `max_rate`, of a message with several fields once for each: linear_minimum ... for a Twist.
template <DoubleFields T>
struct LimiterShell : NumberFilterShell<T> {
  static constexpr std::size_t kFields = std::tuple_size_v<decltype(TypeTraits<T>::fields())>;
  struct Limits {
    Property<double>* minimum;
    Property<double>* maximum;
    Property<double>* max_rate;
  };
  std::array<Limits, kFields> limits = make_limits();

 private:
  std::array<Limits, kFields> make_limits() {
    std::array<Limits, kFields> made{};
    std::string_view names = TypeTraits<T>::field_names;
    for (Limits& of_field : made) {
      const std::string field(detail::next_name(names));
      const std::string prefix = kFields == 1 ? "" : field + "_";
      of_field = {
          .minimum = &this->property(prefix + "minimum", -1.0,
                                     {.description = "least number; it comes before a lower maximum"}),
          .maximum = &this->property(prefix + "maximum", 1.0, {.description = "greatest number"}),
          .max_rate = &this->property(
              prefix + "max_rate", 1.0,
              {.unit = "1/s", .description = "greatest change in a second; 0: any", .minimum = 0.0})};
    }
    return made;
  }
};

/// Keeps each number in its range and changes it no faster than `max_rate`, from the type's default on. A range that is set while
/// it runs is reached at that rate.
template <DoubleFields T>
class LimiterCore final : public NumberFilterCore<LimiterShell<T>, T> {
  MAUVE_STATE(output_)

 protected:
  T compute(const T& input) override {
    std::size_t field = 0;
    const auto limit = [&](auto member) {
      const auto& limits = this->shell().limits[field++];
      const double minimum = *limits.minimum;
      const double maximum = *limits.maximum;
      const double rate = *limits.max_rate;
      const double step = rate > 0.0 ? rate * this->period_s() : HUGE_VAL;
      for_each_double(
          [&](double& output, double number) {
            const double wanted = std::max(minimum, std::min(number, maximum));
            output = std::clamp(wanted, output - step, output + step);
          },
          output_.*member, input.*member);
    };
    std::apply([&](auto... member) { (limit(member), ...); }, TypeTraits<T>::fields());
    return output_;
  }
  void reset() override { output_ = {}; }

 private:
  T output_{};
};

template <DoubleFields T>
struct LowPassShell : NumberFilterShell<T> {
  Property<double>& time_constant_s = this->property(
      "time_constant_s", 0.1,
      {.unit = "s", .description = "time constant; 0: the output is the input", .minimum = 0.0});
};

/// First-order low-pass filter, exact for an input that is constant within a period. Begins at its first input.
template <DoubleFields T>
class LowPassCore final : public NumberFilterCore<LowPassShell<T>, T> {
  MAUVE_STATE(output_, is_running_)

 protected:
  T compute(const T& input) override {
    const double time_constant_s = this->shell().time_constant_s;
    const double kept =
        is_running_ && time_constant_s > 0.0 ? std::exp(-this->period_s() / time_constant_s) : 0.0;
    for_each_double([&](double& output, double number) { output = number + kept * (output - number); },
                    output_, input);
    is_running_ = true;
    return output_;
  }
  void reset() override { is_running_ = false; }

 private:
  T output_{};
  bool is_running_{false};
};

}  // namespace mauve
