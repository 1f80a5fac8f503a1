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
  X(link_silence)                \
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
  X(node_silent)                 \
  X(action)

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

/// Tells silence from an engine that stood still (a stall, a stopped process, a suspended machine): such an engine finds its
/// instant due and the reports waiting alike. Nothing is proven before the engine has looked for a while without a break,
/// but no longer than the silence is to be.
///
/// So the looks begin that long before the instant that counts: without a stall the proof costs no time.
class Calm {
 public:
  static constexpr time_ns_t kUsual =
      ms_to_ns(50);  // in which threads that were stopped with this one go on, too

  explicit Calm(time_ns_t longest_ns = kUsual) : longest_ns_(longest_ns) {}
  /// [rt]
  void arm(time_ns_t now_ns) MAUVE_RT {
    since_ns_ = looked_ns_ = now_ns;
    doubts_ = 0;
  }
  /// Once a look; `silence_ns`: how long it is to be. [rt]
  void look(time_ns_t now_ns, time_ns_t silence_ns) MAUVE_RT;
  /// Whether what was not reported by an instant that is over did not happen. `reported_ns`: up to when all of it was
  /// reported. Where breaks never end, doubts do. [rt]
  bool proves(time_ns_t due_ns, time_ns_t reported_ns) MAUVE_RT;
  /// When the silence until `due_ns` can be proven at the earliest, and when to look again for that. [rt]
  time_ns_t next_ns(time_ns_t due_ns) const MAUVE_RT {
    return looked_ns_ > due_ns ? looked_ns_ + step_ns() : later_by(due_ns, 1);
  }
  time_ns_t look_ns(time_ns_t due_ns) const MAUVE_RT {
    if (due_ns - looked_ns_ <= step_ns()) return kForever;
    return std::max(due_ns - calm_ns_ - step_ns(),
                    looked_ns_ + step_ns());  // a step more: who wakes up is late
  }

 private:
  static constexpr int kMostDoubts = 100;
  static constexpr time_ns_t kBreak = ms_to_ns(15);
  time_ns_t step_ns() const MAUVE_RT { return std::max<time_ns_t>(calm_ns_ / 10, 1); }
  time_ns_t break_ns() const MAUVE_RT {
    return std::max(kBreak, 3 * step_ns());
  }  // longer without a look is one

  const time_ns_t longest_ns_;
  time_ns_t calm_ns_{0};
  time_ns_t looked_ns_{0};
  time_ns_t since_ns_{0};    // it has looked without a break
  int doubts_{0};            // steps
  time_ns_t doubted_ns_{0};  // the last one
};

/// Holds while nothing was told for longer than a time; before a first time, from arming on.
class Age final : public Condition {
 public:
  Age(Signal& signal, time_ns_t longer_than_ns, time_ns_t calm_ns = Calm::kUsual)
      : signal_(signal), longer_than_ns_(longer_than_ns), calm_(calm_ns) {}
  void arm(time_ns_t now_ns) noexcept override;
  void assume() noexcept override;
  Look look(time_ns_t now_ns) noexcept override;

 private:
  Signal& signal_;
  const time_ns_t longer_than_ns_;
  Calm calm_;
  time_ns_t armed_ns_{0};
  std::uint64_t armed_count_{0};
  bool assumed_{false};
  bool holds_{false};
  time_ns_t since_ns_{0};
};

/// Which side of its bounds a signal is on; not known before a first value, nor while the first ones lie between the bounds.
/// Each look takes one crossing: a value that was beyond a bound between two looks makes one look of its own, and the next
/// look follows at once. Of many pulses between two looks one is seen.
class Side {
 public:
  /// [setup]
  Side(Signal& signal, Signal::Bounds inner, Signal::Bounds outer, bool begins_outside)
      : signal_(signal), begins_outside_(begins_outside), is_outside_(begins_outside) {
    signal_.count_crossings(inner, outer, begins_outside);
  }
  /// Only the crossing to where it is now counts of those that were before. [rt]
  void arm(time_ns_t now_ns) MAUVE_RT;
  /// Takes the next crossing; false: there is none. [rt]
  bool cross() MAUVE_RT;
  /// What was told last, after cross(): without a crossing it can show the side, too. [rt]
  void hear(const Signal::Last& last) MAUVE_RT;
  /// Whether there is another one to take. [rt]
  bool crosses_again() const MAUVE_RT { return newest() != seen_; }

