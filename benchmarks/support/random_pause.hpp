// SPDX-License-Identifier: LGPL-3.0-or-later
// Pauses of random length, so that what follows falls on every phase.
#pragma once

#include <chrono>
#include <cstdint>
#include <random>
#include <thread>

namespace bench {

struct RangeUs {
  std::int64_t from;
  std::int64_t to;
};

/// Sleeps anything within the range.
class RandomPause {
 public:
  RandomPause(std::uint64_t seed, RangeUs range) : random_(seed), pause_us_(range.from, range.to) {}
  void operator()() { std::this_thread::sleep_for(std::chrono::microseconds(pause_us_(random_))); }

 private:
  std::mt19937_64 random_;
  std::uniform_int_distribution<std::int64_t> pause_us_;
};

}  // namespace bench
