// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/base/log.hpp"

#include <algorithm>
#include <charconv>
#include <utility>

namespace mauve {

namespace {

constexpr unsigned kLevelStep = 10;  // from one level to the next

std::string number_text(double value, std::string_view spec) {
  std::array<char, 512> digits;  // 1e308 with 99 decimals
  if (spec.empty()) {
    const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr;
    return {digits.data(), end};
  }
  auto form = std::chars_format::general;
  if (spec.back() == 'f') form = std::chars_format::fixed;
  if (spec.back() == 'e') form = std::chars_format::scientific;
  int precision = 6;
  if (const std::size_t dot = spec.find('.'); dot != std::string_view::npos)
    std::from_chars(spec.data() + dot + 1, spec.data() + spec.size(), precision);
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value, form, precision).ptr;
  return {digits.data(), end};
}

template <typename Integer>
std::string integer_text(Integer value, std::string_view spec) {
  std::array<char, 24> digits;
  const auto end =
      std::to_chars(digits.data(), digits.data() + digits.size(), value, spec == ":x" ? 16 : 10).ptr;
  return {digits.data(), end};
}

/// Goes through the arguments of a line.
class Arguments {
 public:
  explicit Arguments(const LogLine& line) : line_(line) {}

  /// The next one by what stands in its place; nothing: there is no more.
  std::optional<std::string> next(std::string_view spec) {
    const LogArgument kind = number_ < line_.arguments.size() ? line_.arguments[number_] : LogArgument::none;
    if (kind == LogArgument::none) return {};
    ++number_;
    const std::uint64_t* const value = &line_.values[at_];
    switch (kind) {
      case LogArgument::boolean:
        ++at_;
        return *value != 0 ? "true" : "false";
      case LogArgument::integer:
        ++at_;
        return integer_text(static_cast<std::int64_t>(*value), spec);
      case LogArgument::unsigned_integer:
        ++at_;
        return integer_text(*value, spec);
      case LogArgument::number: {
        ++at_;
        double number = 0;
        std::memcpy(&number, value, sizeof number);
        return number_text(number, detail::is_log_place(spec, kind) ? spec : "");
      }
      default: {
        const auto* const bytes = reinterpret_cast<const unsigned char*>(value);
        at_ += bytes[0] / sizeof(std::uint64_t) + 1;
        return std::string(reinterpret_cast<const char*>(bytes) + 1, bytes[0]);
      }
    }
  }

 private:
  const LogLine& line_;
  std::size_t number_{0};
  std::size_t at_{0};
};

}  // namespace

constinit thread_local LogRing* detail::this_threads_log_ring = nullptr;

std::string_view to_string(LogLevel level) noexcept {
  return kLogLevels[static_cast<unsigned>(level) / kLevelStep - 1];
}

std::optional<LogLevel> find_log_level(std::string_view name) noexcept {
  for (unsigned place = 0; place < kLogLevels.size(); ++place) {
    if (kLogLevels[place] == name) return LogLevel{static_cast<std::uint8_t>((place + 1) * kLevelStep)};
  }
  return {};
}

std::string LogLine::text() const {
  Arguments rest(*this);
  const std::string_view all(format);
  std::string text;
  for (std::size_t at = 0; at < all.size(); ++at) {
    const bool is_brace = all[at] == '{' || all[at] == '}';
    if (is_brace && at + 1 < all.size() && all[at + 1] == all[at]) {
      text += all[++at];
      continue;
    }
    const std::size_t end = all[at] == '{' ? detail::log_place_end(all, at) : 0;
    if (all[at] != '{' || end > all.size()) {
      text += all[at];
      continue;
    }
    // Formats of Python are not checked before: a place without an argument stays as it is.
    text += rest.next(all.substr(at + 1, end - at - 2)).value_or(std::string(all.substr(at, end - at)));
    at = end - 1;
  }
  while (const auto more = rest.next("")) text += " " + *more;
  return text;
}

std::shared_ptr<LogRing> LogQueue::make_ring(std::uint16_t component) {
  auto ring = std::make_shared<LogRing>(component);
  const LockGuard lock(mutex_);
  rings_.push_back({.ring = ring, .dropped = 0});
  return ring;
}

void LogQueue::set_clock(const Clock* clock) {
  const LockGuard lock(mutex_);
  clock_ = clock;
  if (clock == nullptr) return;
  for (LogLine& line : waiting_) line.time_ns = clock->now_ns();
}

void LogQueue::add(LogLine line) {
  const LockGuard lock(mutex_);
  line.time_ns = clock_ != nullptr ? clock_->now_ns() : monotonic_now_ns();
  if (waiting_.size() < kMostWaiting) {
    waiting_.push_back(line);
  } else {
    ++dropped_;
  }
}

LogDrain LogQueue::drain() {
  const LockGuard lock(mutex_);
  LogDrain drain;
  std::vector<LogLine> lines;
  lines.swap(waiting_);
  if (dropped_ != 0) drain.lost.push_back({.component = LogLine::kNoComponent, .lines = dropped_});
  dropped_ = 0;
  std::erase_if(rings_, [&](Source& source) {
    const bool is_left = source.ring.use_count() == 1;  // before the look: nothing comes after it
    source.ring->drain(lines);
    if (const std::uint64_t more = source.ring->dropped() - source.dropped; more != 0) {
      drain.lost.push_back({.component = source.ring->component(), .lines = more});
      source.dropped += more;
    }
    return is_left;
  });
  // By number, too: lines of one instant stay in the order in which their thread wrote them.
  std::vector<std::pair<time_ns_t, std::size_t>> order;
  order.reserve(lines.size());
  for (std::size_t number = 0; number < lines.size(); ++number)
    order.emplace_back(lines[number].time_ns, number);
  std::ranges::sort(order);
  drain.lines.reserve(lines.size());
  for (const auto& [time_ns, number] : order) drain.lines.push_back(lines[number]);
  return drain;
}

void LogSource::add(LogLine& line) const {
  if (queue_ == nullptr) return;
  line.component = component_;
  line.source = name_;
  queue_->add(line);
}

}  // namespace mauve