  bool is_known() const MAUVE_RT { return is_known_; }
  bool is_outside() const MAUVE_RT { return is_outside_; }
  /// Whether it is outside (or, of a condition about the inside, inside). [rt]
  Truth truth(bool about_outside) const MAUVE_RT {
    return is_known_ ? truth_of(is_outside_ == about_outside) : Truth::unknown;
  }
  time_ns_t since_ns() const MAUVE_RT { return since_ns_; }
  double value() const MAUVE_RT { return value_; }  // of the last crossing that was taken

 private:
  std::uint64_t newest() const MAUVE_RT { return std::max(signal_.entered().count, signal_.left().count); }

  Signal& signal_;
  const bool begins_outside_;
  bool is_outside_;
  bool is_known_{false};
  std::uint64_t seen_{0};  // crossings
  time_ns_t since_ns_{0};
  double value_{0.0};
};

/// Holds while the value told last is outside a range.
class Range final : public Condition {
 public:
  /// It begins to hold outside [low, high], and ends within what is left of that without `hysteresis` on either side.
  Range(Signal& signal, double low, double high, double hysteresis = 0.0)
      : signal_(signal),
        low_(low),
        high_(high),
        hysteresis_(hysteresis),
        side_(signal, {.low = low + hysteresis, .high = high - hysteresis}, {.low = low, .high = high},
              false) {}
  void arm(time_ns_t now_ns) noexcept override { side_.arm(now_ns); }
  Look look(time_ns_t now_ns) noexcept override;

 private:
  Signal& signal_;
  const double low_, high_, hysteresis_;
  Side side_;
};

/// Holds while the value told last is this one.
class Equal final : public Condition {
 public:
  /// `no_news`: a value that says nothing.
  Equal(Signal& signal, double value, double no_news = std::numeric_limits<double>::quiet_NaN())
      : signal_(signal),
        no_news_(no_news),
        side_(signal, {.low = value, .high = value}, {.low = value, .high = value}, true) {}
  void arm(time_ns_t now_ns) noexcept override { side_.arm(now_ns); }
  Look look(time_ns_t now_ns) noexcept override;

 private:
  Signal& signal_;
  const double no_news_;
  Side side_;
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

/// What a part says of a component. That nothing happens is unknown while the component does not run.
class OfRunning final : public Condition {
 public:
  OfRunning(std::unique_ptr<Condition> part, Signal& state) : part_(std::move(part)), state_(state) {}
  void arm(time_ns_t now_ns) noexcept override;
  void assume() noexcept override { part_->assume(); }
  Look look(time_ns_t now_ns) noexcept override;

 private:
  const std::unique_ptr<Condition> part_;
  Signal& state_;
  bool runs_{false};
  time_ns_t since_ns_{0};  // it runs, or does not
};

/// What a condition hears of its component, and whether that runs; of_running() takes these signals. [setup]
std::vector<SignalSpec> heard_of_component(const Parameters& parameters, SignalKind kind,
                                           std::string detail = {});
std::unique_ptr<Condition> of_running(std::unique_ptr<Condition> part, std::span<Signal* const> signals);

inline constexpr double kMostCounted = 1000;
/// The parameters of Often, and it, for a component that runs. [setup]
std::vector<ParameterSpec> often_parameters(std::vector<ParameterSpec> more = {});
std::unique_ptr<Condition> make_often(const Parameters& parameters, std::span<Signal* const> signals);

}  // namespace mauve::rules
