// SPDX-License-Identifier: LGPL-3.0-or-later
// OpenChange: a change from its draft to the end of what it has put out, as its architecture sees it.
#pragma once

namespace mauve {

class Task;

/// All with the architecture's change lock held.
class OpenChange {
 public:
  virtual ~OpenChange() = default;
  /// Settles the part of each component that has taken the change, or retires one that was called off and that a thread had not
  /// left by then. Whether nothing is left to be done. [non-rt]
  virtual bool settle() noexcept = 0;
  /// Lets go of all that it has, if what it was prepared against has changed for good. [non-rt]
  virtual void drop_if_stale() noexcept {}
  /// A component that has not taken it yet, of those that it was made of; nullptr: there is none. [non-rt]
  virtual const Task* find_late() const noexcept { return nullptr; }
};

}  // namespace mauve
