// SPDX-License-Identifier: LGPL-3.0-or-later
// The list of conditions, and what their files share. A new kind: a file that defines NAME_kind(), and its line here.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "mauve_rt/base/error.hpp"
#include "mauve_rt/rules/condition.hpp"

// NOLINTNEXTLINE(cppcoreguidelines-macro-usage): one line a kind, that declares and lists it
#define MAUVE_CONDITION_KINDS(X) \
  X(silence)                     \
  X(value)                       \
  X(overruns)                    \
  X(late)                        \
  X(no_release)                  \
  X(fault)                       \
  X(over_declared)               \
  X(peer)                        \
  X(diagnostic)                  \
  X(boolean)                     \
  X(since_change)                \
  X(node_silent)

namespace mauve::rules {

// NOLINTNEXTLINE(cppcoreguidelines-macro-usage)
#define MAUVE_DECLARE_KIND(name) ConditionKind name##_kind();
MAUVE_CONDITION_KINDS(MAUVE_DECLARE_KIND)
#undef MAUVE_DECLARE_KIND

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// A parameter that there is, since the parameters are complete; a whole number where a real one is asked for. [setup]
template <typename T>
T told(const Parameters& parameters, const std::string& name) {
  const Parameter& parameter = parameters.at(name);
  if constexpr (std::is_same_v<T, double>) {
    if (const auto* whole = std::get_if<std::int64_t>(&parameter)) return static_cast<double>(*whole);
  }
  return std::get<T>(parameter);
}
inline bool is_told(const Parameters& parameters, const std::string& name) {
  return parameters.contains(name);
}
inline std::string text(const Parameters& parameters, const std::string& name) {
  return is_told(parameters, name) ? told<std::string>(parameters, name) : std::string();
}
inline time_ns_t nanoseconds(double seconds) {
  return seconds >= 1e-9 * static_cast<double>(kLongest) ? kLongest : std::llround(seconds * 1e9);
}

/// A topic or a resource, whichever is told: exactly one.
inline SignalSpec topic_or_resource(const Parameters& parameters, SignalKind of_topic, SignalKind of_resource,
                                    std::string detail = {}) {
  const std::string topic = text(parameters, "topic");
  const std::string resource = text(parameters, "resource");
  if (topic.empty() == resource.empty()) {
    throw Error(ErrorCode::invalid_argument, "a condition listens to one thing",
                {.element = "topic",
                 .expected = "a topic or a resource",
                 .found = topic.empty() ? "neither" : "both",
                 .remedy = "name one of them"});
  }
  return topic.empty() ? SignalSpec{of_resource, resource, std::move(detail)}
                       : SignalSpec{of_topic, topic, std::move(detail)};
}

inline const ParameterSpec kTopic{.name = "topic", .type = "topic"};
inline const ParameterSpec kMessageType{.name = "type", .type = "message_type"};
inline const ParameterSpec kResource{.name = "resource", .type = "resource"};
inline const ParameterSpec kComponent{.name = "component", .type = "component", .required = true};

/// Holds while nothing was told for longer than a time; before a first time, from arming on.
class Age final : public Condition {
 public:
  Age(Signal& signal, time_ns_t longer_than_ns) : signal_(signal), longer_than_ns_(longer_than_ns) {}
  void arm(time_ns_t now_ns) noexcept override;
  void assume() noexcept override;
  Look look(time_ns_t now_ns) noexcept override;

 private:
  Signal& signal_;
  const time_ns_t longer_than_ns_;
  time_ns_t armed_ns_{0};
  std::uint64_t armed_count_{0};
  bool assumed_{false};
  bool holds_{false};
  time_ns_t since_ns_{0};
};

/// Holds while the value told last is in a range, or outside of it; not before a first one.
class Range final : public Condition {
 public:
  /// It begins to hold outside [low, high], and ends within what is left of that without `hysteresis` on either side.
  Range(Signal& signal, double low, double high, double hysteresis = 0.0)
      : signal_(signal), low_(low), high_(high), hysteresis_(hysteresis) {}
  void arm(time_ns_t now_ns) noexcept override;
  Look look(time_ns_t now_ns) noexcept override;

 private:
  Signal& signal_;
  const double low_, high_, hysteresis_;
  bool holds_{false};
  time_ns_t since_ns_{0};
};

/// Holds while the value told last is this one.
class Equal final : public Condition {
 public:
  Equal(Signal& signal, double value) : signal_(signal), value_(value) {}
  void arm(time_ns_t now_ns) noexcept override;
  Look look(time_ns_t now_ns) noexcept override;

 private:
  Signal& signal_;
  const double value_;
  bool holds_{false};
  time_ns_t since_ns_{0};
};

/// Holds while a count has grown by so many within the last so long; what happened before arming does not count.
class Often final : public Condition {
 public:
  Often(Signal& signal, std::int64_t at_least, time_ns_t within_ns)
      : signal_(signal), within_ns_(within_ns), instants_(static_cast<std::size_t>(at_least), INT64_MIN) {}
  void arm(time_ns_t now_ns) noexcept override;
  Look look(time_ns_t now_ns) noexcept override;

 private:
  Signal& signal_;
  const time_ns_t within_ns_;
  std::vector<time_ns_t> instants_;  // of the last increments; a ring
  std::size_t next_{0};
  double counted_{0.0};
  bool holds_{false};
  time_ns_t since_ns_{0};
};

inline constexpr double kMostCounted = 1000;
/// The parameters of Often, and it. [setup]
std::vector<ParameterSpec> often_parameters(std::vector<ParameterSpec> more = {});
std::unique_ptr<Condition> make_often(const Parameters& parameters, std::span<Signal* const> signals);

}  // namespace mauve::rules
