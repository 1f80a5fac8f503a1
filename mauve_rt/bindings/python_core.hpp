// SPDX-License-Identifier: LGPL-3.0-or-later
// Cores written in Python.
#pragma once

#include "python_call.hpp"

namespace mauve::bindings {

/// A core that runs a Python object's methods.
///
/// | member                  | written by                           | read by          | under              |
/// | ----------------------- | ------------------------------------ | ---------------- | ------------------ |
/// | object_, methods_       | prepare; once                        | component's      | interpreter's lock |
/// | cells_, block_, fields_  | prepare, once; component in a commit | prepare, commit  | interpreter's lock |
/// | take_failure_           | component, in the commit             | component        | -                  |
/// | link_'s pointers        | prepare, destructor                  | Python threads   | interpreter's lock |
class PythonCore final : public DynamicCore {
 public:
  explicit PythonCore(std::shared_ptr<PythonObject> factory) : factory_(std::move(factory)) {}
  ~PythonCore() override;

  bool bind_shell(Shell& shell) noexcept override;
  void set_context(const Context* context) noexcept override;
  int find_method(std::string_view name) const override;
  void run(int method) override;
  bool test(int method) override;
  /// The object sees the old core's, or None when that is no Python core.
  bool adopt(const CoreBase& old) override;
  void take(CoreBase& old) noexcept override;
  /// Places in block_, which has the values of the object's attributes only after store_state().
  std::vector<StateField> state_fields() override;
  bool store_state() noexcept override;
  void load_state() noexcept override;
  time_ns_t budget_ns() const noexcept override;

  /// The object of a Python core, else None. Under the interpreter's lock.
  static py::object object_of(const CoreBase& core);

 protected:
  bool configure_hook() override;
  void cleanup_hook() override;

 private:
  void make() const;
  void raise_from_take();
  void note_failure(const std::exception& failure) noexcept;
  const py::object& object() const noexcept { return object_.get(); }

  std::shared_ptr<PythonObject> factory_;
  std::shared_ptr<ShellLink> link_{std::make_shared<ShellLink>()};
  mutable PythonObject object_;              // made at prepare, when shell and context are known
  mutable std::vector<py::object> methods_;  // bound methods by slot
  mutable time_ns_t budget_ns_{0};
  PythonObject cells_;  // mauve_rt.parts.state_fields.StateCells
  std::vector<std::byte> block_;
  std::vector<StateField> fields_;
  std::unique_ptr<std::string> take_failure_;
};

}  // namespace mauve::bindings
