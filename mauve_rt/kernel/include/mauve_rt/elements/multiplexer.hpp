// SPDX-License-Identifier: LGPL-3.0-or-later
// Multiplexers: several inputs, one output; the choice is made by a property, or by who speaks.
#pragma once

#include "mauve_rt/elements/selector.hpp"

namespace mauve {

template <Described T, std::size_t N>
struct MultiplexerShell : SelectorShell<T, N> {
  Property<std::int64_t>& select = this->property("select", 0,
                                                  {.unit = "1",
                                                   .description = "number of the input to pass",
                                                   .minimum = 0,
                                                   .maximum = static_cast<double>(N - 1)});
  Property<std::int64_t>& max_age_ms = this->property(
      "max_age_ms", 0,
      {.unit = "ms", .description = "older than this the default is written; 0: any age", .minimum = 0});
};

/// Passes input `select`, which can be set in flight. An input chosen without a value yet yields the type's
/// default, never what the one before left in the output:
///
///   using Shell = mauve::MultiplexerShell<Pose, 2>;
///   architecture.add_component<Shell, mauve::MultiplexerCore<Pose, 2>, mauve::PeriodicUpdateFsm<Shell>>("mux");
///   deployer.set_property("mux", "select", std::int64_t{1});
template <Described T, std::size_t N>
class MultiplexerCore final : public SelectorCore<MultiplexerShell<T, N>, T, N> {
 protected:
  int choose() const override {
    const auto input = static_cast<std::size_t>(this->shell().select.value());
    return this->is_fresh(input, this->shell().max_age_ms) ? static_cast<int>(input) : this->kNone;
  }
};

template <Described T, std::size_t N>
struct PriorityMultiplexerShell : SelectorShell<T, N> {
  std::array<Property<std::int64_t>*, N> max_age_ms = make_ages();

 private:
  std::array<Property<std::int64_t>*, N> make_ages() {
    std::array<Property<std::int64_t>*, N> made{};
    for (std::size_t i = 0; i < N; ++i) {
      made[i] = &this->property(
          "max_age_" + std::to_string(i) + "_ms", 500,
          {.unit = "ms", .description = "older than this it does not count; 0: any age", .minimum = 0});
    }
    return made;
  }
};

/// Passes the first input that is fresh enough, input_0 before all others: a person's joystick before the
/// autonomous driver, say. Each input has its own `max_age_<i>_ms`; when none is fresh, the type's default is
/// written. Every change of the choice is a mark "selected input" in the trace.
template <Described T, std::size_t N>
class PriorityMultiplexerCore final : public SelectorCore<PriorityMultiplexerShell<T, N>, T, N> {
 protected:
  int choose() const override {
    for (std::size_t i = 0; i < N; ++i) {
      if (this->is_fresh(i, *this->shell().max_age_ms[i])) return static_cast<int>(i);
    }
    return this->kNone;
  }
};

}  // namespace mauve
