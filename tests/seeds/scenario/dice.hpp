// SPDX-License-Identifier: LGPL-3.0-or-later
// Dice: random numbers of a scenario.
#pragma once

#include <cstdint>
#include <random>
#include <span>

#include "mauve_rt/base/time.hpp"

namespace mauve::testing {

/// Draws the same numbers from the same seed on every computer.
class Dice {
 public:
  explicit Dice(std::uint64_t seed) : random_(seed) {}
  int below(int bound) { return static_cast<int>(random_() % static_cast<std::uint64_t>(bound)); }
  bool once_in(int times) { return below(times) == 0; }
  time_ns_t between(time_ns_t least_ns, time_ns_t most_ns) {
    return least_ns + static_cast<time_ns_t>(random_() % static_cast<std::uint64_t>(most_ns - least_ns + 1));
  }
  template <typename Values>
  auto one_of(const Values& values) {
    return values[random_() % std::size(values)];
  }

 private:
  std::mt19937_64 random_;
};

}  // namespace mauve::testing
