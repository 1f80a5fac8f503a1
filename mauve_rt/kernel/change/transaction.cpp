// SPDX-License-Identifier: LGPL-3.0-or-later
// The kinds of steps.
#include "mauve_rt/change/transaction.hpp"

#include "change/draft.hpp"
#include "change/effects.hpp"

namespace mauve {

namespace {

template <typename Part>
std::string shown(const std::string& name, const std::unique_ptr<Part>& part) {
  if (part == nullptr) return name;
  return part->implementation().empty() ? "(an object)" : part->implementation();
}

/// A step whose effect is a function; the function keeps the arguments.
template <typename Effect>
class Step final : public TransactionStep {
 public:
  Step(std::string text, std::string component, Effect effect)
      : text_(std::move(text)), component_(std::move(component)), effect_(std::move(effect)) {}

  const std::string& text() const noexcept override { return text_; }
  const std::string& component() const noexcept override { return component_; }
  void draft(Draft& draft) override { effect_(draft); }

 private:
  std::string text_;
  std::string component_;
  Effect effect_;
};

template <typename Effect>
std::unique_ptr<TransactionStep> step(std::string text, std::string component, Effect effect) {
  return std::make_unique<Step<Effect>>(std::move(text), std::move(component), std::move(effect));
}

/// Objects serve one commit; a second draft of the same step finds nothing left.
template <typename Part>
std::unique_ptr<Part> take(std::unique_ptr<Part>& part) {
  if (part != nullptr) return std::move(part);
  throw Error(
      ErrorCode::invalid_argument, "the step has no part to put in",
      {.expected = "an object", .found = "none", .remedy = "give each transaction objects of its own"});
}

}  // namespace

Transaction& Transaction::add(std::unique_ptr<TransactionStep> step) {
  steps_.push_back(std::move(step));
  return *this;
}

Transaction& Transaction::replace_core(const std::string& component, const std::string& implementation) {
  std::string text = "replace_core " + component + " " + implementation;
  return add(step(std::move(text), component, [component, implementation](Draft& draft) {
    put_core(draft, component, draft.registry().make_core(implementation), true);
  }));
}
Transaction& Transaction::replace_core(const std::string& component, std::unique_ptr<CoreBase> core) {
  std::string text = "replace_core " + component + " " + shown({}, core);
  return add(step(std::move(text), component, [component, core = std::move(core)](Draft& draft) mutable {
    put_core(draft, component, take(core), false);
  }));
}

Transaction& Transaction::place_core(const std::string& component, std::unique_ptr<CoreBase> core) {
  std::string text = "place_core " + component + " " + shown({}, core);
  return add(step(std::move(text), component, [component, core = std::move(core)](Draft& draft) mutable {
    place_core_in(draft, component, take(core));
  }));
}

Transaction& Transaction::replace_fsm(const std::string& component, const std::string& implementation) {
  std::string text = "replace_fsm " + component + " " + implementation;
  return add(step(std::move(text), component, [component, implementation](Draft& draft) {
    put_fsm(draft, component, draft.registry().make_fsm(implementation), factory_of(draft, implementation));
  }));
}
Transaction& Transaction::replace_fsm(const std::string& component, std::unique_ptr<FsmBase> fsm) {
  std::string text = "replace_fsm " + component + " " + shown({}, fsm);
  return add(step(std::move(text), component, [component, fsm = std::move(fsm)](Draft& draft) mutable {
    put_fsm(draft, component, take(fsm), {});
  }));
}

Transaction& Transaction::replace_shell(const std::string& component, const std::string& implementation) {
  std::string text = "replace_shell " + component + " " + implementation;
  return add(step(std::move(text), component, [component, implementation](Draft& draft) {
    put_shell(draft, component, draft.registry().make_shell(implementation));
  }));
}
Transaction& Transaction::replace_shell(const std::string& component, std::unique_ptr<Shell> shell) {
  std::string text = "replace_shell " + component + " " + shown({}, shell);
  return add(step(std::move(text), component, [component, shell = std::move(shell)](Draft& draft) mutable {
    put_shell(draft, component, take(shell));
  }));
}

Transaction& Transaction::set_property(const std::string& component, const std::string& name,
                                       const PropertyValue& value) {
  std::string text = "set_property " + component + "." + name + " " + to_string(value);
  return add(step(std::move(text), component, [component, name, value](Draft& draft) {
    draft.set_property(draft.change(component), name, value);
  }));
}

Transaction& Transaction::connect(const std::string& component, const std::string& port,
                                  const std::string& resource, const std::string& service) {
  std::string text = "connect " + component + "." + port + " " + resource + "." + service;
  return add(step(std::move(text), component, [component, port, resource, service](Draft& draft) {
    draft.connect(draft.change(component), port, resource, service);
  }));
}

Transaction& Transaction::disconnect(const std::string& component, const std::string& port) {
  std::string text = "disconnect " + component + "." + port;
  return add(step(std::move(text), component,
                  [component, port](Draft& draft) { draft.disconnect(draft.change(component), port); }));
}

Transaction& Transaction::add_component(const std::string& name, const ComponentParts& parts) {
  std::string text = "add_component " + name + " " + parts.core;
  return add(step(std::move(text), name, [name, parts](Draft& draft) {
    const PluginRegistry& registry = draft.registry();
    Parts made{.shell = registry.make_shell(parts.shell),
               .core = registry.make_core(parts.core),
               .fsm = registry.make_fsm(parts.fsm)};
    put_component(draft, name, std::move(made), parts, factory_of(draft, parts.fsm), nullptr);
  }));
}
Transaction& Transaction::add_component(const std::string& name, Parts parts, const ComponentParts& rest,
                                        const Component::FsmFactory& make_fsm,
                                        std::unique_ptr<CoreBase> fallback) {
  std::string text = "add_component " + name + " " + shown({}, parts.core);
  return add(step(
      std::move(text), name,
      [name, parts = std::move(parts), rest, make_fsm, fallback = std::move(fallback)](Draft& draft) mutable {
        Parts all{.shell = take(parts.shell), .core = take(parts.core), .fsm = take(parts.fsm)};
        put_component(draft, name, std::move(all), rest, make_fsm, std::move(fallback));
      }));
}

Transaction& Transaction::remove_component(const std::string& name) {
  std::string text = "remove_component " + name;
  return add(step(std::move(text), name, [name](Draft& draft) { draft.remove_component(name); }));
}

Transaction& Transaction::add_resource(const std::string& name, const std::string& kind,
                                       const std::string& type, ResourceParameters parameters,
                                       TopicBinding topic) {
  std::string text = "add_resource " + name + " " + kind + (type.empty() ? "" : " " + type);
  return add(step(std::move(text), {}, [name, kind, type, parameters, topic](Draft& draft) {
    draft.add_resource(name, draft.registry().make_resource(kind, type, parameters), topic);
  }));
}
Transaction& Transaction::add_resource(const std::string& name, std::unique_ptr<Resource> resource,
                                       TopicBinding topic) {
  std::string text = "add_resource " + name + (resource != nullptr ? " " + resource->kind() : "");
  return add(step(std::move(text), {}, [name, resource = std::move(resource), topic](Draft& draft) mutable {
    draft.add_resource(name, take(resource), topic);
  }));
}

Transaction& Transaction::remove_resource(const std::string& name) {
  std::string text = "remove_resource " + name;
  return add(step(std::move(text), {}, [name](Draft& draft) { draft.remove_resource(name); }));
}

Transaction& Transaction::start(const std::string& component, std::optional<time_ns_t> clock_ns) {
  std::string text = "start " + component;
  return add(step(std::move(text), component,
                  [component, clock_ns](Draft& draft) { put_start(draft, component, clock_ns); }));
}

Transaction& Transaction::stop(const std::string& component) {
  std::string text = "stop " + component;
  return add(step(std::move(text), component, [component](Draft& draft) { put_stop(draft, component); }));
}

Transaction& Transaction::configure(const std::string& component) {
  std::string text = "configure " + component;
  return add(
      step(std::move(text), component, [component](Draft& draft) { put_configure(draft, component); }));
}

Transaction& Transaction::resynchronise() {
  return add(step("resynchronise", {}, [](Draft& draft) { draft.resynchronise(); }));
}

}  // namespace mauve
