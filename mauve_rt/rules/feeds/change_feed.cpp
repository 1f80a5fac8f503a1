// SPDX-License-Identifier: LGPL-3.0-or-later
#include <utility>

#include "feeds/feeds.hpp"

namespace mauve::rules {

namespace {

/// Changes of the architecture, its starts, stops and faults among them, as they are followed.
class ChangeFeed final : public Feed {
 public:
  ChangeFeed(Signal& signal, const FeedPlace& place)
      : architecture_(place.architecture),
        clock_(place.clock),
        signal_(signal),
        seen_(architecture_.revision()) {}

  void follow() override {
    const std::uint64_t revision = architecture_.revision();
    if (revision != std::exchange(seen_, revision))
      signal_.tell(clock_.now_ns(), static_cast<double>(revision));
  }

 private:
  Architecture& architecture_;
  const Clock& clock_;
  Signal& signal_;
  std::uint64_t seen_;
};

}  // namespace

std::unique_ptr<Feed> open_change_feed(Signal& signal, const FeedPlace& place) {
  return std::make_unique<ChangeFeed>(signal, place);
}

}  // namespace mauve::rules
