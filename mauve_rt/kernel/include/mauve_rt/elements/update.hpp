// SPDX-License-Identifier: LGPL-3.0-or-later
// The most common behaviour, ready made: one method in each period.
#pragma once

#include "mauve_rt/elements/periodic_fsm.hpp"
#include "mauve_rt/elements/shells.hpp"

namespace mauve {

/// A core that is one method; what remains to be written with a common shell and PeriodicUpdateFsm:
///
///   using HalfShell = mauve::FilterShell<Float64>;
///   struct Half : mauve::UpdateCore<HalfShell> {
///     void update() override { shell().output.write({0.5 * shell().input.read().value.data}); }
///   };
///   architecture.add_component<HalfShell, Half, mauve::PeriodicUpdateFsm<HalfShell>>("half");
template <typename ShellType>
class UpdateCore : public Core<ShellType> {
 public:
  /// Called once in each period. [rt] as far as the core is.
  virtual void update() = 0;
};

/// The PSM of one state: `update` in each period, the shell's `period_us`. It takes every UpdateCore of the
/// shell, one for another in flight, and every core in another language that has a method `update`.
template <typename ShellType, typename CoreType = UpdateCore<ShellType>>
class PeriodicUpdateFsm : public PeriodicFsm<ShellType, CoreType> {
 protected:
  void define() override {
    this->period({us_to_ns(this->shell().period_us), "1 * period_us"});
    this->set_initial(this->periodic_state("Update", "update", &CoreType::update));
  }
};

}  // namespace mauve
