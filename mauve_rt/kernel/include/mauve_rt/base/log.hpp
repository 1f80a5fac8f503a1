// SPDX-License-Identifier: LGPL-3.0-or-later
// Log lines of parts: written into a ring of the component's thread, formatted by an ordinary thread later.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <memory>
#include <optional>
#include <source_location>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "mauve_rt/base/present_state.hpp"
#include "mauve_rt/base/record_ring.hpp"
#include "mauve_rt/base/seam/atomic.hpp"
#include "mauve_rt/base/seam/mutex.hpp"
#include "mauve_rt/base/time.hpp"

namespace mauve {

/// As in ROS.
enum class LogLevel : std::uint8_t { debug = 10, info = 20, warn = 30, error = 40, fatal = 50 };

inline constexpr std::array<std::string_view, 5> kLogLevels{"debug", "info", "warn", "error", "fatal"};

/// One of kLogLevels. [rt]
std::string_view to_string(LogLevel level) MAUVE_RT;
/// The level of that name; nothing: there is none. [rt]
std::optional<LogLevel> find_log_level(std::string_view name) MAUVE_RT;

/// What one argument of a log line is.
enum class LogArgument : std::uint8_t { none, boolean, integer, unsigned_integer, number, text };

namespace detail {

template <typename T>
consteval LogArgument log_argument() {
  using Value = std::remove_cvref_t<T>;
  if constexpr (std::is_same_v<Value, bool>) {
    return LogArgument::boolean;
  } else if constexpr (std::is_enum_v<Value>) {
    return std::is_signed_v<std::underlying_type_t<Value>> ? LogArgument::integer
                                                           : LogArgument::unsigned_integer;
  } else if constexpr (std::is_floating_point_v<Value>) {
    return LogArgument::number;
  } else if constexpr (std::is_integral_v<Value>) {
    return std::is_signed_v<Value> ? LogArgument::integer : LogArgument::unsigned_integer;
  } else {
    static_assert(std::is_convertible_v<const Value&, std::string_view>,
                  "an argument of a log line is a number, a bool, an enum or a text");
    return LogArgument::text;
  }
}

// Not constexpr: the compiler names the one that a bad format calls.
void a_log_format_has_as_many_places_as_arguments();
void a_brace_in_a_log_format_is_doubled_or_a_place();
void a_place_in_a_log_format_is_empty_or_has_a_precision_or_x();

/// The end of the place that begins behind the opening brace, after its closing brace.
constexpr std::size_t log_place_end(std::string_view text, std::size_t at) {
  while (at < text.size() && text[at] != '}') ++at;
  return at + 1;
}

/// "", ":.3", ":.3f", ":e", ":x": what stands between the braces. Width and alignment are not known here.
constexpr bool is_log_place(std::string_view spec, LogArgument argument) {
  if (spec.empty()) return true;
  if (spec.front() != ':') return false;
  spec.remove_prefix(1);
  const bool is_integer = argument == LogArgument::integer || argument == LogArgument::unsigned_integer;
  if (spec == "x") return is_integer;
  if (argument != LogArgument::number) return false;
  if (!spec.empty() && (spec.back() == 'f' || spec.back() == 'e' || spec.back() == 'g'))
    spec.remove_suffix(1);
  if (spec.empty()) return true;
  if (spec.front() != '.' || spec.size() < 2 || spec.size() > 3) return false;
  for (const char digit : spec.substr(1)) {
    if (digit < '0' || digit > '9') return false;
  }
  return true;
}

}  // namespace detail

/// A format, checked where it is compiled: text with a place for each argument, {} or {:.3f}; {{ and }} are braces.
template <typename... Args>
class LogFormat {
 public:
  /// The text is a literal; it stays for the life of the process.
  template <std::size_t kSize>
  consteval LogFormat(const char (&text)[kSize], std::source_location place = std::source_location::current())
      : text_(text), place_(place) {
    constexpr std::array<LogArgument, sizeof...(Args) + 1> kArguments{detail::log_argument<Args>()...,
                                                                      LogArgument::none};
    const std::string_view all(text, kSize - 1);
    std::size_t places = 0;
    for (std::size_t at = 0; at < all.size(); ++at) {
      if (all[at] != '{' && all[at] != '}') continue;
      if (at + 1 < all.size() && all[at + 1] == all[at]) {
        ++at;
        continue;
      }
      const std::size_t end = detail::log_place_end(all, at);
      if (all[at] == '}' || end > all.size()) detail::a_brace_in_a_log_format_is_doubled_or_a_place();
      if (places == sizeof...(Args)) detail::a_log_format_has_as_many_places_as_arguments();
      if (!detail::is_log_place(all.substr(at + 1, end - at - 2), kArguments[places]))
        detail::a_place_in_a_log_format_is_empty_or_has_a_precision_or_x();
      ++places;
      at = end - 1;
    }
    if (places != sizeof...(Args)) detail::a_log_format_has_as_many_places_as_arguments();
  }

