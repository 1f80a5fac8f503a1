// SPDX-License-Identifier: LGPL-3.0-or-later
#include "feeds/feeds.hpp"

#include <charconv>
#include <utility>

#include "mauve_rt/base/error.hpp"

#include "feeds/component_feed.hpp"

namespace mauve::rules {

namespace {

/// "wake_up 1000000": what is late, and from how many ns on.
std::pair<Befalls, time_ns_t> late_of(const std::string& detail) {
  const std::size_t space = detail.find(' ');
  const std::string what = detail.substr(0, space);
  time_ns_t bound_ns = 0;
  const char* const end = detail.data() + detail.size();
  const bool is_bound =
      space != std::string::npos && std::from_chars(detail.data() + space + 1, end, bound_ns).ptr == end;
  if (!is_bound || (what != "wake_up" && what != "response")) {
    throw Error(
        ErrorCode::invalid_argument, "a signal of what is late says what, and from how many ns on",
        {.element = "detail", .expected = "wake_up or response, and a number", .found = "'" + detail + "'"});
  }
  return {what == "wake_up" ? Befalls::late_wakeup : Befalls::late_response, bound_ns};
}

[[noreturn]] void refuse(const std::string& what) {
  throw Error(ErrorCode::invalid_argument, "an executor's own rules cannot receive " + what,
              {.remedy = "give the rule `in: supervisor`"});
}

}  // namespace

Feeds::Feeds(FeedPlace place) : place_(std::move(place)) {}

Feeds::~Feeds() = default;

void Feeds::open(const SignalSpec& spec, Signal& signal) {
  switch (spec.kind) {
    case SignalKind::message:
      feeds_[&signal] = open_write_feed(resource_of(spec.target), Heard::writes, signal, place_);
      return;
    case SignalKind::write:
      feeds_[&signal] = open_write_feed(spec.target, Heard::writes, signal, place_);
      return;
    case SignalKind::arrival:
      feeds_[&signal] = open_write_feed(resource_of(spec.target), Heard::writes_and_arrivals, signal, place_);
      return;
    case SignalKind::field: {
      const auto topic = place_.topics.find(spec.target);
      const std::string& resource = topic != place_.topics.end() ? topic->second : spec.target;
      feeds_[&signal] = open_field_feed(resource, spec.detail, signal, place_);
      return;
    }
    case SignalKind::change:
      if (spec.target.empty()) {
        feeds_[&signal] = open_change_feed(signal, place_);
        return;
      }
      break;
    case SignalKind::node:
      node_.push_back(&signal);
      return;
    case SignalKind::goal:
      feeds_[&signal] = open_goal_feed(spec.target, spec.detail, signal, place_);
      return;
    case SignalKind::peer:
      refuse("of another executor (" + spec.target + ")");
    case SignalKind::diagnostic:
      refuse("of a diagnostic (" + spec.target + ")");
    case SignalKind::overruns:
    case SignalKind::late:
    case SignalKind::release:
    case SignalKind::state:
    case SignalKind::over_declared:
      break;
  }
  open_component(spec, signal);
}

void Feeds::open_component(const SignalSpec& spec, Signal& signal) {
  auto found = components_.find(spec.target);
  if (found == components_.end())
    found = components_.emplace(spec.target, std::make_unique<ComponentFeed>(spec.target, place_)).first;
  ComponentFeed* const feed = found->second.get();
  switch (spec.kind) {
    case SignalKind::overruns:
      return feed->add(Befalls::overrun, signal);
    case SignalKind::release:
      return feed->add(Befalls::release, signal);
    case SignalKind::state:
      return feed->add(Befalls::state, signal);
    case SignalKind::over_declared:
      return feed->add(Befalls::over_declared, signal);
    case SignalKind::late: {
      const auto [what, bound_ns] = late_of(spec.detail);
      return feed->add(what, signal, bound_ns);
    }
    default:
      return feed->add(Befalls::change, signal);
  }
}

const std::string& Feeds::resource_of(const std::string& topic) const {
  const auto found = place_.topics.find(topic);
  if (found == place_.topics.end()) {
    throw Error(ErrorCode::unknown_resource, "no resource of the architecture is bound to the topic",
                {.element = "topic " + topic,
                 .remedy = "bind one to it (subscribe: in its section), or give the rule `in: supervisor`"});
  }
  return found->second;
}

void Feeds::beat() noexcept {
  for (Signal* signal : node_) signal->tell(place_.clock.now_ns());
}

void Feeds::close(const Signal& signal) {
  feeds_.erase(&signal);
  std::erase(node_, &signal);
  for (const auto& [name, feed] : components_) feed->remove(signal);
  std::erase_if(components_, [](const auto& each) { return !each.second->hears_anything(); });
}

void Feeds::follow() {
  for (const auto& [signal, feed] : feeds_) feed->follow();
  for (const auto& [name, feed] : components_) feed->follow();
}

}  // namespace mauve::rules
