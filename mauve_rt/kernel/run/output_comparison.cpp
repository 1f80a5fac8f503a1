// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/run/output_comparison.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace mauve {

OutputComparison::OutputComparison(const PortBase& port) {
  counts_.port = port.name();
  counts_.type = port.type();
  std::vector<std::string> paths;
  for (const MessageShape& message : port.messages()) paths = number_paths(message, kMostNumbers);
  counts_.is_truncated = paths.size() > kMostNumbers;
  if (counts_.is_truncated) paths.resize(kMostNumbers);
  for (const std::string& path : paths) {
    if (const auto place = port.find_number(path))
      numbers_.push_back({.place = *place, .sums = {.path = path}});
  }
}

void OutputComparison::add(std::uint64_t release, const void* live, const void* candidate) {
  if (live == nullptr || candidate == nullptr) {
    counts_.live_only += live != nullptr ? 1 : 0;
    counts_.shadow_only += candidate != nullptr ? 1 : 0;
    return;
  }
  ++counts_.both;
  for (Number& number : numbers_) {
    const double before = number.place.of(live);
    const double now = number.place.of(candidate);
    number.sums.nan += std::isnan(now) ? 1 : 0;
    number.sums.live_nan += std::isnan(before) ? 1 : 0;
    if (std::isnan(now) || std::isnan(before)) continue;
    const double difference = now == before ? 0.0 : now - before;  // two infinities are equal
    ++number.sums.count;
    number.sums.maximum = std::max(number.sums.maximum, std::abs(difference));
    number.squares += difference * difference;
  }
  if (numbers_.empty()) return;
  const Pair pair{.is_known = true,
                  .release = release,
                  .live = numbers_.front().place.of(live),
                  .candidate = numbers_.front().place.of(candidate)};
  if (!std::isfinite(pair.live) || !std::isfinite(pair.candidate)) return;
  pairs_[release % kLagSamples] = pair;
  last_ = release;
}

OutputDifference OutputComparison::difference() const {
  OutputDifference all = counts_;
  for (const Number& number : numbers_) {
    NumberDifference& shown = all.numbers.emplace_back(number.sums);
    if (shown.count != 0) shown.rms = std::sqrt(number.squares / static_cast<double>(shown.count));
  }
  all.lag = find_lag();
  return all;
}

const OutputComparison::Pair* OutputComparison::pair_of(std::uint64_t release) const {
  const Pair& pair = pairs_[release % kLagSamples];
  return pair.is_known && pair.release == release ? &pair : nullptr;
}

/// Of the live core's number `lag` releases before the candidate's, over the releases known of both; -1 to 1.
std::optional<double> OutputComparison::correlation(int lag) const {
  double count = 0.0;
  double sum_live = 0.0, sum_candidate = 0.0, live_squares = 0.0, candidate_squares = 0.0, products = 0.0;
  const std::uint64_t first = last_ < kLagSamples ? 0 : last_ - kLagSamples + 1;
  for (std::uint64_t release = first; release <= last_; ++release) {
    const Pair* candidate = pair_of(release);
    const Pair* live = pair_of(release - static_cast<std::uint64_t>(static_cast<std::int64_t>(lag)));
    if (candidate == nullptr || live == nullptr) continue;
    count += 1.0;
    sum_live += live->live;
    sum_candidate += candidate->candidate;
    live_squares += live->live * live->live;
    candidate_squares += candidate->candidate * candidate->candidate;
    products += live->live * candidate->candidate;
  }
  if (count < static_cast<double>(kFewestPairs)) return {};
  const double live_variance = live_squares - sum_live * sum_live / count;
  const double candidate_variance = candidate_squares - sum_candidate * sum_candidate / count;
  // What rounding leaves of a number that stands still.
  constexpr double kRounding = 1e-12;
  if (live_variance <= kRounding * live_squares || candidate_variance <= kRounding * candidate_squares)
    return {};
  const double together = products - sum_live * sum_candidate / count;
  return together / std::sqrt(live_variance * candidate_variance);
}

std::optional<int> OutputComparison::find_lag() const {
  constexpr double kClearlyMore = 1e-9;  // of equal ones the shortest lag
  std::optional<int> found;
  double largest = 0.0;  // what is not alike at all has no lag
  for (int distance = 0; distance <= kMostLag; ++distance) {
    for (const int lag : {distance, -distance}) {
      const std::optional<double> correlated = correlation(lag);
      if (!correlated || *correlated <= largest + kClearlyMore) continue;
      largest = *correlated;
      found = lag;
    }
  }
  return found;
}

}  // namespace mauve