  /// [rt]
  const char* text() const MAUVE_RT { return text_; }
  const std::source_location& place() const MAUVE_RT { return place_; }

 private:
  const char* text_;
  std::source_location place_;
};

/// One line as it waits to be formatted.
struct LogLine {
  static constexpr std::size_t kMostArguments = 8;
  static constexpr std::uint16_t kNoComponent = UINT16_MAX;

  time_ns_t time_ns{0};
  const char* format{""};
  std::source_location place{};
  std::uint32_t source{0};  // in TraceNames: the resource that wrote it, or "shadow"; 0: the component itself
  std::uint32_t state{0};   // in TraceNames: what the component was in; 0: on no thread of a component
  std::uint16_t component{kNoComponent};
  LogLevel level{LogLevel::info};
  std::uint8_t used{0};  // of `values`
  std::array<LogArgument, kMostArguments> arguments{};
  std::array<std::uint64_t, kMostArguments> values{};  // a text: its length, then its characters

  /// [rt]
  template <typename T>
    requires std::is_arithmetic_v<T> || std::is_enum_v<T>
  void add(std::size_t number, T value) MAUVE_RT {
    arguments[number] = detail::log_argument<T>();
    if constexpr (std::is_floating_point_v<T>) {
      const auto wide = static_cast<double>(value);
      std::memcpy(&values[used++], &wide, sizeof wide);
    } else {
      values[used++] = static_cast<std::uint64_t>(value);
    }
  }
  /// Takes at most so many places; what does not fit is cut. [rt]
  void add_text(std::size_t number, std::string_view text, std::size_t places) MAUVE_RT {
    arguments[number] = LogArgument::text;
    const std::size_t length = std::min(text.size(), places * sizeof(std::uint64_t) - 1);
    auto* const bytes = reinterpret_cast<unsigned char*>(&values[used]);
    bytes[0] = static_cast<unsigned char>(length);
    std::memcpy(bytes + 1, text.data(), length);
    used = static_cast<std::uint8_t>(used + length / sizeof(std::uint64_t) + 1);
  }

  /// The arguments in their places. [non-rt]
  std::string text() const;
};

/// The lines of one component's thread.
class LogRing {
 public:
  /// 14 KiB. At 1 kHz and a line a release, an eighth of a second.
  static constexpr std::size_t kCapacity = 128;

  /// [setup]
  explicit LogRing(std::uint16_t component, std::size_t capacity = kCapacity)
      : lines_(capacity), component_(component) {}
  /// While its thread does not run: the clock that lines are stamped by, nullptr for the monotonic one, and the state that they
  /// name. [setup]
  void set_up(const Clock* clock, const PresentState* state) noexcept {
    clock_ = clock;
    state_ = state;
  }

  /// The place of the next line, with its instant, component and state; nullptr: full, which is counted. [rt]
  LogLine* begin_line() MAUVE_RT {
    LogLine* const line = lines_.next_place();
    if (line == nullptr) [[unlikely]]
      return nullptr;
    line->time_ns = clock_ == nullptr ? monotonic_now_ns() : clock_->now_ns();
    line->component = component_;
    line->state = state_ == nullptr ? 0 : state_->name();
    line->used = 0;
    return line;
  }
  /// [rt]
  void end_line() MAUVE_RT { lines_.publish(); }

