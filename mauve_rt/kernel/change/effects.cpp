// SPDX-License-Identifier: LGPL-3.0-or-later
#include "change/effects.hpp"

#include <algorithm>

namespace mauve {

namespace {

/// The component whose part is to be replaced.
DraftComponent& replacing(Draft& draft, const std::string& component) {
  DraftComponent& changed = draft.change(component);
  if (changed.is_added || changed.component->is_configured()) return changed;
  throw Error(ErrorCode::not_configured, "the component is not configured",
              {.component = component, .remedy = "configure it first, or build it with the other part"});
}

}  // namespace

void put_core(Draft& draft, const std::string& component, std::unique_ptr<CoreBase> core, bool by_name) {
  DraftComponent& changed = replacing(draft, component);
  if (by_name && !changed.is_added) changed.component->check_allowed(core->implementation());
  if (changed.is_added) {  // the core it was added with stays one it may be given back
    std::vector<std::string> alternatives = changed.component->alternatives();
    const std::string first = changed.fresh.core->implementation();
    const bool is_named = std::find(alternatives.begin(), alternatives.end(), first) != alternatives.end();
    if (first != core->implementation() && !is_named) alternatives.push_back(first);
    changed.component->allow(std::move(alternatives), changed.component->is_reconfigurable());
  }
  changed.fresh.core = std::move(core);
  changed.core_step = draft.step();
  changed.core_unready = false;
}

void place_core_in(Draft& draft, const std::string& component, std::unique_ptr<CoreBase> core) {
  DraftComponent& changed = draft.touch(component);
  changed.component->check_reconfigurable();
  changed.component->require_parked("replace_core");
  changed.fresh.core = std::move(core);
  changed.core_step = draft.step();
  changed.core_unready = !changed.is_added;  // an added one is configured as a whole
}

void put_fsm(Draft& draft, const std::string& component, std::unique_ptr<FsmBase> fsm,
             Component::FsmFactory make_fsm) {
  DraftComponent& changed = replacing(draft, component);
  changed.fresh.fsm = std::move(fsm);
  changed.make_fsm = std::move(make_fsm);
  changed.fsm_step = draft.step();
}

void put_shell(Draft& draft, const std::string& component, std::unique_ptr<Shell> shell) {
  DraftComponent& changed = replacing(draft, component);
  changed.fresh.shell = std::move(shell);
  changed.shell_step = draft.step();
  // What steps before have set, they have set of this shell too.
  const std::map<std::string, DraftProperty> set = changed.properties;
  for (const auto& [name, property] : set) draft.set_property(changed, name, property.value);
}

Component::FsmFactory factory_of(const Draft& draft, const std::string& fsm) {
  const PluginRegistry* registry = &draft.registry();
  return [registry, fsm] { return registry->make_fsm(fsm); };
}

void put_component(Draft& draft, const std::string& name, Parts parts, const ComponentParts& rest,
                   Component::FsmFactory make_fsm, std::unique_ptr<CoreBase> fallback) {
  DraftComponent& added = draft.add_component(name, rest.settings);
  added.fresh = std::move(parts);
  added.make_fsm = std::move(make_fsm);
  added.component->allow(rest.alternatives, rest.reconfigurable);
  if (fallback == nullptr && !rest.fallback.empty()) fallback = draft.registry().make_core(rest.fallback);
  if (fallback != nullptr) added.component->set_fallback(std::move(fallback));
  for (const auto& [property, value] : rest.properties) draft.set_property(added, property, value);
}

void put_start(Draft& draft, const std::string& name, std::optional<time_ns_t> clock_ns) {
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

void put_configure(Draft& draft, const std::string& name) {
  DraftComponent& configured = draft.change(name);
  if (configured.is_added) return;  // it is, as it comes
  if (configured.ran) {
    throw Error(ErrorCode::already_running, "the component is running",
                {.component = name,
                 .expected = "a parked component",
                 .found = "RUNNING",
                 .remedy = "stop it before, or replace its core in flight"});
  }
  configured.configure_step = draft.step();
}

void put_stop(Draft& draft, const std::string& name) {
  DraftComponent& stopped = draft.touch(name);
  if (!stopped.runs) {
    const ComponentState found = stopped.ran ? ComponentState::stopped : stopped.state;
    throw Error(ErrorCode::not_running, "the component is not running",
                {.component = name, .expected = "RUNNING", .found = std::string(to_string(found))});
  }
  stopped.runs = false;
}

}  // namespace mauve
