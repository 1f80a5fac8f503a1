// SPDX-License-Identifier: LGPL-3.0-or-later
// What several kinds of condition are made of.
#include "conditions/kinds.hpp"

namespace mauve::rules {

namespace {

/// Until nothing came between the look and its being listened for.
template <typename Answer>
Look look_and_listen(Signal& signal, Answer&& answer) noexcept {
  for (;;) {
    const Signal::Last last = signal.last();
    double low = kInfinity;  // quiet is what lies between
    double high = -kInfinity;
    const Look look = answer(last, low, high);
    if (signal.listen(low, high, last)) return look;
  }
}

}  // namespace

void Age::arm(time_ns_t now_ns) noexcept {
  armed_ns_ = since_ns_ = now_ns;
  armed_count_ = signal_.last().count;
  assumed_ = holds_ = false;
}

void Age::assume() noexcept { assumed_ = true; }

Look Age::look(time_ns_t now_ns) noexcept {
  return look_and_listen(signal_, [&](const Signal::Last& last, double& low, double& high) noexcept {
    const bool is_heard = last.count != armed_count_;
    const time_ns_t from_ns = is_heard ? std::max(last.time_ns, armed_ns_) : armed_ns_;
    const time_ns_t due_ns = later_by(from_ns, longer_than_ns_);
    const bool holds = now_ns > due_ns || (assumed_ && !is_heard);
    if (holds != holds_) since_ns_ = std::max(since_ns_, holds ? std::min(now_ns, due_ns) : from_ns);
    holds_ = holds;
    if (!holds) std::swap(low, high);  // whatever comes, it is looked at when it is time
    return Look{.holds = holds,
                .since_ns = since_ns_,
                .next_ns = holds ? kForever : later_by(due_ns, 1),
                .measured = static_cast<double>(now_ns - from_ns) * 1e-9,
                .sample_ns = holds ? from_ns : since_ns_};
  });
}

void Range::arm(time_ns_t now_ns) noexcept {
  holds_ = false;
  since_ns_ = now_ns;
}

Look Range::look(time_ns_t /*now_ns*/) noexcept {
  return look_and_listen(signal_, [&](const Signal::Last& last, double& low, double& high) noexcept {
    if (last.count == 0) return Look{.since_ns = since_ns_};
    const double margin = holds_ ? hysteresis_ : 0.0;
    const bool holds = !(last.value >= low_ + margin && last.value <= high_ - margin);  // a NaN is nowhere
    if (holds != holds_) since_ns_ = std::max(since_ns_, last.time_ns);
    holds_ = holds;
    if (!holds) {
      low = low_;
      high = high_;
    } else if (last.value > high_ - hysteresis_) {
      low = std::nextafter(high_ - hysteresis_, kInfinity);
      high = kInfinity;
    } else if (last.value < low_ + hysteresis_) {
      low = -kInfinity;
      high = std::nextafter(low_ + hysteresis_, -kInfinity);
    }
    return Look{.holds = holds, .since_ns = since_ns_, .measured = last.value};
  });
}

void Equal::arm(time_ns_t now_ns) noexcept {
  holds_ = false;
  since_ns_ = now_ns;
}

Look Equal::look(time_ns_t /*now_ns*/) noexcept {
  return look_and_listen(signal_, [&](const Signal::Last& last, double& low, double& high) noexcept {
    const bool holds = last.count != 0 && last.value == value_;
    if (holds != holds_) since_ns_ = std::max(since_ns_, last.time_ns);
    holds_ = holds;
    if (last.count != 0) low = high = last.value;
    return Look{.holds = holds, .since_ns = since_ns_, .measured = last.value};
  });
}

void Often::arm(time_ns_t now_ns) noexcept {
  std::fill(instants_.begin(), instants_.end(), INT64_MIN);
  counted_ = signal_.last().value;
  holds_ = false;
  since_ns_ = now_ns;
}

Look Often::look(time_ns_t now_ns) noexcept {
  return look_and_listen(signal_, [&](const Signal::Last& last, double& low, double& high) noexcept {
    if (last.value < counted_) counted_ = 0.0;  // counted anew: the component is another one
    const auto grown =
        static_cast<std::size_t>(std::min(last.value - counted_, static_cast<double>(instants_.size())));
    counted_ = last.value;
    for (std::size_t i = 0; i < grown; ++i) {
      instants_[next_] = last.time_ns;  // the last of them is known; the others' were not later
      next_ = (next_ + 1) % instants_.size();
    }
    const time_ns_t oldest_ns = instants_[next_];
    const time_ns_t ends_ns = oldest_ns == INT64_MIN ? INT64_MIN : later_by(oldest_ns, within_ns_);
    const bool holds = now_ns < ends_ns;
    if (holds != holds_) since_ns_ = std::max(since_ns_, holds ? last.time_ns : ends_ns);
    holds_ = holds;
    low = high = last.value;
    return Look{
        .holds = holds, .since_ns = since_ns_, .next_ns = holds ? ends_ns : kForever, .measured = last.value};
  });
}

std::vector<ParameterSpec> often_parameters(std::vector<ParameterSpec> more) {
  std::vector<ParameterSpec> all{kComponent};
  for (ParameterSpec& each : more) all.push_back(std::move(each));
  all.push_back(
      {.name = "at_least", .type = "int", .minimum = 1, .maximum = kMostCounted, .initial = std::int64_t{1}});
  all.push_back({.name = "within_s", .type = "float", .unit = "s", .minimum = 1e-9, .initial = 1.0});
  return all;
}

std::unique_ptr<Condition> make_often(const Parameters& parameters, std::span<Signal* const> signals) {
  return std::make_unique<Often>(*signals[0], told<std::int64_t>(parameters, "at_least"),
                                 nanoseconds(told<double>(parameters, "within_s")));
}

}  // namespace mauve::rules