  /// [non-rt], one thread at a time.
  void drain(std::vector<LogLine>& into) { lines_.drain(into); }
  /// Lines that found no room. [rt]
  std::uint64_t dropped() const MAUVE_RT { return lines_.dropped(); }
  /// [rt]
  std::uint16_t component() const MAUVE_RT { return component_; }

  /// The ring of the calling thread, or nullptr where it is no component's. [rt]
  static LogRing* of_this_thread() MAUVE_RT;
  /// Called by the component's thread itself at its start. [setup]
  static void set_for_this_thread(LogRing* ring) noexcept;

 private:
  RecordRing<LogLine> lines_;
  std::uint16_t component_;
  const Clock* clock_{nullptr};
  const PresentState* state_{nullptr};
};

namespace detail {
/// Initial-exec: as this_threads_ring of trace.hpp.
extern constinit thread_local LogRing* this_threads_log_ring [[gnu::tls_model("initial-exec")]];
}  // namespace detail

/// As declared in the class. [rt]
inline LogRing* LogRing::of_this_thread() MAUVE_RT { return MAUVE_RT_TRUSTED(detail::this_threads_log_ring); }
/// As declared in the class. [setup]
inline void LogRing::set_for_this_thread(LogRing* ring) noexcept { detail::this_threads_log_ring = ring; }

/// What one look at an architecture's log yields.
struct LogDrain {
  /// Of one component, or of ordinary threads (kNoComponent): lines that found no room since the look before.
  struct Lost {
    std::uint16_t component{LogLine::kNoComponent};
    std::uint64_t lines{0};
  };

  std::vector<LogLine> lines;  // in the order of their instants
  std::vector<Lost> lost;
};

/// The lines of an architecture, from all threads.
///
/// | member          | written by       | read by | under  |
/// | --------------- | ---------------- | ------- | ------ |
/// | rings_ ... clock_ | ordinary threads | same    | mutex_ |
class LogQueue {
 public:
  /// Of lines of ordinary threads: what comes when so many wait is counted as lost.
  static constexpr std::size_t kMostWaiting = 1000;

  /// A ring for one component's thread: its last lines are taken after the component has let go of it. [setup]
  std::shared_ptr<LogRing> make_ring(std::uint16_t component);
  /// What ordinary threads' lines are stamped by: simulated time, also those that wait, which came before it began; nullptr:
  /// the monotonic clock. [non-rt]
  void set_clock(const Clock* clock);
  /// Adds a line of a thread that has no ring. [non-rt]
  void add(LogLine line);
  /// Takes what has come. [non-rt]
  LogDrain drain();

 private:
  struct Source {
    std::shared_ptr<LogRing> ring;
    std::uint64_t dropped;  // as reported
  };

  Mutex mutex_;
  std::vector<Source> rings_ MAUVE_GUARDED_BY(mutex_);
  std::vector<LogLine> waiting_ MAUVE_GUARDED_BY(mutex_);
  std::uint64_t dropped_ MAUVE_GUARDED_BY(mutex_){0};
  const Clock* clock_ MAUVE_GUARDED_BY(mutex_){nullptr};
};

/// Who writes lines: a component, a shadow of it, or a resource.
///
/// | member | written by | read by | order                                            |
/// | ------ | ---------- | ------- | ------------------------------------------------ |
/// | level_ | anyone     | anyone  | relaxed: a lone number, nothing is published by it |
/// | others | [setup]    | anyone  | -                                                |
class LogSource {
 public:
  /// `name`: in TraceNames, as of LogLine. [setup]
  void set_up(std::shared_ptr<LogQueue> queue, std::uint16_t component, std::uint32_t name) noexcept {
    queue_ = std::move(queue);
    component_ = component;
    name_ = name;
  }
  /// The level from which on its lines are kept; info at first. [rt]
  LogLevel level() const MAUVE_RT { return level_.load(std::memory_order_relaxed); }
  void set_level(LogLevel level) MAUVE_RT { level_.store(level, std::memory_order_relaxed); }
  /// [rt]
  std::uint32_t name() const MAUVE_RT { return name_; }
  std::uint16_t component() const MAUVE_RT { return component_; }
  const std::shared_ptr<LogQueue>& queue() const MAUVE_RT { return queue_; }
  /// From a thread without a ring. [non-rt]
  void add(LogLine& line) const;

