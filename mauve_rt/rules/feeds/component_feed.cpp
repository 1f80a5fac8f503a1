// SPDX-License-Identifier: LGPL-3.0-or-later
#include "feeds/component_feed.hpp"

#include <algorithm>
#include <utility>

#include "mauve_rt/base/error.hpp"

namespace mauve::rules {

namespace {

constexpr double kNoPeriod =
    1e6;  // s: of one that lost its period while it was listened to, no release is missed

double seconds(time_ns_t duration_ns) noexcept { return static_cast<double>(duration_ns) * 1e-9; }

}  // namespace

ComponentFeed::ComponentFeed(std::string component, const FeedPlace& place)
    : architecture_(place.architecture), clock_(place.clock), name_(std::move(component)) {
  listen(architecture_.hold_component(name_));
}

ComponentFeed::~ComponentFeed() { let_go(); }

void ComponentFeed::add(Befalls what, Signal& signal, time_ns_t bound_ns) {
  std::shared_ptr<Component> component = component_;
  if (what == Befalls::release && component->task().grid().period_ns == 0) {
    throw Error(ErrorCode::out_of_range, "the component has no period: none of its releases can be missed",
                {.component = name_, .remedy = "ask for a component with a period, or for silence"});
  }
  let_go();
  told_.push_back({.what = what, .signal = &signal, .bound_ns = bound_ns});
  listen(std::move(component));
}

void ComponentFeed::remove(const Signal& signal) {
  const auto is_it = [&](const Told& told) { return told.signal == &signal; };
  if (std::none_of(told_.begin(), told_.end(), is_it)) return;
  std::shared_ptr<Component> component = component_;
  let_go();
  std::erase_if(told_, is_it);
  if (component != nullptr) listen(std::move(component));
}

void ComponentFeed::follow() {
  std::shared_ptr<Component> present = architecture_.find_component(name_);
  if (present != component_) {
    let_go();
    if (present != nullptr) {
      listen(std::move(present));
    } else {
      on_state(clock_.now_ns(), ComponentState::unconfigured);  // there is none that runs
    }
  }
  if (component_ == nullptr) return;
  Task& task = component_->task();
  if (const time_ns_t period_ns = task.grid().period_ns; period_ns != 0)
    period_s_.store(seconds(period_ns), std::memory_order_relaxed);
  const std::uint32_t change = task.changes().word.load(std::memory_order_acquire);
  if (change != std::exchange(seen_change_, change))
    tell(Befalls::change, clock_.now_ns(), static_cast<double>(change));
}

// ---- told by the component, and who commands it

void ComponentFeed::on_late_wakeup(time_ns_t now_ns, time_ns_t late_ns) noexcept {
  tell(Befalls::release, now_ns, period_s_.load(std::memory_order_relaxed));
  count(Befalls::late_wakeup, now_ns, late_ns);
}

void ComponentFeed::on_late_response(time_ns_t now_ns, time_ns_t response_ns) noexcept {
  count(Befalls::late_response, now_ns, response_ns);
}

void ComponentFeed::on_over_declared(time_ns_t now_ns) noexcept { count(Befalls::over_declared, now_ns, 0); }

void ComponentFeed::on_overrun(time_ns_t now_ns, std::uint64_t overruns) noexcept {
  tell(Befalls::overrun, now_ns, static_cast<double>(overruns));
}

void ComponentFeed::on_state(time_ns_t now_ns, ComponentState state) noexcept {
  tell(Befalls::state, now_ns, static_cast<double>(state));
}

void ComponentFeed::tell(Befalls what, time_ns_t now_ns, double value) noexcept {
  for (const Told& told : told_) {
    if (told.what == what) told.signal->tell(now_ns, value);
  }
}

void ComponentFeed::count(Befalls what, time_ns_t now_ns, time_ns_t measured_ns) noexcept {
  for (Told& told : told_) {
    if (told.what == what && measured_ns >= told.bound_ns)
      told.signal->tell(now_ns, static_cast<double>(++told.count));
  }
}

// ---- to listen

bool ComponentFeed::hears(Befalls what) const {
  return std::any_of(told_.begin(), told_.end(), [&](const Told& told) { return told.what == what; });
}

time_ns_t ComponentFeed::earliest(Befalls what) const {
  time_ns_t least_ns = kForever;
  for (const Told& told : told_) {
    if (told.what == what) least_ns = std::min(least_ns, told.bound_ns);
  }
  return least_ns;
}

/// What is so before anything befalls it.
void ComponentFeed::begin(const Task& task) {
  const time_ns_t now_ns = clock_.now_ns();
  const time_ns_t period_ns = task.grid().period_ns;
  period_s_.store(period_ns != 0 ? seconds(period_ns) : kNoPeriod, std::memory_order_relaxed);
  const time_ns_t released_ns = task.released_ns();
  tell(Befalls::release, released_ns != 0 ? released_ns : now_ns, period_s_.load(std::memory_order_relaxed));
  on_overrun(now_ns, task.statistics().overruns.load(std::memory_order_relaxed));
  on_state(now_ns, task.state());
}

void ComponentFeed::listen(std::shared_ptr<Component> component) {
  Task& task = component->task();
  seen_change_ = task.changes().word.load(std::memory_order_acquire);
  const time_ns_t late_ns = hears(Befalls::release) ? INT64_MIN : earliest(Befalls::late_wakeup);
  for (;;) {
    const ComponentState state = task.state();
    begin(task);  // before anybody else tells
    if (!task.listening().listen(*this, late_ns, earliest(Befalls::late_response))) {
      throw Error(ErrorCode::out_of_range, "other rules listen to the component already",
                  {.component = name_, .remedy = "have one set of rules for an architecture"});
    }
    if (task.state() == state) break;
    task.listening().unlisten();  // it changed just before: nobody may have told
  }
  component_ = std::move(component);
}

void ComponentFeed::let_go() noexcept {
  if (component_ != nullptr) component_->task().listening().unlisten();
  component_ = nullptr;
}

}  // namespace mauve::rules
