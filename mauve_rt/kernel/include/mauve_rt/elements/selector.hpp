// SPDX-License-Identifier: LGPL-3.0-or-later
// What relay and multiplexers have in common: some inputs, one of which is passed to the output.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>

#include "mauve_rt/elements/latest_sample.hpp"
#include "mauve_rt/elements/update.hpp"

namespace mauve {

/// `output`, `only_new`, and `input_0` to `input_<N-1>`. One of
/// several inputs may be left unconnected: it has never a value.
template <Described T, std::size_t N>
struct SelectorShell : PeriodicShell {
  static_assert(N > 0);

  Property<bool>& only_new = property(
      "only_new", true,
      {.description = "write what is new; otherwise write in each period, which makes old data look young"});
  std::array<ReadPort<T>*, N> inputs = make_inputs();
  WritePort<T>& output = this->template write_port<T>("output");

 private:
  std::array<ReadPort<T>*, N> make_inputs() {
    std::array<ReadPort<T>*, N> made{};
    for (std::size_t i = 0; i < N; ++i) {
      made[i] = &this->template read_port<T>(N == 1 ? "input" : "input_" + std::to_string(i));
      if (N > 1) made[i]->make_optional();
    }
    return made;
  }
};

/// Reads all inputs in each period, asks choose() which one counts, and passes that one's value: when it is new
/// or newly chosen. When an input was passed and now none is to be, the type's default is written, once.
template <typename ShellType, Described T, std::size_t N>
class SelectorCore : public UpdateCore<ShellType> {
 public:
  /// [rt] as far as choose() is.
  void update() final {
    for (std::size_t i = 0; i < N; ++i) samples_[i].update(*this->shell().inputs[i]);
    pass(choose());
  }

  /// Replacing its own kind it goes on as that did; after another, what the output holds is nobody's.
  void take(CoreBase& old) noexcept override {
    const auto* other = dynamic_cast<const SelectorCore*>(&old);
    passed_ = other != nullptr ? other->passed_ : kUnknown;
  }

 protected:
  static constexpr int kNone = -1;

  /// The number of the input to pass, or kNone. [rt] as far as the core is.
  virtual int choose() const = 0;

  bool is_fresh(std::size_t input, std::int64_t max_age_ms) const noexcept {
    return samples_[input].is_fresh(this->clock_ns(), ms_to_ns(max_age_ms));
  }

  bool configure_hook() override {
    passed_ = kNone;
    samples_ = {};
    mark_ = TraceNames::intern("selected input");
    return true;
  }

 private:
  static constexpr int kUnknown = -2;

  void pass(int chosen) noexcept {
    const bool changed = chosen != passed_;
    if (changed && N > 1) trace_mark(mark_, chosen);
    passed_ = chosen;
    const bool every_period = !this->shell().only_new;
    if (chosen == kNone) {
      if (changed || every_period) this->shell().output.write(zero_);
    } else {
      const LatestSample<T>& sample = samples_[static_cast<std::size_t>(chosen)];
      if (changed || every_period || sample.is_new()) this->shell().output.write(sample.value());
    }
  }

  std::array<LatestSample<T>, N> samples_{};
  int passed_{kNone};
  std::uint32_t mark_{0};
  T zero_{};  // kept here: large types do not belong on a small stack
};

}  // namespace mauve
