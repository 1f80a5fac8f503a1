// SPDX-License-Identifier: LGPL-3.0-or-later
#include "change/draft.hpp"

#include <algorithm>
#include <utility>

#include "mauve_rt/base/contract.hpp"

#include "parts/lookup.hpp"

namespace mauve {

namespace {

bool leads_to(const Wire& wire, const Resource& resource) {
  const auto& services = resource.services();
  return std::find(services.begin(), services.end(), wire.service) != services.end();
}

[[noreturn]] void throw_taken(const std::string& what, const std::string& name) {
  throw Error(ErrorCode::duplicate_name, "the name is taken",
              {.element = what + " " + name, .remedy = "give each " + what + " a name of its own"});
}

}  // namespace

bool Draft::is_removed(const std::string& component) const noexcept {
  return std::any_of(removed_components_.begin(), removed_components_.end(),
                     [&](const DraftComponent& each) { return each.name() == component; });
}

/// Those there will be, as far as is known by now.
std::vector<std::string> Draft::component_names() const {
  std::vector<std::string> names;
  for (const auto& component : architecture_.components()) {
    if (!is_removed(component->name())) names.push_back(component->name());
  }
  for (const DraftComponent& component : components_) {
    if (component.is_added) names.push_back(component.name());
  }
  return names;
}

DraftComponent* Draft::find(const std::string& name) noexcept {
  const auto found = by_name_.find(name);
  return found != by_name_.end() ? found->second : nullptr;
}

/// A component whose thread was left behind takes no change any more: the change that claims it removes it.
DraftComponent Draft::claim(std::shared_ptr<Component> component) {
  MAUVE_EXPECTS(architecture_.change_lock().is_held_here());
  DraftComponent draft;
  claimed_.reserve(claimed_.size() + 1);
  std::shared_ptr<const Wires> wires;
  bool is_free = false;
  {
    const CommitGate::Look table(architecture_.commit_gate());
    ChangeMark& mark = component->change_mark();
    is_free = !mark.is_claimed() && (!mark.is_unsettled() || component->task().is_left_behind());
    if (is_free) {
      mark.claim();
      claimed_.push_back(component);
      draft.changes = mark.changes();
      wires = component->wires();
    }
  }
  if (!is_free) {
    throw Error(ErrorCode::wrong_revision, "an earlier change of the component is not completed yet",
                {.component = component->name(), .remedy = "read it again, then ask again"});
  }
  draft.state = component->task().state();
  draft.ran = draft.runs = draft.state == ComponentState::running;
  draft.wires = draft.wires_before = *wires;
  for (auto& [port, wire] : draft.wires) wire.step = 0;
  draft.component = std::move(component);
  return draft;
}

void Draft::hold(const DraftComponent& component) {
  bool is_same = false;
  {
    const CommitGate::Look table(architecture_.commit_gate());
    ChangeMark& mark = component.component->change_mark();
    MAUVE_EXPECTS(is_claiming_);
    is_same = mark.changes() == component.changes &&
              !architecture_.commit_gate().has_open_about(component.component->task());
    if (is_same) mark.hold();
  }
  if (is_same) return;
  throw Error(ErrorCode::wrong_revision, "a prepared change came before this one; nothing was changed",
              {.component = component.name(), .remedy = "read the architecture, then ask again"});
}

void Draft::release() noexcept {
  if (claimed_.empty()) return;
  const CommitGate::Look table(architecture_.commit_gate());
  if (std::exchange(is_claiming_, false)) {
    for (const auto& component : claimed_) component->change_mark().release();
  }
}

bool Draft::is_structural() const noexcept {
  if (resynchronise_step_ != 0) return true;  // about all components: none comes meanwhile
  if (!removed_components_.empty() || !resources_.empty() || !removed_resources_.empty()) return true;
  return std::any_of(components_.begin(), components_.end(), [](const DraftComponent& component) {
    return component.is_added || component.shell_step != 0 || component.wires != component.wires_before;
  });
}

DraftComponent& Draft::touch(const std::string& name) {
  DraftComponent* component = find(name);
  if (component == nullptr) {
    auto found = is_removed(name) ? nullptr : architecture_.find_component(name);
    if (found == nullptr) throw_no_component(name, component_names());
    components_.push_back(claim(std::move(found)));
    component = &components_.back();
    component->first_step = step_;
    by_name_.emplace(name, component);
  }
  if (component->only_epoch) {
    component->only_epoch = false;
    component->first_step = step_;
  }
  if (component->state == ComponentState::stopping) {
    component->component->task().throw_state_running("the component is STOPPING", 0,
                                                     "try again when it has stopped");
  }
  return *component;
}

DraftComponent& Draft::change(const std::string& name) {
  DraftComponent& component = touch(name);
  if (component.is_added) return component;  // whoever adds it decides on all of it
  if (component.component->is_configured()) component.component->check_reconfigurable();
  const Task& task = component.component->task();
  if (component.state == ComponentState::faulted && !task.is_parked()) {
    throw Error(ErrorCode::faulted, "the component is FAULTED: " + task.fault().what,
                {.component = name,
                 .element = "state " + task.current_state(),
                 .found = "still executing",
                 .remedy = Task::kLeftBehindRemedy});
  }
  return component;
}

std::shared_ptr<Resource> Draft::find_resource(const std::string& name) const {
  if (const auto added = resources_by_name_.find(name); added != resources_by_name_.end())
    return added->second->resource;
  auto present = architecture_.find_resource(name);
  const bool is_removed =
      std::find(removed_resources_.begin(), removed_resources_.end(), present) != removed_resources_.end();
  return is_removed ? nullptr : present;
}

Resource& Draft::resource(const std::string& name) {
  if (const auto found = find_resource(name)) return *found;
  std::vector<std::string> names = names_of(resources_);
  for (const auto& present : architecture_.resources()) {
    if (find_resource(present->name()) == present) names.push_back(present->name());
  }
  throw_no_resource(name, names);
}

DraftComponent& Draft::add_component(const std::string& name, const TaskSettings& settings) {
  check_name("component", name);
  if (find(name) != nullptr || (!is_removed(name) && architecture_.find_component(name) != nullptr))
    throw_taken("component", name);
  DraftComponent added;
  added.component = architecture_.make_unlisted(name);
  added.component->set_settings(settings);
  added.is_added = true;
  added.state = ComponentState::stopped;
  added.first_step = step_;
  components_.push_back(std::move(added));
  by_name_.emplace(name, &components_.back());
  return components_.back();
}

void Draft::remove_component(const std::string& name) {
  DraftComponent& component = touch(name);
  if (!component.is_added && component.component->is_configured())
    component.component->check_reconfigurable();
  const auto place = std::find_if(components_.begin(), components_.end(),
                                  [&](const DraftComponent& each) { return &each == &component; });
  by_name_.erase(name);
  if (component.is_added) {
    components_.erase(place);
  } else {
    removed_components_.splice(removed_components_.end(), components_, place);
  }
}

void Draft::add_resource(const std::string& name, std::shared_ptr<Resource> resource, TopicBinding topic,
                         time_ns_t longest_hold_ns, const Frames& frames) {
  check_name("resource", name);
  if (find_resource(name) != nullptr) throw_taken("resource", name);
  resource->set_name(name);
  resource->set_log_queue(architecture_.log_queue());
  if (longest_hold_ns != 0) resource->set_longest_hold_ns(longest_hold_ns);
  if (frames != Frames{}) resource->set_frames(frames);
  architecture_.prepare_outward(*resource, topic);
  resources_.push_back({.resource = std::move(resource), .added_step = step_});
  resources_by_name_.emplace(name, &resources_.back());
}

/// The ports that will be connected to it.
std::vector<std::string> Draft::ports_of(const Resource& resource) const {
  std::vector<std::string> ports;
  const auto look = [&](const std::string& component, const Wires& wires) {
    for (const auto& [port, wire] : wires) {
      if (leads_to(wire, resource)) ports.emplace_back(component).append(".").append(port);
    }
  };
  for (const DraftComponent& component : components_) look(component.name(), component.wires);
  for (const auto& [component, wires] : architecture_.wiring()) {
    if (!by_name_.contains(component->name()) && !is_removed(component->name()))
      look(component->name(), *wires);
  }
  return ports;
}

void Draft::remove_resource(const std::string& name) {
  const Resource& removed = resource(name);
  if (const std::vector<std::string> ports = ports_of(removed); !ports.empty()) {
    throw Error(ErrorCode::invalid_argument, "the resource is still connected",
                {.element = "resource " + name,
                 .expected = "no port",
                 .found = join(ports),
                 .remedy = "disconnect these in a step before"});
  }
  if (resources_by_name_.erase(name) == 0) {
    removed_resources_.push_back(architecture_.find_resource(name));
  } else {
    resources_.remove_if([&](const DraftResource& each) { return each.resource.get() == &removed; });
  }
}

void Draft::set_property(DraftComponent& component, const std::string& name, const PropertyValue& value) {
  const PropertyBase& property = find_property(component.shell(), name, component.name());
  try {
    component.properties.insert_or_assign(name,
                                          DraftProperty{.value = property.checked(value), .step = step_});
  } catch (const Error& failure) {
    rethrow_as_of(failure, component.name(), step_);
  }
}

bool Draft::is_unsettled(Component& component) const {
  const CommitGate::Look table(architecture_.commit_gate());
  return component.change_mark().is_unsettled();
}

void Draft::resynchronise() {
  if (!deployed_) {
    throw Error(ErrorCode::not_configured, "the architecture is not deployed",
                {.remedy = "deploy it: that gives all components one epoch"});
  }
  resynchronise_step_ = step_;
  for (const auto& component : architecture_.components()) {
    const bool is_late = is_unsettled(*component) && !component->task().is_left_behind();
    if (is_removed(component->name()) || is_late) continue;  // one that is late keeps its grid
    const bool is_new = find(component->name()) == nullptr;
    const ComponentState state = component->task().state();
    if (!is_new && (state == ComponentState::faulted || state == ComponentState::unconfigured)) continue;
    // Also one that does not run takes part: no other change starts it on the old epoch, and it falls back on the new one.
    DraftComponent& touched = touch(component->name());
    touched.only_epoch =
        is_new && (touched.state == ComponentState::faulted || touched.state == ComponentState::unconfigured);
  }
}

}  // namespace mauve
