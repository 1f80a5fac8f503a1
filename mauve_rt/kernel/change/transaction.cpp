// SPDX-License-Identifier: LGPL-3.0-or-later
// The typed calls.
#include "mauve_rt/change/transaction.hpp"

#include "change/steps/step_kind.hpp"

namespace mauve {

Transaction& Transaction::replace_core(const std::string& component, const std::string& implementation) {
  return add(steps::replace_core, component, implementation);
}
Transaction& Transaction::replace_core(const std::string& component, std::unique_ptr<CoreBase> core) {
  return add(steps::replace_core, component, {}, std::move(core));
}
Transaction& Transaction::replace_core(const std::string& component, const std::string& implementation,
                                       ProbationOptions options) {
  return replace_core(component, implementation, ReplaceOptions{.probation = std::move(options)});
}
Transaction& Transaction::replace_core(const std::string& component, std::unique_ptr<CoreBase> core,
                                       ProbationOptions options) {
  return replace_core(component, std::move(core), ReplaceOptions{.probation = std::move(options)});
}
Transaction& Transaction::replace_core(const std::string& component, const std::string& implementation,
                                       ReplaceOptions options) {
  return add(steps::replace_core, component, implementation, CoreWithOptions{.options = std::move(options)});
}
Transaction& Transaction::replace_core(const std::string& component, std::unique_ptr<CoreBase> core,
                                       ReplaceOptions options) {
  return add(steps::replace_core, component, {},
             CoreWithOptions{.core = std::move(core), .options = std::move(options)});
}
Transaction& Transaction::shadow(const std::string& component, const std::string& implementation,
                                 ShadowOptions options) {
  return add(steps::shadow, component, implementation, CoreInShadow{.options = options});
}
Transaction& Transaction::shadow(const std::string& component, std::unique_ptr<CoreBase> core,
                                 ShadowOptions options, std::unique_ptr<Shell> shell) {
  return add(steps::shadow, component, {},
             CoreInShadow{.core = std::move(core), .options = options, .shell = std::move(shell)});
}
Transaction& Transaction::end_shadow(const std::string& component) {
  return add(steps::end_shadow, component);
}
Transaction& Transaction::promote(const std::string& component, PromoteOptions options) {
  return add(steps::promote, component, {}, std::move(options));
}
Transaction& Transaction::place_core(const std::string& component, std::unique_ptr<CoreBase> core) {
  return add(steps::place_core, component, {}, std::move(core));
}
Transaction& Transaction::replace_fsm(const std::string& component, const std::string& implementation) {
  return add(steps::replace_fsm, component, implementation);
}
Transaction& Transaction::replace_fsm(const std::string& component, std::unique_ptr<FsmBase> fsm) {
  return add(steps::replace_fsm, component, {}, std::move(fsm));
}
Transaction& Transaction::replace_shell(const std::string& component, const std::string& implementation) {
  return add(steps::replace_shell, component, implementation);
}
Transaction& Transaction::replace_shell(const std::string& component, std::unique_ptr<Shell> shell) {
  return add(steps::replace_shell, component, {}, std::move(shell));
}
Transaction& Transaction::set_property(const std::string& component, const std::string& name,
                                       const PropertyValue& value) {
  return add(steps::set_property, component, name, value);
}
Transaction& Transaction::connect(const std::string& component, const std::string& port,
                                  const std::string& resource, const std::string& service) {
  return add(steps::connect, component, port, PropertyValue(resource + "." + service));
}
Transaction& Transaction::disconnect(const std::string& component, const std::string& port) {
  return add(steps::disconnect, component, port);
}
Transaction& Transaction::add_component(const std::string& name, const ComponentParts& parts) {
  return add(steps::add_component, name, {}, NewComponent{.rest = parts});
}
Transaction& Transaction::add_component(const std::string& name, Parts parts, const ComponentParts& rest,
                                        std::unique_ptr<CoreBase> fallback) {
  return add(steps::add_component, name, {},
             NewComponent{
                 .rest = rest, .by_name = false, .parts = std::move(parts), .fallback = std::move(fallback)});
}
Transaction& Transaction::remove_component(const std::string& name) {
  return add(steps::remove_component, name);
}
Transaction& Transaction::add_resource(const std::string& name, const std::string& kind,
                                       const std::string& type, ResourceParameters parameters,
                                       TopicBinding topic, time_ns_t longest_hold_ns, const Frames& frames) {
  return add(steps::add_resource, name, {},
             NewResource{.kind = kind,
                         .type = type,
                         .parameters = std::move(parameters),
                         .topic = topic,
                         .longest_hold_ns = longest_hold_ns,
                         .frames = frames});
}
Transaction& Transaction::add_resource(const std::string& name, std::unique_ptr<Resource> resource,
                                       TopicBinding topic, time_ns_t longest_hold_ns, const Frames& frames) {
  return add(steps::add_resource, name, {},
             NewResource{.by_kind = false,
                         .resource = std::move(resource),
                         .topic = topic,
                         .longest_hold_ns = longest_hold_ns,
                         .frames = frames});
}
Transaction& Transaction::remove_resource(const std::string& name) {
  return add(steps::remove_resource, name);
}
Transaction& Transaction::start(const std::string& component, std::optional<time_ns_t> clock_ns) {
  return add(steps::start, component, {}, clock_ns ? StepValue(PropertyValue(*clock_ns)) : StepValue{});
}
Transaction& Transaction::stop(const std::string& component) { return add(steps::stop, component); }
Transaction& Transaction::bring_back(const std::string& component) {
  return add(steps::bring_back, component);
}
Transaction& Transaction::configure(const std::string& component) { return add(steps::configure, component); }
Transaction& Transaction::resynchronise() { return add(steps::resynchronise, {}); }

}  // namespace mauve
