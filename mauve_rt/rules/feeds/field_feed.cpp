// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/base/error.hpp"

#include "feeds/feeds.hpp"

namespace mauve::rules {

namespace {

/// One number of the newest value of a resource: what is there now, and then each write.
///
/// | member             | written by       | read by | under                                       |
/// | ------------------ | ---------------- | ------- | ------------------------------------------- |
/// | resource_, place_  | ordinary threads | writers | no write calls it while they change         |
/// | signal_            | writers          | engine  | the resource's listeners' lock: one at once |
class FieldFeed final : public Feed, private EventListener {
 public:
  FieldFeed(std::string resource, std::string path, Signal& signal, const FeedPlace& place)
      : architecture_(place.architecture),
        clock_(place.clock),
        name_(std::move(resource)),
        path_(std::move(path)),
        signal_(signal) {
    listen(architecture_.hold_resource(name_));
  }
  ~FieldFeed() override { let_go(); }

  void follow() override {
    std::shared_ptr<Resource> present = architecture_.find_resource(name_);
    if (present == resource_) return;
    let_go();
    if (present != nullptr && present->find_number(path_)) listen(std::move(present));
  }

 private:
  void on_event(time_ns_t /*written_ns*/) noexcept override { tell_present(); }
  void tell_present() noexcept {
    double number = 0;
    if (resource_->read_number(place_, number)) signal_.tell(clock_.now_ns(), number);
  }

  void listen(std::shared_ptr<Resource> resource) {
    const std::optional<NumberPlace> found = resource->find_number(path_);
    if (!found) {
      throw Error(ErrorCode::invalid_argument,
                  "the resource has no number there that can be read in real time",
                  {.element = "resource " + name_,
                   .expected = "a field that is a number, bool included, of " + resource->type() +
                               ", not in a text or a list without a bound, of shared_data or latest_value",
                   .found = path_,
                   .remedy = "name a number's field, or ask for it in: supervisor"});
    }
    place_ = *found;
    resource_ = std::move(resource);
    resource_->listen(*this);
    const LockGuard lock(resource_->events_mutex());  // else a write tells the signal at the same time
    tell_present();
  }
  void let_go() noexcept {
    if (resource_ != nullptr) resource_->unlisten(*this);
    resource_ = nullptr;
  }

  Architecture& architecture_;
  const Clock& clock_;
  const std::string name_;
  const std::string path_;
  Signal& signal_;
  std::shared_ptr<Resource> resource_;  // nullptr: it was removed
  NumberPlace place_;
};

}  // namespace

std::unique_ptr<Feed> open_field_feed(const std::string& resource, const std::string& path, Signal& signal,
                                      const FeedPlace& place) {
  return std::make_unique<FieldFeed>(resource, path, signal, place);
}

}  // namespace mauve::rules
