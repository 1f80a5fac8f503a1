// SPDX-License-Identifier: LGPL-3.0-or-later
// Shell: ports and properties, the only part of a component that is visible from outside.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <typeinfo>
#include <vector>

#include "mauve_rt/base/context.hpp"
#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/data/call_type.hpp"
#include "mauve_rt/data/port.hpp"
#include "mauve_rt/parts/action_ports.hpp"
#include "mauve_rt/parts/component_part.hpp"
#include "mauve_rt/parts/property.hpp"

namespace mauve {

/// Derive from this and declare ports and properties as members (Listing 1 of the paper):
///
///   struct GuidanceShell : mauve::Shell {
///     mauve::Property<double>& path_step = property("path_step", 0.5, {.unit = "m"});
///     mauve::ReadPort<Point>& goal = read_port<Point>("goal");
///   };
///
/// Every port is to be connected before configure, unless declared so: read_port<Point>("goal").optional().
class Shell : public ComponentPart<Shell> {
 public:
  /// [rt]
  const std::vector<std::unique_ptr<PortBase>>& ports() const MAUVE_RT { return ports_; }
  const std::vector<std::unique_ptr<PropertyBase>>& properties() const MAUVE_RT { return properties_; }
  /// The port or property of that name, or nullptr. [non-rt]
  PortBase* find_port(std::string_view name) const noexcept;
  PropertyBase* find_property(std::string_view name) const noexcept;

  /// Given by the component, before configure. [setup]
  void set_context(const Context* context) noexcept;
  /// The size of its class, where a registry made it; 0: not known. [setup]
  void set_bytes(std::size_t bytes) noexcept { bytes_ = bytes; }
  std::size_t bytes() const noexcept { return bytes_; }
  std::string description() const override { return "shell " + implementation(); }

 protected:
  /// As of a core. [rt]
  Log log() const MAUVE_RT { return Log(context_ != nullptr ? &context_->log : nullptr); }

  template <typename T>
  ReadPort<T>& read_port(std::string name) {
    return add(ports_, std::make_unique<ReadPort<T>>(std::move(name)));
  }
  template <typename T>
  ReadPort<T>& read_port(std::string name, const T& initial) {
    return add(ports_, std::make_unique<ReadPort<T>>(std::move(name), initial));
  }
  template <typename T>
  WritePort<T>& write_port(std::string name, OutputOptions output = {}) {
    return add(ports_, std::make_unique<WritePort<T>>(std::move(name), output));
  }
  template <typename Signature>
  CallPort<Signature>& call_port(std::string name, std::string type) {
    return add(ports_, std::make_unique<CallPort<Signature>>(std::move(name), std::move(type)));
  }
  /// A port for calls of a type that was declared by MAUVE_CALL_TYPE.
  template <DescribedCall S>
  CallPort<CallOf<S>>& call_port(std::string name) {
    return call_port<CallOf<S>>(std::move(name), std::string(CallTraits<S>::name));
  }
  /// The ports of a component that executes goals of an action, NAME_status ... NAME_result, or sends them.
  template <DescribedAction A>
  ActionServerPorts<A> action_server(const std::string& name) {
    return {.status = read_port<ActionGoal>(name + "_status"),
            .goal = read_port<typename A::Goal>(name + "_goal"),
            .decide = write_port<ActionGoal>(name + "_decide"),
            .feedback = write_port<typename A::Feedback>(name + "_feedback"),
            .result = write_port<typename A::Result>(name + "_result")};
  }
  template <DescribedAction A>
  ActionClientPorts<A> action_client(const std::string& name) {
    return {.goal = write_port<typename A::Goal>(name + "_goal"),
            .decide = write_port<ActionGoal>(name + "_decide"),
            .status = read_port<ActionGoal>(name + "_status"),
            .feedback = read_port<typename A::Feedback>(name + "_feedback"),
            .result = read_port<typename A::Result>(name + "_result")};
  }
  /// A port whose type is known at run time only.
  PortBase& add_port(std::unique_ptr<PortBase> port) { return add(ports_, std::move(port)); }
  EventPort& event_port(std::string name) {
    return add(ports_, std::make_unique<EventPort>(std::move(name)));
  }

  Property<bool>& property(std::string name, bool initial, PropertyOptions options = {}) {
    return add_property(std::move(name), initial, std::move(options));
  }
  Property<double>& property(std::string name, double initial, PropertyOptions options = {}) {
    return add_property(std::move(name), initial, std::move(options));
  }
  Property<std::int64_t>& property(std::string name, std::int64_t initial, PropertyOptions options = {}) {
    return add_property(std::move(name), initial, std::move(options));
  }
  Property<std::int64_t>& property(std::string name, int initial, PropertyOptions options = {}) {
    return add_property(std::move(name), std::int64_t{initial}, std::move(options));
  }
  Property<std::string>& property(std::string name, const char* initial, PropertyOptions options = {}) {
    return add_property(std::move(name), std::string(initial), std::move(options));
  }

 private:
  template <typename T>
  Property<T>& add_property(std::string name, T initial, PropertyOptions options) {
    return add(properties_,
               std::make_unique<Property<T>>(std::move(name), std::move(initial), std::move(options)));
  }
  template <typename Base, typename Item>
  Item& add(std::vector<std::unique_ptr<Base>>& items, std::unique_ptr<Item> item) {
    Item& added = *item;
    check_new(added.name());
    items.push_back(std::move(item));
    return added;
  }
  void check_new(const std::string& name) const;

  const Context* context_{nullptr};
  std::vector<std::unique_ptr<PortBase>> ports_;
  std::vector<std::unique_ptr<PropertyBase>> properties_;
  std::size_t bytes_{0};
};

/// The port with the largest message; default: no port carries one.
struct LargestMessage {
  std::string port;
  std::string type;
  std::size_t bytes{0};
};
/// [non-rt]
LargestMessage largest_message(const Shell& shell);
/// The stack that a thread needs for a core that keeps what it reads and what it writes there. [non-rt]
std::size_t stack_bytes_for(const LargestMessage& largest) noexcept;

/// The shell as the type that a core or an fsm was written for; nullptr: it is another one, or of that name but compiled with
/// other members (its library was loaded anew, and the caller's was not built again). [non-rt]
template <typename ShellType>
ShellType* shell_as(Shell& shell) noexcept {
  const bool is_exact = typeid(shell) == typeid(ShellType);
  if (is_exact && shell.bytes() != 0 && shell.bytes() != sizeof(ShellType)) return nullptr;
  return dynamic_cast<ShellType*>(&shell);
}

}  // namespace mauve
