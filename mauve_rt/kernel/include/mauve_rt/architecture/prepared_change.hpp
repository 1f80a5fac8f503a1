// SPDX-License-Identifier: LGPL-3.0-or-later
// PreparedChange: a change that is ready to be committed, as its architecture sees it.
#pragma once

namespace mauve {

/// Both with the architecture's change lock held.
class PreparedChange {
 public:
  virtual ~PreparedChange() = default;
  /// Completes it, if it has been committed and was not yet completed. [non-rt]
  virtual void settle() noexcept = 0;
  /// Lets go of all that it has, if what it was prepared against has changed for good. [non-rt]
  virtual void drop_if_stale() noexcept = 0;
};

}  // namespace mauve
