// SPDX-License-Identifier: LGPL-3.0-or-later
// OpenChange: a change that is prepared and not committed, or committed and not completed, as its architecture sees it.
#pragma once

#include <string>

namespace mauve {

class Task;

/// All with the architecture's change lock held.
class OpenChange {
 public:
  virtual ~OpenChange() = default;
  /// Completes the change if it was committed, all its components have taken it, and it was not completed yet. Whether it is
  /// completed. [non-rt]
  virtual bool settle() noexcept = 0;
  /// Lets go of all that it has, if what it was prepared against has changed for good. [non-rt]
  virtual void drop_if_stale() noexcept {}
  /// A component that has not taken it yet; nullptr: there is none. [non-rt]
  virtual const Task* find_late() const noexcept { return nullptr; }
  /// Whether it has added a component or resource of that name, which is not listed before the change is completed. [non-rt]
  virtual bool has_added(const std::string& name) const noexcept = 0;
};

}  // namespace mauve
