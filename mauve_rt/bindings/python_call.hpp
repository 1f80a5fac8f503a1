// SPDX-License-Identifier: LGPL-3.0-or-later
// Calls from the kernel into Python. The interpreter's lock is taken here, around the call, and nowhere while
// a priority-inheritance mutex is held.
#pragma once

#include "translate.hpp"

namespace mauve::bindings {

/// A Python object that C++ owns: let go of under the interpreter's lock, wherever its owner ends.
class PythonObject {
 public:
  explicit PythonObject(py::object object = {}) : object_(std::move(object)) {}
  ~PythonObject() { reset(); }
  PythonObject(const PythonObject&) = delete;
  PythonObject& operator=(const PythonObject&) = delete;

  /// Under the interpreter's lock.
  const py::object& get() const noexcept { return object_; }
  void set(py::object object) { object_ = std::move(object); }
  explicit operator bool() const noexcept { return static_cast<bool>(object_); }
  void reset() noexcept {
    if (!object_) return;
    const InterpreterLocked lock;
    object_ = {};
  }

 private:
  py::object object_;
};

/// The kernel's error that a MauveError stands for; of any other exception its text with the traceback.
[[noreturn]] void rethrow(const py::error_already_set& error);
/// The text with the traceback, whatever was raised.
[[noreturn]] void rethrow_as_fault(const py::error_already_set& error);

/// Runs a call into Python whose exception refuses something; what comes out holds no Python object.
template <typename Call>
auto in_python(Call&& call) {
  const InterpreterLocked lock;
  try {
    return unless_interpreter_ends(call);
  } catch (const py::error_already_set& error) {
    rethrow(error);
  }
}

/// Runs a call into Python whose exception is a fault.
template <typename Call>
auto on_component(Call&& call) {
  const InterpreterLocked lock;
  try {
    return unless_interpreter_ends(call);
  } catch (const py::error_already_set& error) {
    rethrow_as_fault(error);
  }
}

/// Calls a hook that says no by returning False.
bool call_hook(const py::object& object, const char* name);

py::bytes to_bytes(const std::vector<std::byte>& message);

/// What a Python object may still reach of its component; its pointers are read and cleared under the
/// interpreter's lock, so that an object kept longer than its component finds nothing rather than a ruin.
struct ShellLink {
  Shell* shell{nullptr};
  const Context* context{nullptr};
  const LogSource* resource_log{nullptr};  // of a resource, which has neither of the others

  const LogSource* log() const noexcept { return context != nullptr ? &context->log : resource_log; }
};

/// What Python sees of a shell: ports by name, properties, the logical clock.
class ShellView {
 public:
  explicit ShellView(std::shared_ptr<ShellLink> link) : link_(std::move(link)) {}

  const std::shared_ptr<ShellLink>& link() const noexcept { return link_; }

  ReadMessage read(const std::string& name) const;
  bool write(const std::string& name, const py::bytes& data) const;
  std::pair<std::string, std::string> frames(const std::string& name) const;
  py::object call(const std::string& name, const py::args& args, const py::kwargs& kwargs) const;
  py::bytes request(const std::string& name, const py::bytes& data) const;
  void raise_event(const std::string& name) const;
  py::object property(const std::string& name) const;
  Duration times(std::int64_t factor, const std::string& property) const;
  std::vector<PortDescription> ports() const {
    const Shell& described = shell();
    const InterpreterUnlocked release;  // ports have locks of their own
    return describe_ports(described);
  }
  std::vector<PropertyDescription> properties() const { return describe_properties(shell()); }
  time_ns_t clock() const;
  time_ns_t period() const;
  /// The shell's Python object, or None when it is written in C++.
  Typed<"mauve_rt.parts.shells.Shell | None"> python() const;
  std::string implementation() const { return shell().implementation(); }

 private:
  Shell& shell() const;
  PortBase& require_port(const std::string& name, PortKind kind) const;

  std::shared_ptr<ShellLink> link_;
};

/// A shell whose ports and properties a Python object declares.
class PythonShell final : public Shell {
 public:
  PythonShell(const PartFactory& factory, const PluginRegistry& registry);
  ~PythonShell() override;

  const py::object& object() const noexcept { return object_.get(); }
  /// The clock that the object tells. [setup]
  void show_clock(const Context* context) { link_->context = context; }

  using Shell::add_port;
  using Shell::event_port;
  using Shell::property;

 protected:
  bool configure_hook() override;
  void cleanup_hook() override;

 private:
  std::shared_ptr<ShellLink> link_;
  PythonObject object_;
};

}  // namespace mauve::bindings
