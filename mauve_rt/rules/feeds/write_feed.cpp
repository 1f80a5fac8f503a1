// SPDX-License-Identifier: LGPL-3.0-or-later
#include "feeds/feeds.hpp"

namespace mauve::rules {

namespace {

/// The writes to a resource, or also the messages that have arrived for it, by the clock of who receives them: what a writer
/// says of its time counts for nothing.
///
/// | member    | written by       | read by | under                                        |
/// | --------- | ---------------- | ------- | -------------------------------------------- |
/// | resource_ | ordinary threads | the same | one thread at a time                        |
/// | signal_   | writers          | engine   | the resource's listeners' lock: one at once |
class WriteFeed final : public Feed, private EventListener {
 public:
  WriteFeed(std::string resource, Heard what, Signal& signal, const FeedPlace& place)
      : architecture_(place.architecture),
        clock_(place.clock),
        name_(std::move(resource)),
        what_(what),
        signal_(signal),
        resource_(architecture_.hold_resource(name_)) {
    resource_->listen(*this);
  }
  ~WriteFeed() override { let_go(); }

  void follow() override {
    const std::shared_ptr<Resource> present = architecture_.find_resource(name_);
    if (present == resource_) return;
    let_go();
    resource_ = present;
    if (resource_ != nullptr) resource_->listen(*this);
  }

 private:
  void on_event(time_ns_t /*written_ns*/) noexcept override { signal_.tell(clock_.now_ns(), 0); }
  void on_arrival(time_ns_t /*arrived_ns*/) noexcept override {
    if (what_ == Heard::writes_and_arrivals) signal_.tell(clock_.now_ns(), 0);
  }
  void on_caught_up(time_ns_t until_ns) noexcept override { signal_.set_reported_until(until_ns); }

  void let_go() noexcept {
    if (resource_ != nullptr) resource_->unlisten(*this);
    signal_.set_reported_until(kForever);  // nobody writes it now
  }

  Architecture& architecture_;
  const Clock& clock_;
  const std::string name_;
  const Heard what_;
  Signal& signal_;
  std::shared_ptr<Resource> resource_;  // nullptr: it was removed
};

}  // namespace

std::unique_ptr<Feed> open_write_feed(const std::string& resource, Heard what, Signal& signal,
                                      const FeedPlace& place) {
  return std::make_unique<WriteFeed>(resource, what, signal, place);
}

}  // namespace mauve::rules
