// SPDX-License-Identifier: LGPL-3.0-or-later
// TaskSettings: how a component is run; and the one table that says what each setting may be.
#pragma once

#include <sched.h>

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <variant>
#include <vector>

#include "mauve_rt/base/log.hpp"
#include "mauve_rt/base/time.hpp"
#include "mauve_rt/parts/declared_state.hpp"
#include "mauve_rt/parts/slewed_outputs.hpp"

namespace mauve {

/// What to do when an instant has passed before its wait is entered.
enum class OverrunPolicy : std::uint8_t {
  skip,      // go on at the next instant of the grid
  catch_up,  // go on at once, owing at most max_backlog instants
  fault,
};
inline constexpr std::array<std::string_view, 3> kOverrunPolicies{"skip", "catch_up", "fault"};

struct TaskSettings {
  int priority{50};         // SCHED_FIFO; 99 is kept for the watchdog
  std::vector<int> cpus{};  // empty: any
  time_ns_t offset_ns{0};   // instants are epoch + offset + k * period
  time_ns_t period_ns{0};   // 0: the gcd of the FSM's cycles
  OverrunPolicy overrun{OverrunPolicy::skip};
  std::int64_t max_backlog{10};
  std::size_t stack_bytes{std::size_t{512} * 1024};  // prefaulted whole: it is held in memory
  std::size_t trace_records{0};  // room in the trace's ring until it is drained; 0: by the period
  time_ns_t hung_after_ns{0};    // a state that lasts longer is told as hung; 0: 10 periods, 1 s at least
  time_ns_t deadline_ns{0};      // from a release to the next wait, for the analysis; 0: the next instant
  LogLevel log_level{LogLevel::info};  // its log lines below are not kept; what it begins with
  bool enforce_wcet{false};  // wcet_ns of an execution state is a budget of CPU time; a fault above it
  std::vector<DeclaredState> states{};  // of the fsm's execution states
  MaxSlew max_slew{};  // "command.torque": greatest change per second of a number of an output
  bool operator==(const TaskSettings&) const = default;
};

/// The value of a setting as files and Python have it: a number, numbers, a word, or yes or no.
using SettingValue = std::variant<std::int64_t, std::vector<int>, std::string, bool>;

/// One of them, for all who look at a setting without knowing which it is.
struct TaskSetting {
  std::string_view name;
  std::int64_t least{0};                        // of the number, or of each of the numbers;
  std::int64_t most{0};                         // a default outside, or no number, is the kernel's own choice
  std::span<const std::string_view> choices{};  // of a word
  std::string_view hint{};                      // for who sets it wrongly
  SettingValue (*get)(const TaskSettings&);
  void (*assign)(TaskSettings&, const SettingValue&);  // one that was checked
};

/// One whose value is a number. [non-rt]
template <auto Member>
constexpr TaskSetting number_setting(std::string_view name, std::int64_t least, std::int64_t most,
                                     std::string_view hint) {
  return {
      .name = name,
      .least = least,
      .most = most,
      .hint = hint,
      .get = [](const TaskSettings& all) -> SettingValue { return static_cast<std::int64_t>(all.*Member); },
      .assign =
          [](TaskSettings& all, const SettingValue& value) {
            using Number = std::remove_reference_t<decltype(all.*Member)>;
            all.*Member = static_cast<Number>(std::get<std::int64_t>(value));
          }};
}

/// The table: what is added to TaskSettings gets a line here, unless it is of each state or of each output.
inline constexpr std::array kTaskSettings{
    number_setting<&TaskSettings::priority>("priority", 1, 98,
                                            "1 is the lowest, 98 the highest; 99 is kept for the watchdog"),
    TaskSetting{.name = "cpus",
                .least = 0,
                .most = CPU_SETSIZE - 1,
                .hint = "leave the key out to allow every CPU",
                .get = [](const TaskSettings& all) -> SettingValue { return all.cpus; },
                .assign = [](TaskSettings& all,
                             const SettingValue& value) { all.cpus = std::get<std::vector<int>>(value); }},
    number_setting<&TaskSettings::offset_ns>("offset_ns", 0, kLongest,
                                             "it is the time from the epoch to the first instant"),
    number_setting<&TaskSettings::period_ns>("period_ns", 0, INT64_MAX, "0: as the FSM says"),
    TaskSetting{.name = "overrun",
                .choices = kOverrunPolicies,
                .get = [](const TaskSettings& all) -> SettingValue {
                  return std::string(kOverrunPolicies[static_cast<std::size_t>(all.overrun)]);
                },
                .assign =
                    [](TaskSettings& all, const SettingValue& value) {
                      std::uint8_t policy = 0;
                      while (kOverrunPolicies[policy] != std::get<std::string>(value)) ++policy;
                      all.overrun = OverrunPolicy{policy};
                    }},
    number_setting<&TaskSettings::max_backlog>("max_backlog", 1, INT64_MAX,
                                               "the default of 10 does for most"),
    number_setting<&TaskSettings::stack_bytes>("stack_bytes", 65'536, 1'073'741'824,
                                               "the default of 524288 does for most components"),
    number_setting<&TaskSettings::trace_records>("trace_records", 2, 1'048'576,
                                                 "leave the key out to have room by the period"),
    number_setting<&TaskSettings::hung_after_ns>("hung_after_ns", 1, kLongest,
                                                 "leave the key out for 10 periods, 1 s at least"),
    number_setting<&TaskSettings::deadline_ns>("deadline_ns", 1, kLongest,
                                               "leave the key out for the next instant"),
    TaskSetting{
        .name = "log_level",
        .choices = kLogLevels,
        .get = [](const TaskSettings& all) -> SettingValue { return std::string(to_string(all.log_level)); },
        .assign =
            [](TaskSettings& all, const SettingValue& value) {
              all.log_level = *find_log_level(std::get<std::string>(value));
            }},
    TaskSetting{.name = "enforce_wcet",
                .hint = "without it nothing enforces wcet_ns",
                .get = [](const TaskSettings& all) -> SettingValue { return all.enforce_wcet; },
                .assign = [](TaskSettings& all,
                             const SettingValue& value) { all.enforce_wcet = std::get<bool>(value); }},
};

/// Throws Error (out_of_range, invalid_argument) unless the value is one that the setting takes; `component` is
/// named in it. [non-rt]
void check_setting(const TaskSetting& setting, const SettingValue& value, const std::string& component);
/// Throws Error (out_of_range, duplicate_name) unless these can be. [non-rt]
void check_states(const std::vector<DeclaredState>& states, const std::string& component);
/// Likewise of all of them; the default is always taken. [non-rt]
void check_settings(const TaskSettings& settings, const std::string& component);
/// "5", "0, 1", "skip". [non-rt]
std::string to_string(const SettingValue& value);

}  // namespace mauve