 private:
  Atomic<LogLevel> level_{LogLevel::info};
  std::uint16_t component_{LogLine::kNoComponent};
  std::uint32_t name_{0};
  std::shared_ptr<LogQueue> queue_;
};

/// Writes lines of one source: log().warn("tracking error {:.3f} m", error). All functions [rt] on a component's thread: they
/// format nothing, allocate nothing and take no lock. Up to 8 arguments: numbers, bools, enums (as numbers) and texts. Texts share
/// the room that the others leave, 64 bytes in all, and what does not fit is cut. Elsewhere, as in a configure hook, it may wait
/// for a lock.
class Log {
 public:
  /// nullptr: a part that belongs to no architecture; its lines go nowhere.
  explicit Log(const LogSource* source) MAUVE_RT : source_(source) {}

  template <typename... Args>
  void debug(LogFormat<std::type_identity_t<Args>...> format, const Args&... arguments) const MAUVE_RT {
    write(LogLevel::debug, format, arguments...);
  }
  template <typename... Args>
  void info(LogFormat<std::type_identity_t<Args>...> format, const Args&... arguments) const MAUVE_RT {
    write(LogLevel::info, format, arguments...);
  }
  template <typename... Args>
  void warn(LogFormat<std::type_identity_t<Args>...> format, const Args&... arguments) const MAUVE_RT {
    write(LogLevel::warn, format, arguments...);
  }
  template <typename... Args>
  void error(LogFormat<std::type_identity_t<Args>...> format, const Args&... arguments) const MAUVE_RT {
    write(LogLevel::error, format, arguments...);
  }
  template <typename... Args>
  void fatal(LogFormat<std::type_identity_t<Args>...> format, const Args&... arguments) const MAUVE_RT {
    write(LogLevel::fatal, format, arguments...);
  }
  /// Whether a line of that level is kept: for arguments that cost something. [rt]
  bool is_on(LogLevel level) const MAUVE_RT { return source_ != nullptr && level >= source_->level(); }

  /// Writes a line that `fill` puts format and arguments into. [rt] as far as that is
  template <typename Fill>
  void write_line(LogLevel level, const Fill& fill) const {
    LogRing* const ring = LogRing::of_this_thread();
    if (ring == nullptr) [[unlikely]] {
      LogLine line;
      line.level = level;
      fill(line);
      return MAUVE_RT_TRUSTED(source_->add(line));  // an ordinary thread
    }
    LogLine* const line = ring->begin_line();
    if (line == nullptr) [[unlikely]]
      return;
    line->source = source_->name();
    line->level = level;
    fill(*line);
    ring->end_line();
  }

 private:
  template <typename... Args>
  void write(LogLevel level, const LogFormat<std::type_identity_t<Args>...>& format,
             const Args&... arguments) const MAUVE_RT {
    constexpr std::size_t kTexts = (0 + ... + (detail::log_argument<Args>() == LogArgument::text ? 1U : 0U));
    constexpr std::size_t kOthers = sizeof...(Args) - kTexts;
    static_assert(sizeof...(Args) <= LogLine::kMostArguments, "a log line has at most 8 arguments");
    constexpr std::size_t kPlaces =
        kTexts == 0 ? 0 : (LogLine::kMostArguments - kOthers) / kTexts;  // of each text
    if (!is_on(level)) return;
    const auto fill = [&](LogLine& line) MAUVE_RT {
      line.format = format.text();
      line.place = format.place();
      std::size_t number = 0;
      const auto add = [&](const auto& argument) MAUVE_RT {
        using Type = std::remove_cvref_t<decltype(argument)>;
        if constexpr (std::is_arithmetic_v<Type> || std::is_enum_v<Type>) {
          line.add(number++, argument);
        } else {
          line.add_text(number++, argument, kPlaces);
        }
      };
      (add(arguments), ...);
      if (number < LogLine::kMostArguments) line.arguments[number] = LogArgument::none;
    };
    MAUVE_RT_TRUSTED(write_line(level, fill));  // waits on ordinary threads only
  }

  const LogSource* source_;
};

}  // namespace mauve
