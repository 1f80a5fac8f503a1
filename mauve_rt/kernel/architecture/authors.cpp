// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/architecture/authors.hpp"

namespace mauve {

void Authors::note(const std::string& target, const std::string& element, const std::string& author) {
  const LockGuard lock(mutex_);
  if (author.empty()) {
    by_.erase({target, element});
  } else {
    by_.insert_or_assign({target, element}, author);
  }
}

void Authors::forget(const std::string& target) {
  const LockGuard lock(mutex_);
  std::erase_if(by_, [&target](const auto& entry) { return entry.first.first == target; });
}

std::string Authors::of(const std::string& target, const std::string& element) const {
  const LockGuard lock(mutex_);
  const auto found = by_.find({target, element});
  return found != by_.end() ? found->second : "";
}

std::vector<Authored> Authors::all() const {
  const LockGuard lock(mutex_);
  std::vector<Authored> found;
  found.reserve(by_.size());
  for (const auto& [element, author] : by_)
    found.push_back({.target = element.first, .element = element.second, .author = author});
  return found;
}

}  // namespace mauve
