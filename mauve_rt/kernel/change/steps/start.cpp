// SPDX-License-Identifier: LGPL-3.0-or-later
// A parked component runs, in its initial state; its value, if any, is the instant whose grid it takes.
#include "change/steps/step_kind.hpp"

namespace mauve {

namespace {

void start_component(Draft& draft, const std::string& name, std::optional<time_ns_t> clock_ns) {
  DraftComponent& started = draft.touch(name);
  if (!draft.is_deployed()) {
    throw Error(ErrorCode::not_configured, "the architecture is not deployed",
                {.component = name, .remedy = "deploy it: that starts all components"});
  }
  const Task& task = started.component->task();
  if (started.state == ComponentState::faulted && !started.is_repaired()) {
    throw Error(
        ErrorCode::faulted, "the component is FAULTED: " + task.fault().what,
        {.component = name, .remedy = task.is_parked() ? Task::kRepairRemedy : Task::kLeftBehindRemedy});
  }
  if (started.state == ComponentState::unconfigured && started.configure_step == 0) {
    throw Error(ErrorCode::not_configured, "the component is not configured",
                {.component = name, .remedy = "configure it in a step before"});
  }
  if (started.runs) {
    throw Error(ErrorCode::already_running, "the component is running already",
                {.component = name,
                 .expected = "STOPPED",
                 .found = "RUNNING",
                 .remedy = "leave the step out, or stop it in a step before"});
  }
  started.runs = true;
  started.restarts = started.ran;
  started.clock_ns = clock_ns;
}

}  // namespace

constexpr StepKind steps::start{
    .name = "start", .element = "state", .draft = [](Draft& draft, TransactionStep& step) {
      const bool has_clock = !std::holds_alternative<std::monostate>(step.value);
      start_component(draft, step.target,
                      has_clock ? std::optional(plain_value_of<std::int64_t>(step)) : std::nullopt);
    }};

}  // namespace mauve
