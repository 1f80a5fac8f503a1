// SPDX-License-Identifier: LGPL-3.0-or-later
// OutputComparison: how two cores' writes to one port differ, release by release.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "mauve_rt/data/number_place.hpp"
#include "mauve_rt/data/port_base.hpp"

namespace mauve {

/// One number of an output: the candidate's against the live core's, of the releases in which both wrote.
struct NumberDifference {
  std::string path{};
  std::int64_t count{0};     // releases in which both numbers were finite
  double maximum{0.0};       // of the absolute difference
  double rms{0.0};           // of the difference
  std::int64_t nan{0};       // releases in which the candidate's number was NaN
  std::int64_t live_nan{0};  // releases in which the live core's was
};

struct OutputDifference {
  std::string port{};
  std::string type{};
  std::int64_t both{0};       // releases in which both wrote
  std::int64_t live_only{0};  // releases in which the live core alone wrote
  std::int64_t shadow_only{0};
  bool is_truncated{false};  // the value has more numbers than are compared
  std::vector<NumberDifference> numbers{};
  /// By so many releases the candidate's first number comes later than the live core's, -8 to 8: where the correlation of the last
  /// 64 releases is largest. Nothing: too few releases, or one of the two numbers stands still.
  std::optional<int> lag{};
};

/// All functions [non-rt], one thread at a time.
class OutputComparison {
 public:
  static constexpr std::size_t kMostNumbers = 100;
  static constexpr std::size_t kLagSamples = 64;
  static constexpr int kMostLag = 8;
  /// With fewer pairs a correlation means nothing.
  static constexpr std::size_t kFewestPairs = 16;

  explicit OutputComparison(const PortBase& port);
  /// What the two wrote in the release of this number; nullptr: nothing.
  void add(std::uint64_t release, const void* live, const void* candidate);
  OutputDifference difference() const;

 private:
  struct Number {
    NumberPlace place;
    double squares{0.0};
    NumberDifference sums{};
  };
  struct Pair {
    bool is_known{false};
    std::uint64_t release{0};
    double live{0.0};
    double candidate{0.0};
  };

  const Pair* pair_of(std::uint64_t release) const;
  std::optional<double> correlation(int lag) const;
  std::optional<int> find_lag() const;

  OutputDifference counts_;
  std::vector<Number> numbers_;
  std::array<Pair, kLagSamples> pairs_{};  // of the first number, by release
  std::uint64_t last_{0};
};

}  // namespace mauve
