// SPDX-License-Identifier: LGPL-3.0-or-later
// The settings of a component's task, by name: whatever the kernel's table has.
#include "translate.hpp"

namespace mauve::bindings {

namespace {

/// Throws py::type_error for a value of another type than the setting's.
SettingValue from_python(const TaskSetting& setting, const SettingValue& example, py::handle value) {
  try {
    if (std::holds_alternative<bool>(example) && !py::isinstance<py::bool_>(value)) throw py::cast_error();
    return std::visit(
        [value](const auto& same) -> SettingValue { return value.cast<std::decay_t<decltype(same)>>(); },
        example);
  } catch (const py::cast_error&) {
    throw py::type_error(std::string(setting.name) + ": found " + std::string(py::str(py::type::of(value))));
  }
}

/// Times of an execution state, in the place of the fsm's own.
struct StateTime {
  std::string_view name;
  std::string_view meaning;
  std::optional<time_ns_t> DeclaredState::* member;
};
constexpr auto kStateTimes = std::to_array<StateTime>(
    {{"max_execution_ns", "the bound that the watchdog enforces", &DeclaredState::max_execution_ns},
     {"simulated_execution_ns", "what it takes in virtual time", &DeclaredState::simulated_execution_ns},
     {"wcet_ns", "worst case in CPU time; enforced where enforce_wcet is set", &DeclaredState::wcet_ns}});

/// {"Run": {"max_execution_ns": 1000, "simulated_execution_ns": 0, "wcet_ns": 900}}; each may be left out, or be None.
std::vector<DeclaredState> declared_states(py::handle value) {
  std::vector<DeclaredState> states;
  for (const auto& [name, times] : value.cast<std::map<std::string, py::dict>>()) {
    DeclaredState state{.name = name, .max_execution_ns = {}, .simulated_execution_ns = {}, .wcet_ns = {}};
    for (const auto& [key, time] : times) {
      const auto word = key.cast<std::string>();
      const auto* const known = std::find_if(kStateTimes.begin(), kStateTimes.end(),
                                             [&word](const StateTime& each) { return each.name == word; });
      if (known == kStateTimes.end()) throw py::type_error("states: a state has no time '" + word + "'");
      state.*known->member = time.cast<std::optional<time_ns_t>>();
    }
    states.push_back(std::move(state));
  }
  return states;
}

}  // namespace

TaskSettings task_settings(const std::string& component, const py::kwargs& given) {
  TaskSettings settings;
  for (const auto& [key, value] : given) {
    const auto name = key.cast<std::string>();
    if (name == "states") {
      settings.states = declared_states(value);
      check_states(settings.states, component);
      continue;
    }
    if (name == "max_slew") {
      const auto by_output = value.cast<std::map<std::string, double>>();
      settings.max_slew.assign(by_output.begin(), by_output.end());
      check_max_slew(settings.max_slew, component);
      continue;
    }
    const auto* setting = std::find_if(kTaskSettings.begin(), kTaskSettings.end(),
                                       [&name](const TaskSetting& each) { return each.name == name; });
    if (setting == kTaskSettings.end())
      throw py::type_error("add_component() has no argument '" + name + "'");
    const SettingValue usual = setting->get(settings);
    const SettingValue wanted = from_python(*setting, usual, value);
    if (wanted != usual) check_setting(*setting, wanted, component);
    setting->assign(settings, wanted);
  }
  return settings;
}

void bind_settings(py::module_& module) {
  py::class_<TaskSetting>(
      module, "TaskSetting",
      "What one of TaskSettings may be. A default outside of the limits is the kernel's own choice.")
      .def_property_readonly("default",
                             [](const TaskSetting& setting) { return setting.get(TaskSettings{}); })
      .def_readonly("least", &TaskSetting::least, "Of the number, or of each of the numbers.")
      .def_readonly("most", &TaskSetting::most)
      .def_property_readonly(
          "choices",
          [](const TaskSetting& setting) {
            return std::vector<std::string>(setting.choices.begin(), setting.choices.end());
          },
          "Of a word.")
      .def_property_readonly("hint", [](const TaskSetting& setting) { return std::string(setting.hint); });
  py::dict all;
  for (const TaskSetting& setting : kTaskSettings) all[std::string(setting.name).c_str()] = setting;
  module.attr("TASK_SETTINGS") = all;
  py::dict times;
  for (const StateTime& time : kStateTimes) times[std::string(time.name).c_str()] = std::string(time.meaning);
  module.attr("STATE_TIMES") = times;
}

}  // namespace mauve::bindings
