// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/base/error.hpp"
#include "mauve_rt/data/action_client.hpp"
#include "mauve_rt/data/action_server.hpp"

#include "feeds/feeds.hpp"

namespace mauve::rules {

namespace {

/// The goals of a server or a client: whether the last one failed, or which one executes since when.
///
/// | member    | written by       | read by  | under                                       |
/// | --------- | ---------------- | -------- | ------------------------------------------- |
/// | resource_ | ordinary threads | writers  | no write calls it while it changes          |
/// | signal_   | writers          | engine   | the resource's listeners' lock: one at once |
class GoalFeed final : public Feed, private EventListener {
 public:
  GoalFeed(std::string resource, bool is_of_end, Signal& signal, const FeedPlace& place)
      : architecture_(place.architecture),
        clock_(place.clock),
        name_(std::move(resource)),
        is_of_end_(is_of_end),
        signal_(signal) {
    std::shared_ptr<Resource> present = architecture_.hold_resource(name_);
    if (!has_goals(*present)) {
      throw Error(ErrorCode::invalid_argument, "the resource has no goals",
                  {.element = "resource " + name_,
                   .expected = "an action_server or an action_client",
                   .found = present->kind(),
                   .remedy = "name the resource of an action"});
    }
    listen(std::move(present));
  }
  ~GoalFeed() override { let_go(); }

  void follow() override {
    std::shared_ptr<Resource> present = architecture_.find_resource(name_);
    if (present == resource_) return;
    const bool was_there = resource_ != nullptr;
    let_go();
    if (present != nullptr && has_goals(*present)) {
      listen(std::move(present));
    } else if (was_there && !is_of_end_) {
      signal_.tell(clock_.now_ns(), 0);  // no goal executes
    }
  }

 private:
  static bool has_goals(Resource& resource) noexcept {
    return resource.action_server() != nullptr || resource.action_client() != nullptr;
  }

  void on_event(time_ns_t /*time_ns*/) noexcept override { tell_present(); }
  void on_decision(time_ns_t /*time_ns*/) noexcept override { tell_present(); }
  void tell_present() noexcept {
    const ActionServerBase* const server = resource_->action_server();
    const GoalsNow goals = server != nullptr ? server->goals_now() : resource_->action_client()->goals_now();
    const time_ns_t now_ns = clock_.now_ns();
    if (is_of_end_) {
      signal_.tell(now_ns, goals.is_aborted ? 1 : 0);
    } else {
      signal_.tell(goals.executing != 0 ? std::min(now_ns, goals.accepted_ns) : now_ns, goals.executing);
    }
  }

  void listen(std::shared_ptr<Resource> resource) {
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
  const bool is_of_end_;
  Signal& signal_;
  std::shared_ptr<Resource> resource_;  // nullptr: it was removed
};

}  // namespace

std::unique_ptr<Feed> open_goal_feed(const std::string& resource, const std::string& detail, Signal& signal,
                                     const FeedPlace& place) {
  return std::make_unique<GoalFeed>(resource, detail == "aborted", signal, place);
}

}  // namespace mauve::rules
