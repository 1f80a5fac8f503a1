// SPDX-License-Identifier: LGPL-3.0-or-later
// Transactions as Python collects them.
#pragma once

#include <functional>

#include "translate.hpp"

namespace mauve::bindings {

/// Steps that are made into the kernel's when they are committed: each commit has parts of its own. Used under
/// the interpreter's lock only.
class PyTransaction {
 public:
  using Step = std::function<void(Transaction&, const PluginRegistry&)>;

  PyTransaction& add(Step step) {
    steps_.push_back(std::move(step));
    return *this;
  }
  /// Throws Error with the number of the step whose part cannot be made.
  Transaction build(const PluginRegistry& registry) const;

 private:
  std::vector<Step> steps_;
};

}  // namespace mauve::bindings
