// SPDX-License-Identifier: LGPL-3.0-or-later
// configure() / cleanup() with overridable hooks.
#pragma once

#include <memory>
#include <string>
#include <utility>

#include "mauve_rt/base/class_builds.hpp"
#include "mauve_rt/base/rt.hpp"

namespace mauve {

/// Something that is configured before use and cleaned up after. All functions [non-rt].
class Configurable {
 public:
  virtual ~Configurable() = default;
  Configurable() = default;
  Configurable(const Configurable&) = delete;
  Configurable& operator=(const Configurable&) = delete;

  bool is_configured() const noexcept { return configured_; }

  /// Runs the hook; does nothing when already configured. [non-rt]
  /// Throws Error (configure_failed) with the reason and stays unconfigured when the hook throws or returns
  /// false.
  virtual void configure();
  /// Runs the cleanup hook if configured. [non-rt] Throws Error when it cannot be cleaned up now; nothing was done then.
  virtual void cleanup();

  /// What messages call this object, e.g. "core mauve_examples/Guidance".
  virtual std::string description() const = 0;

 protected:
  /// Allocate and check here; false or an exception means that it failed.
  virtual bool configure_hook() { return true; }
  /// Throws Error when cleaning up would take something away from who still uses it.
  virtual void check_cleanup() const {}
  /// Give back what configure_hook took.
  virtual void cleanup_hook() {}

 private:
  bool configured_{false};
};

/// A shell, core, fsm or resource. Override configure_hook() and cleanup_hook(). configure() and cleanup() are final: a part
/// that overrides one of them by mistake does not compile.
class ConfigurablePart : public Configurable {
 public:
  /// As of the base. [non-rt]
  void configure() final { Configurable::configure(); }
  void cleanup() final { Configurable::cleanup(); }

  /// Of the code that it was made by: 1 as the process found it first, more of code that was loaded anew (PluginRegistry). [rt]
  int generation() const MAUVE_RT { return generation_; }
  /// [setup]
  void set_generation(int generation) noexcept { generation_ = generation; }
  /// nullptr: no library registered the part, so all its classes are of the program itself. [rt]
  const ClassBuilds* class_builds() const MAUVE_RT { return class_builds_.get(); }
  /// [setup]
  void set_class_builds(std::shared_ptr<const ClassBuilds> builds) noexcept {
    class_builds_ = std::move(builds);
  }

 private:
  int generation_{1};
  std::shared_ptr<const ClassBuilds> class_builds_;
};

}  // namespace mauve
