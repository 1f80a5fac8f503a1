// SPDX-License-Identifier: LGPL-3.0-or-later
// Base class of elements that compute an output in each period: inputs that are too old end in the safe default.
#pragma once

#include "mauve_rt/elements/latest_sample.hpp"
#include "mauve_rt/elements/update.hpp"

namespace mauve {

/// Writes its output in each period while the inputs are usable. When the inputs no longer are, it writes the safe default, once, and
/// begins again with the next usable inputs.
template <typename ShellType>
class GuardedCore : public UpdateCore<ShellType> {
 public:
  /// [rt] as far as the functions below are.
  void update() final {
    if (read_inputs()) {
      write_output();
      is_default_ = false;
    } else if (!is_default_) {
      reset();
      write_default();
      is_default_ = true;
    }
  }
  /// The output holds what the old core wrote last.
  void take(CoreBase& /*old*/) noexcept override { is_default_ = false; }

 protected:
  /// Reads all inputs; whether each is fresh and a finite number. [rt]
  virtual bool read_inputs() = 0;
  /// Computes and writes. [rt]
  virtual void write_output() = 0;
  virtual void write_default() = 0;
  /// Forgets what write_output() keeps from one period to the next. [rt]
  virtual void reset() {}

  bool configure_hook() override {
    is_default_ = true;
    reset();
    return true;
  }
  template <Described T>
  bool is_fresh(const LatestSample<T>& sample, std::int64_t max_age_ms) const noexcept {
    return sample.is_fresh(this->clock_ns(), ms_to_ns(max_age_ms));
  }
  double period_s() const noexcept { return static_cast<double>(this->period_ns()) * 1e-9; }

 private:
  bool is_default_{true};  // or the port has written nothing yet
};

}  // namespace mauve
