// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/data/slew_limit.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "mauve_rt/base/contract.hpp"

namespace mauve {

namespace {

// Relaxed throughout: one thread at a time writes these figures, and what it reads it has by the hand-over.
constexpr auto kLone = std::memory_order_relaxed;

void add_one(Atomic<std::uint64_t>& count) noexcept { count.fetch_add(1, kLone); }

double step_of(const SlewedNumber& number, time_ns_t time_ns) noexcept {
  const time_ns_t passed_ns = std::max<time_ns_t>(0, time_ns - number.since_ns.load(kLone));
  return number.max_slew * (static_cast<double>(passed_ns) / 1e9);
}

void count_from(SlewedNumber& number, time_ns_t time_ns) noexcept {
  number.since_ns.store(std::max(number.since_ns.load(kLone), time_ns), kLone);
}

/// A step toward what is wanted, not longer than allowed whatever the rounding.
double moved(double last, double wanted, double step) noexcept {
  double next = last + std::copysign(step, wanted - last);
  if (std::abs(next - last) > step) next = std::nextafter(next, last);
  return std::isfinite(next) ? next : last;
}

}  // namespace

SlewedOutput::SlewedOutput(const std::map<std::string, double>& max_slew) {
  for (const auto& [path, per_second] : max_slew) {
    SlewedNumber& number = numbers_.emplace_back();
    number.path = path;
    number.max_slew = per_second;
  }
}

void SlewedOutput::continue_from(const SlewedOutput& other) noexcept {
  MAUVE_EXPECTS(numbers_.size() == other.numbers_.size());
  for (std::size_t i = 0; i < numbers_.size(); ++i) {
    numbers_[i].last.store(other.numbers_[i].last.load(kLone), kLone);
    numbers_[i].since_ns.store(other.numbers_[i].since_ns.load(kLone), kLone);
    numbers_[i].limited.store(other.numbers_[i].limited.load(kLone), kLone);
    numbers_[i].not_limited.store(other.numbers_[i].not_limited.load(kLone), kLone);
  }
  has_last_.store(other.has_last_.load(kLone), kLone);
  // acquire: as take_stop()
  stopped_ns_.store(other.stopped_ns_.load(std::memory_order_acquire), kLone);
}

SlewLimit::SlewLimit(std::shared_ptr<SlewedOutput> output, std::vector<NumberPlace> places, const void* zero)
    : output_(std::move(output)), places_(std::move(places)), zero_(zero) {}

/// What a stop has written is the last value from here on.
void SlewLimit::take_stop() noexcept {
  if (output_->stopped_ns_.load(kLone) == SlewedOutput::kNone) return;
  // acquire: a write that goes on from that value finds the port closed after it, and the value of the stop is written once more
  const time_ns_t stopped_ns = output_->stopped_ns_.exchange(SlewedOutput::kNone, std::memory_order_acq_rel);
  for (std::size_t i = 0; i < places_.size(); ++i) {
    output_->numbers_[i].last.store(places_[i].of(zero_), kLone);
    count_from(output_->numbers_[i], stopped_ns);
  }
  output_->has_last_.store(true, kLone);
}

bool SlewLimit::apply(void* value, time_ns_t time_ns) noexcept {
  take_stop();
  const bool has_last = output_->has_last_.load(kLone);
  for (std::size_t i = 0; i < places_.size(); ++i) {
    SlewedNumber& number = output_->numbers_[i];
    const NumberPlace& place = places_[i];
    const double wanted = place.of(value);
    number.next = wanted;
    number.is_limited = number.keeps_time = false;
    if (!has_last) {
      if (std::isfinite(wanted)) continue;
      add_one(number.limited);
      return false;
    }
    const double last = number.last.load(kLone);
    const double step = step_of(number, time_ns);
    if (std::isfinite(wanted) && std::abs(wanted - last) <= step) continue;
    number.is_limited = true;
    place.set(value, std::isnan(wanted) ? last : moved(last, wanted, step), last);
    number.next = place.of(value);
    number.keeps_time = !std::isnan(wanted) && number.next == last;
  }
  return true;
}

void SlewLimit::keep(time_ns_t time_ns) noexcept {
  for (SlewedNumber& number : output_->numbers_) {
    number.last.store(number.next, kLone);
    if (!number.keeps_time) count_from(number, time_ns);
    if (number.is_limited) add_one(number.limited);
  }
  output_->has_last_.store(true, kLone);
}

void SlewLimit::note_stop(time_ns_t time_ns) noexcept {
  if (output_->has_last_.load(kLone) && output_->stopped_ns_.load(kLone) == SlewedOutput::kNone) {
    for (std::size_t i = 0; i < places_.size(); ++i) {
      SlewedNumber& number = output_->numbers_[i];
      if (std::abs(places_[i].of(zero_) - number.last.load(kLone)) > step_of(number, time_ns))
        add_one(number.not_limited);
    }
  }
  output_->stopped_ns_.store(time_ns, std::memory_order_release);  // release: the port was closed before
}

bool SlewLimit::is_beyond(time_ns_t time_ns) noexcept {
  take_stop();
  if (!output_->has_last_.load(kLone)) return false;
  for (std::size_t i = 0; i < places_.size(); ++i) {
    const SlewedNumber& number = output_->numbers_[i];
    if (std::abs(places_[i].of(zero_) - number.last.load(kLone)) > step_of(number, time_ns)) return true;
  }
  return false;
}

void SlewLimit::resume(time_ns_t time_ns) noexcept {
  take_stop();
  for (SlewedNumber& number : output_->numbers_) count_from(number, time_ns);
}

}  // namespace mauve
