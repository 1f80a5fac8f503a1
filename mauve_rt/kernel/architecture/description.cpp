// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/architecture/description.hpp"

#include <algorithm>

#include "mauve_rt/architecture/architecture.hpp"
#include "mauve_rt/base/error.hpp"

namespace mauve {

namespace {

ComponentFacts facts_of(Component& component, time_ns_t epoch_ns) {
  Task& task = component.task();
  return {.name = component.name(),
          .parts = component.shown(),
          .state = task.state(),
          .period_ns = task.context().period_ns.load(std::memory_order_relaxed),
          .reference_ns = task.grid().reference_ns == 0 ? 0 : later_by(task.grid().reference_ns, -epoch_ns),
          .settings = task.settings(),
          .alternatives = component.alternatives(),
          .fallback = component.fallback_implementation(),
          .reconfigurable = component.is_reconfigurable()};
}

ResourceFacts facts_of(const Resource& resource) {
  ResourceFacts facts{.name = resource.name(),
                      .kind = resource.kind(),
                      .type = resource.type(),
                      .services = {},
                      .longest_hold_ns = resource.longest_hold_ns(),
                      .frames = resource.frame_guard().declared()};
  for (const ServiceBase* service : resource.services())
    facts.services.push_back({.name = service->name(), .kind = service->kind(), .type = service->type()});
  return facts;
}

template <typename Facts>
void sort_by_name(std::vector<Facts>& facts) {
  std::sort(facts.begin(), facts.end(), [](const Facts& a, const Facts& b) { return a.name < b.name; });
}

std::string text_of(const DeclaredState& state) {
  const auto time = [](const std::optional<time_ns_t>& time_ns) {
    return time_ns ? std::to_string(*time_ns) : "as the fsm says";
  };
  return state.name + " max_execution_ns " + time(state.max_execution_ns) + " simulated_execution_ns " +
         time(state.simulated_execution_ns) + " wcet_ns " + time(state.wcet_ns);
}

std::string text_of(const ComponentFacts& facts) {
  std::string text = "component " + facts.name + "\n  state " + std::string(to_string(facts.state)) + "\n";
  text +=
      "  shell " + facts.parts.shell + "\n  core " + facts.parts.core + "\n  fsm " + facts.parts.fsm + "\n";
  text += "  period_ns " + std::to_string(facts.period_ns) + "\n  reference_ns " +
          std::to_string(facts.reference_ns) + "\n";
  for (const TaskSetting& setting : kTaskSettings)
    text += "  setting " + std::string(setting.name) + " " + to_string(setting.get(facts.settings)) + "\n";
  for (const DeclaredState& state : facts.settings.states) text += "  declared " + text_of(state) + "\n";
  text += "  alternatives " + join(facts.alternatives) + "\n";
  if (!facts.fallback.empty()) text += "  fallback " + facts.fallback + "\n";
  if (!facts.reconfigurable) text += "  reconfigurable false\n";
  for (const ShownProperty& property : facts.parts.properties)
    text += "  property " + property.name + " " + to_string(property.value) + "\n";
  for (const ShownPort& port : facts.parts.ports) {
    text += "  port " + port.name + " " + std::string(to_string(port.kind)) + " " + port.type;
    text += port.resource.empty() ? "" : " -> " + port.resource + "." + port.service;
    text += port.frames == Frames{} ? "\n" : " in " + to_string(port.frames) + "\n";
  }
  return text;
}

std::string text_of(const ResourceFacts& facts) {
  std::string text = "resource " + facts.name + " " + facts.kind + " " + facts.type + "\n";
  if (facts.longest_hold_ns != 0) text += "  longest_hold_ns " + std::to_string(facts.longest_hold_ns) + "\n";
  if (facts.frames != Frames{}) text += "  in " + to_string(facts.frames) + "\n";
  for (const ServiceFacts& service : facts.services)
    text +=
        "  service " + service.name + " " + std::string(to_string(service.kind)) + " " + service.type + "\n";
  return text;
}

Assigned assigned_by(const TransactionStep& step) {
  Assigned assigned{.element = {.target = step.target, .name = step.element()},
                    .step = {.kind = std::string(step.kind()), .target = step.target, .name = step.name}};
  if (const auto* value = std::get_if<PropertyValue>(&step.value)) assigned.step.value = *value;
  return assigned;
}

Assigned core_of(const std::string& component, const std::string& core) {
  return {.element = {.target = component, .name = "core"},
          .step = {.kind = "replace_core", .target = component, .name = core}};
}

}  // namespace

void Architecture::reject_core(const std::string& component, const std::string& core) {
  if (!core.empty()) overlays_.reject(core_of(component, core));
}

ArchitectureDescription Architecture::describe() const {
  ArchitectureDescription description;
  const Lists all = lists();
  const time_ns_t epoch_ns = deployment_epoch_ns();
  for (const auto& component : all.components)
    description.components.push_back(facts_of(*component, epoch_ns));
  for (const auto& resource : all.resources) description.resources.push_back(facts_of(*resource));
  sort_by_name(description.components);
  sort_by_name(description.resources);
  return description;
}

std::vector<Authored> Architecture::authors() const {
  std::vector<Authored> found = authors_.all();
  for (const auto& component : components()) {
    if (!component->task().has_fallen_back()) continue;
    std::erase_if(
        found, [&](const Authored& one) { return one.target == component->name() && one.element == "core"; });
    found.push_back({.target = component->name(), .element = "core", .author = "fallback"});
  }
  return found;
}

void Architecture::note_author(const Assigned& assigned, const std::string& author) {
  authors_.note(assigned.element.target, assigned.element.name, author);
  overlays_.note(assigned, author);
}

void Architecture::note_authors(const Transaction& transaction) {
  for (const auto& step : transaction.steps()) {
    if (step->removes()) authors_.forget(step->target);
    if (!step->is_for_all()) note_author(assigned_by(*step), transaction.author());
  }
}

void Architecture::follow(const Overlays::Look& look, const ArchitectureDescription& description) {
  std::vector<Assigned> faulted;
  for (const auto& component : components()) {
    if (const std::string core = component->faulted_core(); !core.empty())
      faulted.push_back(core_of(component->name(), core));
  }
  overlays_.follow(look, description, authors(), faulted);
}

std::string to_string(const ArchitectureDescription& description) {
  std::string text;
  for (const ComponentFacts& component : description.components) text += text_of(component);
  for (const ResourceFacts& resource : description.resources) text += text_of(resource);
  return text;
}

}  // namespace mauve
