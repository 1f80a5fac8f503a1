// SPDX-License-Identifier: LGPL-3.0-or-later
// What only the whole draft shows.
#include <algorithm>
#include <map>
#include <vector>

#include "change/draft.hpp"
#include "parts/lookup.hpp"

namespace mauve {

void rethrow_as_of(const Error& failure, const std::string& component, int step) {
  ErrorDetail detail = failure.detail();
  if (detail.component.empty()) detail.component = component;
  if (detail.step == 0) detail.step = step;
  throw Error(failure.code(), failure.statement(), detail);
}

void Draft::finish() {
  for (const DraftComponent& component : components_) {
    if (component.only_epoch) continue;
    check_repaired(component);
    if (component.shell_step != 0) check_kept_wires(component);
    if (!component.is_added) check_structural(component);
    if (component.probation) check_probation(component);
    if (component.bumpless) check_bumpless(component);
    if (component.shadow != nullptr) check_shadow(component);
    if (architecture_.is_configured()) check_required_ports(component);
    if (component.core_unready && component.runs) {
      throw Error(ErrorCode::not_configured, "the core is not configured",
                  {.component = component.name(),
                   .remedy = "configure it first, or replace it by a replace_core step",
                   .step = component.core_step});
    }
    if (component.runs && !component.ran) check_core(component);
  }
  check_port_counts();
  check_frames();
}

void Draft::check_repaired(const DraftComponent& component) {
  if (component.first_step == 0 || component.state != ComponentState::faulted || component.is_repaired())
    return;
  throw Error(ErrorCode::faulted, "the component is FAULTED: " + component.component->task().fault().what,
              {.component = component.name(), .remedy = Task::kRepairRemedy, .step = component.first_step});
}

void Draft::check_kept_wires(const DraftComponent& component) const {
  for (const auto& [name, wire] : component.wires) {
    const PortBase* port = component.shell().find_port(name);
    if (port == nullptr) {
      throw Error(ErrorCode::unknown_port, "the new shell lacks a port that is connected",
                  {.component = component.name(),
                   .element = "port " + name,
                   .expected = "a port for " + wire.resource + "." + wire.service->name(),
                   .found = "none of that name",
                   .remedy = "disconnect it in the same transaction",
                   .step = component.shell_step});
    }
    try {
      port->check(*wire.service);
    } catch (const Error& failure) {
      rethrow_as_of(failure, component.name(), std::max(wire.step, component.shell_step));
    }
  }
}

void Draft::check_structural(const DraftComponent& component) {
  for (const auto& [name, property] : component.properties) {
    try {
      component.component->check_structural(*component.shell().find_property(name), property.value,
                                            component.replaced());
    } catch (const Error& failure) {
      rethrow_as_of(failure, component.name(), property.step);
    }
  }
}

/// The old core is to go back in as it is, with an old fsm, into the parts that they were configured with.
void Draft::check_probation(const DraftComponent& component) const {
  try {
    if (component.probation) check_options(*component.probation, component.name());
  } catch (const Error& failure) {
    rethrow_as_of(failure, component.name(), component.core_step);
  }
  const auto refuse = [&](ErrorCode code, const char* what, const char* expected, const char* remedy) {
    throw Error(code, what,
                {.component = component.name(),
                 .element = "probation",
                 .expected = expected,
                 .remedy = remedy,
                 .step = component.core_step});
  };
  if (!deployed_ || component.is_added) {
    refuse(ErrorCode::not_configured, "a core is on probation only in a deployed component",
           "a component of a deployed architecture",
           "deploy it first, or replace the core without probation");
  }
  if (component.state == ComponentState::faulted) {
    refuse(ErrorCode::faulted, "the core of a FAULTED component is not replaced on probation",
           "a component that is RUNNING or STOPPED",
           "repair it first, or replace the core without probation");
  }
  if (component.shell_step != 0 || component.configure_step != 0) {
    refuse(ErrorCode::invalid_argument, "only a core, or an fsm and a core, can be on probation",
           "no new shell and no configure step of the component in the same transaction",
           "make these changes in a transaction of their own");
  }
  const ReadBy replaced = component.fsm_step != 0 ? ReadBy::core | ReadBy::fsm : ReadBy::core;
  for (const auto& [name, property] : component.properties) {
    const ReadBy read_by = component.component->require_property(name).options().structural;
    if (without(read_by, replaced) == read_by) continue;
    refuse(ErrorCode::structural_property,
           "the old part was configured with another value of a structural property",
           "no structural property that a part on probation reads",
           "set it in a transaction without probation");
  }
}

/// The candidate is compared in the parts and with the inputs that the component has now.
void Draft::check_bumpless(const DraftComponent& component) const {
  const auto refuse = [&](ErrorCode code, const char* what, const char* expected, const char* remedy) {
    throw Error(code, what,
                {.component = component.name(),
                 .element = "bumpless",
                 .expected = expected,
                 .remedy = remedy,
                 .step = component.core_step});
  };
  const BumplessOptions options = component.bumpless.value_or(BumplessOptions{});
  try {
    check_options(options, component.name());
  } catch (const Error& failure) {
    rethrow_as_of(failure, component.name(), component.core_step);
  }
  if (!deployed_ || component.is_added)
    refuse(ErrorCode::not_configured, "only a component of a deployed architecture is changed without a bump",
           "a component of a deployed architecture", "deploy it first, or leave `bumpless` out");
  const bool is_changed = component.shell_step != 0 || component.fsm_step != 0 ||
                          component.configure_step != 0 || !component.properties.empty() ||
                          component.wires != component.wires_before;
  if (is_changed)
    refuse(ErrorCode::invalid_argument,
           "a bumpless change replaces the core of its component, and nothing else",
           "no new shell or fsm, no wiring, property or configure step of the component",
           "make these changes in a transaction before");
  if (options.blend_ns != 0 && component.probation)
    refuse(ErrorCode::invalid_argument,
           "a core on probation goes in at once: the old core must stay as it is",
           "one of blend_s and probation_s", "leave out one of both");
  const auto others = std::count_if(components_.begin(), components_.end(),
                                    [](const DraftComponent& each) { return each.bumpless.has_value(); });
  if (others > 1)
    refuse(ErrorCode::invalid_argument, "one transaction makes one bumpless change",
           "bumpless for one component", "make a transaction for each component");
}

/// The candidate has the parts and the inputs that the component has now.
void Draft::check_shadow(const DraftComponent& component) {
  const bool is_changed = component.has_new_parts() || component.configure_step != 0 ||
                          component.sets_structural() || component.wires != component.wires_before;
  if (!is_changed) return;
  throw Error(ErrorCode::invalid_argument, "the transaction changes the component that it gives a shadow",
              {.component = component.name(),
               .element = "shadow",
               .expected = "no new parts, wiring or structural properties, and no configure step",
               .remedy = "make these changes in a transaction before",
               .step = component.shadow_step});
}

/// A core that is put in is configured by then.
void Draft::check_core(const DraftComponent& component) {
  if (component.is_added || component.core_step != 0) return;
  try {
    component.component->require_ready_core();
  } catch (const Error& failure) {
    rethrow_as_of(failure, component.name(), component.first_step);
  }
}

void Draft::check_required_ports(const DraftComponent& component) const {
  for (const auto& port : component.shell().ports()) {
    if (!port->is_required() || component.wires.contains(port->name())) continue;
    const auto disconnected = component.disconnected.find(port->name());
    const int step = disconnected != component.disconnected.end() ? disconnected->second
                     : component.shell_step != 0                  ? component.shell_step
                                                                  : component.first_step;
    throw_not_connected(*port, component.name(), step);
  }
}

void Draft::check_port_counts() const {
  struct Count {
    std::uint32_t ports{0};  // that there will be
    std::uint32_t fresh{0};  // of them those that come
    int step{0};             // the last that connected to it
    std::string component;
  };
  std::map<ServiceBase*, Count> counts;
  // In the order of the draft: which error is found first depends on no address.
  std::vector<ServiceBase*> services;
  for (const DraftComponent& component : components_) {
    for (const auto& [port, wire] : component.wires) {
      const auto [place, is_first] = counts.try_emplace(wire.service);
      if (is_first) services.push_back(wire.service);
      Count& count = place->second;
      const auto before = component.wires_before.find(port);
      const bool stays = before != component.wires_before.end() && before->second == wire;
      count.fresh += stays && component.shell_step == 0 ? 0 : 1;
      if (wire.step <= count.step) continue;
      count.step = wire.step;
      count.component = component.name();
    }
  }
  std::erase_if(services, [&](ServiceBase* service) {
    const Count& count = counts.at(service);
    return count.step == 0 && count.fresh == 0;
  });
  if (services.empty()) return;
  const auto count_all = [&](const Wires& wires) {
    for (const auto& [port, wire] : wires) {
      if (const auto count = counts.find(wire.service); count != counts.end()) ++count->second.ports;
    }
  };
  for (const DraftComponent& component : components_) count_all(component.wires);
  for (const auto& [component, wires] : architecture_.wiring()) {
    if (!by_name_.contains(component->name()) && !is_removed(component->name())) count_all(*wires);
  }
  for (ServiceBase* const service : services) {
    const Count& count = counts.at(service);
    try {
      service->check_ports(count.ports + service->inputs());
      // A port that goes, in this change or in one that a late component has yet to take, has its place until then.
      service->make_room(service->ports() + count.fresh);
    } catch (const Error& failure) {
      rethrow_as_of(failure, count.component, count.step);
    }
  }
}

bool Draft::touches_frames() const {
  const auto has_frames = [](const Wires& wires) {
    return std::any_of(wires.begin(), wires.end(),
                       [](const auto& wire) { return wire.second.frames != nullptr; });
  };
  const auto touches = [&](const DraftComponent& component) {
    return has_frames(component.wires) || has_frames(component.wires_before);
  };
  return std::any_of(components_.begin(), components_.end(), touches) ||
         std::any_of(removed_components_.begin(), removed_components_.end(), touches);
}

/// The first port of a resource that declares a frame says what all others are in.
void Draft::check_frames() {
  if (!touches_frames()) return;
  struct End {
    const std::string* component;
    const std::string* port;
    const Wire* wire;
  };
  std::multimap<int, End> ends;  // by the step that connects it, or gives it another shell; 0: it stays
  const auto note = [&](const std::string& component, const Wires& wires, const DraftComponent* drafted) {
    for (const auto& [port, wire] : wires) {
      if (wire.service->resource() == nullptr) continue;
      const int step = drafted == nullptr ? 0 : std::max(wire.step, drafted->shell_step);
      ends.emplace(step, End{&component, &port, &wire});
    }
  };
  const std::vector<Wiring> all = architecture_.wiring();
  for (const auto& [component, wires] : all) {
    if (!by_name_.contains(component->name()) && !is_removed(component->name()))
      note(component->name(), *wires, nullptr);
  }
  for (const DraftComponent& component : components_) {
    note(component.name(), component.wires, &component);
    for (const auto& [port, wire] : component.wires_before) frames_.try_emplace(wire.service->resource());
  }
  for (const DraftComponent& component : removed_components_) {
    for (const auto& [port, wire] : component.wires_before) frames_.try_emplace(wire.service->resource());
  }
  frames_.erase(nullptr);
  std::map<Resource*, std::vector<const End*>> first;  // that declare a frame that none before has declared
  for (auto& [resource, frames] : frames_) frames = resource->frame_guard().declared();
  for (const auto& [step, end] : ends) {
    if (end.wire->frames == nullptr) continue;
    Resource* const resource = end.wire->service->resource();
    const auto [place, is_new] = frames_.try_emplace(resource, resource->frame_guard().declared());
    Frames& frames = place->second;
    std::vector<const End*>& before = first[resource];
    const auto difference = frame_difference(*end.wire->frames, frames);
    if (!difference) {
      const Frames merged = merged_frames(frames, *end.wire->frames);
      if (merged != frames) before.push_back(&end);
      frames = merged;
      continue;
    }
    const auto other = std::find_if(before.begin(), before.end(), [&](const End* earlier) {
      return frame_difference(*end.wire->frames, *earlier->wire->frames).has_value();
    });
    const std::string of = other == before.end()
                               ? "resource " + end.wire->resource
                               : "port " + *(*other)->component + "." + *(*other)->port + " at " +
                                     (*other)->wire->resource + "." + (*other)->wire->service->name();
    throw Error(ErrorCode::frame_mismatch, "two ports of a resource are in different frames",
                {.component = *end.component,
                 .element = "port " + *end.port,
                 .expected = difference->ours + ", as the port declares",
                 .found = difference->theirs + " of " + of,
                 .remedy = std::string(kFrameRemedy),
                 .step = step});
  }
}

}  // namespace mauve
