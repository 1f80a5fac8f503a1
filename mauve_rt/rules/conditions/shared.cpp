// SPDX-License-Identifier: LGPL-3.0-or-later
// What several kinds of condition are made of.
#include "mauve_rt/run/task.hpp"

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

void Calm::look(time_ns_t now_ns, time_ns_t silence_ns) noexcept {
  calm_ns_ = std::min(longest_ns_, silence_ns);
  if (now_ns - looked_ns_ > break_ns()) since_ns_ = now_ns;
  looked_ns_ = now_ns;
}

bool Calm::proves(time_ns_t due_ns, time_ns_t reported_ns) noexcept {
  const bool is_calm = looked_ns_ - since_ns_ >= calm_ns_ && later_by(reported_ns, break_ns()) > due_ns;
  if (is_calm || doubts_ == kMostDoubts) {
    doubts_ = 0;
    return true;
  }
  if (doubts_ == 0 || looked_ns_ - doubted_ns_ >= step_ns()) {  // others may look more often
    ++doubts_;
    doubted_ns_ = looked_ns_;
  }
  return false;
}

void Age::arm(time_ns_t now_ns) noexcept {
  armed_ns_ = since_ns_ = now_ns;
  armed_count_ = signal_.last().count;
  assumed_ = holds_ = false;
  calm_.arm(now_ns);
}

void Age::assume() noexcept { assumed_ = true; }

Look Age::look(time_ns_t now_ns) noexcept {
  const bool held = holds_;
  calm_.look(now_ns, longer_than_ns_);
  const time_ns_t reported_ns = signal_.reported_until();  // before the last report is looked at
  return look_and_listen(signal_, [&](const Signal::Last& last, double& low, double& high) noexcept {
    const bool is_heard = last.count != armed_count_;
    const time_ns_t from_ns = is_heard ? std::max(last.time_ns, armed_ns_) : armed_ns_;
    const time_ns_t due_ns = later_by(from_ns, longer_than_ns_);
    const bool is_assumed = assumed_ && !is_heard;
    const bool holds = is_assumed || (now_ns > due_ns && (held || calm_.proves(due_ns, reported_ns)));
    if (holds != holds_) since_ns_ = std::max(since_ns_, holds ? std::min(now_ns, due_ns) : from_ns);
    holds_ = holds;
    if (!holds) std::swap(low, high);  // whatever comes, it is looked at when it is time
    return Look{.truth = truth_of(holds),
                .since_ns = since_ns_,
                .next_ns = holds ? kForever : calm_.next_ns(due_ns),
                .look_ns = holds ? kForever : calm_.look_ns(due_ns),
                .measured = static_cast<double>(now_ns - from_ns) * 1e-9,
                .sample_ns = holds ? from_ns : since_ns_};
  });
}

void Side::arm(time_ns_t now_ns) noexcept {
  seen_ = newest();
  is_known_ = is_known_ || seen_ != 0;
  is_outside_ = begins_outside_;
  if (seen_ % 2 != 0) --seen_;  // it is on the other side now
  since_ns_ = now_ns;
  value_ = signal_.last().value;
}

bool Side::cross() noexcept {
  const Signal::Last entered = signal_.entered();
  const Signal::Last left = signal_.left();
  const std::uint64_t unseen = std::max(entered.count, left.count) - seen_;
  if (unseen == 0) return false;
  if (unseen > 3) seen_ += (unseen - 2) / 2 * 2;  // two or three are left: one pulse, and where it is now
  ++seen_;
  is_outside_ = !is_outside_;
  const Signal::Last& here = is_outside_ ? left : entered;
  const Signal::Last& there = is_outside_ ? entered : left;
  // Of the first of three crossings only that it was before the second is known.
  const time_ns_t time_ns = here.count == seen_ ? here.time_ns : std::min(here.time_ns, there.time_ns);
  since_ns_ = std::max(since_ns_, time_ns);
  value_ = here.value;
  is_known_ = true;
  return true;
}

void Side::hear(const Signal::Last& last) noexcept {
  if (is_known_ || last.count == 0) return;
  is_known_ = signal_.crosses(last.value, !begins_outside_);  // it would, if it came from the other side
  if (is_known_) since_ns_ = std::max(since_ns_, last.time_ns);
}

Look Range::look(time_ns_t now_ns) noexcept {
  bool crossed = false;
  return look_and_listen(signal_, [&](const Signal::Last& last, double& low, double& high) noexcept {
    crossed = crossed || side_.cross();
    side_.hear(last);
    const bool again = side_.crosses_again();
    if (!side_.is_known()) {
      // Every value is of interest.
    } else if (!side_.is_outside()) {
      low = low_;
      high = high_;
    } else if (last.value > high_ - hysteresis_) {
      low = std::nextafter(high_ - hysteresis_, kInfinity);
      high = kInfinity;
    } else if (last.value < low_ + hysteresis_) {
      low = -kInfinity;
      high = std::nextafter(low_ + hysteresis_, -kInfinity);
    }
    return Look{.truth = side_.truth(true),
                .since_ns = side_.since_ns(),
                .next_ns = again ? later_by(now_ns, 1) : kForever,
                .measured = again ? side_.value() : last.value};
  });
}

Look Equal::look(time_ns_t now_ns) noexcept {
  bool crossed = false;
  return look_and_listen(signal_, [&](const Signal::Last& last, double& low, double& high) noexcept {
    crossed = crossed || side_.cross();
    if (last.value != no_news_) side_.hear(last);
    const bool again = side_.crosses_again();
    if (last.count != 0) low = high = last.value;
    return Look{.truth = side_.truth(false),
                .since_ns = side_.since_ns(),
                .next_ns = again ? later_by(now_ns, 1) : kForever,
                .measured = again ? side_.value() : last.value};
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
    return Look{.truth = truth_of(holds),
                .since_ns = since_ns_,
                .next_ns = holds ? ends_ns : kForever,
                .measured = last.value};
  });
}

void OfRunning::arm(time_ns_t now_ns) noexcept {
  part_->arm(now_ns);
  since_ns_ = now_ns;
}

Look OfRunning::look(time_ns_t now_ns) noexcept {
  look_and_listen(state_, [&](const Signal::Last& last, double& low, double& high) noexcept {
    if (last.count == 0) return Look{};
    low = high = last.value;
    const auto state = static_cast<ComponentState>(last.value);
    const bool runs = state == ComponentState::running || state == ComponentState::stopping;
    if (runs != std::exchange(runs_, runs)) since_ns_ = std::max(since_ns_, last.time_ns);
    return Look{};
  });
  Look look = part_->look(now_ns);
  if (look.truth != Truth::no) return look;
  if (!runs_) look.truth = Truth::unknown;
  look.since_ns = std::max(look.since_ns, since_ns_);
  return look;
}

std::vector<SignalSpec> heard_of_component(const Parameters& parameters, SignalKind kind,
                                           std::string detail) {
  const std::string component = text(parameters, "component");
  return {{kind, component, std::move(detail)}, {SignalKind::state, component}};
}

std::unique_ptr<Condition> of_running(std::unique_ptr<Condition> part, std::span<Signal* const> signals) {
  return std::make_unique<OfRunning>(std::move(part), *signals[1]);
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
  return of_running(std::make_unique<Often>(*signals[0], told<std::int64_t>(parameters, "at_least"),
                                            nanoseconds(told<double>(parameters, "within_s"))),
                    signals);
}

}  // namespace mauve::rules
