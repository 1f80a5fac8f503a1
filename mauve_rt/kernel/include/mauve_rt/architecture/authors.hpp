// SPDX-License-Identifier: LGPL-3.0-or-later
// Who made each element of an architecture what it is.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "mauve_rt/base/seam/mutex.hpp"

namespace mauve {

/// An element that was changed since its file or program made it, and by whom.
struct Authored {
  std::string target;  // a component or resource
  std::string
      element;  // core, fsm, shell, state, property NAME, port NAME; empty: the target itself, there or removed
  std::string author;  // as Transaction::by() says
  bool operator==(const Authored&) const = default;
};

/// The authors of changes, by element.
///
/// | member    | written by            | guarded by |
/// | --------- | --------------------- | ---------- |
/// | `by_`     | who commits a change  | `mutex_`   |
class Authors {
 public:
  /// Of the last change of an element; an empty author is the file or program, of which nothing is kept. [non-rt]
  void note(const std::string& target, const std::string& element, const std::string& author);
  /// Of a target that is gone, with all its elements. [non-rt]
  void forget(const std::string& target);
  /// Empty: the file or program. [non-rt]
  std::string of(const std::string& target, const std::string& element) const;
  /// Sorted by target and element. [non-rt]
  std::vector<Authored> all() const;

 private:
  mutable Mutex mutex_;
  std::map<std::pair<std::string, std::string>, std::string> by_ MAUVE_GUARDED_BY(mutex_);
};

}  // namespace mauve
