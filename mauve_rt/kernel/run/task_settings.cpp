// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/run/task_settings.hpp"

#include <algorithm>

#include "mauve_rt/base/error.hpp"

namespace mauve {

namespace {

void check_number(const TaskSetting& setting, std::int64_t number, const std::string& component) {
  if (number >= setting.least && number <= setting.most) return;
  throw Error(ErrorCode::out_of_range, "a setting of the task is out of range",
              {.component = component,
               .element = std::string(setting.name),
               .expected = std::to_string(setting.least) + " to " + std::to_string(setting.most),
               .found = std::to_string(number),
               .remedy = std::string(setting.hint)});
}

}  // namespace

void check_setting(const TaskSetting& setting, const SettingValue& value, const std::string& component) {
  if (const auto* number = std::get_if<std::int64_t>(&value)) {
    check_number(setting, *number, component);
  } else if (const auto* numbers = std::get_if<std::vector<int>>(&value)) {
    for (const int each : *numbers) check_number(setting, each, component);
  } else if (const auto* word = std::get_if<std::string>(&value);
             word != nullptr && std::ranges::find(setting.choices, *word) == setting.choices.end()) {
    throw Error(ErrorCode::invalid_argument, "a setting of the task is none of those there are",
                {.component = component,
                 .element = std::string(setting.name),
                 .expected = join(setting.choices),
                 .found = *word});
  }
}

void check_settings(const TaskSettings& settings, const std::string& component) {
  for (const TaskSetting& setting : kTaskSettings) {
    const SettingValue value = setting.get(settings);
    if (value != setting.get(TaskSettings{})) check_setting(setting, value, component);
  }
  check_states(settings.states, component);
  check_max_slew(settings.max_slew, component);
}

void check_states(const std::vector<DeclaredState>& states, const std::string& component) {
  const auto check_time = [&](const DeclaredState& state, const char* what,
                              const std::optional<time_ns_t>& time_ns, time_ns_t least_ns) {
    if (!time_ns || (*time_ns >= least_ns && *time_ns <= kLongest)) return;
    throw Error(ErrorCode::out_of_range, "a state's time is out of range",
                {.component = component,
                 .element = "state " + state.name + ", " + what,
                 .expected = std::to_string(least_ns) + " to " + std::to_string(kLongest) + " ns",
                 .found = std::to_string(*time_ns)});
  };
  for (std::size_t i = 0; i < states.size(); ++i) {
    check_time(states[i], "max_execution_ns", states[i].max_execution_ns, 1);
    check_time(states[i], "simulated_execution_ns", states[i].simulated_execution_ns, 0);
    check_time(states[i], "wcet_ns", states[i].wcet_ns, 1);
    check_wcet(states[i].name, states[i].wcet_ns.value_or(0), states[i].max_execution_ns.value_or(0),
               component);
    for (std::size_t other = 0; other < i; ++other) {
      if (states[other].name != states[i].name) continue;
      throw Error(ErrorCode::duplicate_name, "a state is declared twice",
                  {.component = component, .element = "state " + states[i].name});
    }
  }
}

std::string to_string(const SettingValue& value) {
  if (const auto* number = std::get_if<std::int64_t>(&value)) return std::to_string(*number);
  if (const auto* word = std::get_if<std::string>(&value)) return *word;
  if (const auto* is_set = std::get_if<bool>(&value)) return *is_set ? "true" : "false";
  std::vector<std::string> words;
  for (const int number : std::get<std::vector<int>>(value)) words.push_back(std::to_string(number));
  return join(words);
}

}  // namespace mauve
