// SPDX-License-Identifier: LGPL-3.0-or-later
#include "change/kept_waits.hpp"

#include <map>
#include <optional>
#include <string>

#include "mauve_rt/base/error.hpp"

namespace mauve {

namespace {

using Places = std::map<std::string, std::optional<time_ns_t>>;

constexpr const char* kReplaceRemedy = "replace fsm and core without probation";

time_ns_t place_of(time_ns_t end_ns, time_ns_t period_ns) noexcept {
  return period_ns != 0 ? end_ns % period_ns : 0;
}

/// Of each wait: where it ends within a period; none for a wait that lies in no cycle with the initial state.
Places places_of(const FsmBase& fsm, time_ns_t period_ns) {
  const std::map<const State*, time_ns_t> ends_ns = wait_ends_ns(fsm.initial());
  Places places;
  for (const auto& state : fsm.states()) {
    if (!state->is_wait) continue;
    const auto end = ends_ns.find(state.get());
    places[state->name] =
        end != ends_ns.end() ? std::optional(place_of(end->second, period_ns)) : std::nullopt;
  }
  return places;
}

std::string place_text(const std::optional<time_ns_t>& place_ns) {
  if (!place_ns) return "no fixed place: the wait lies in no cycle with the initial state";
  return "an end " + std::to_string(*place_ns) + " ns after the period's begin";
}

void require_no_events(const FsmBase& fsm, const char* which) {
  for (const auto& state : fsm.states()) {
    if (state->event == nullptr) continue;
    throw Error(ErrorCode::bad_fsm, "an fsm that waits for events cannot be on probation",
                {.element = std::string(which) + " " + fsm.description(),
                 .expected = "waits for a length of time only",
                 .found = "the event wait " + state->name,
                 .remedy = kReplaceRemedy});
  }
}

/// Every wait of one fsm is at the same place in the other one.
void require_same_places(const Places& of, const Places& in, const char* which) {
  for (const auto& [name, place_ns] : of) {
    const auto same = in.find(name);
    if (same != in.end() && place_ns && same->second == place_ns) continue;
    throw Error(ErrorCode::bad_fsm, "an fsm on probation and the old fsm need the same waits",
                {.element = "wait " + name,
                 .expected = "in the " + std::string(which) + " fsm " + place_text(place_ns),
                 .found = same != in.end() ? place_text(same->second) : "no wait of that name",
                 .remedy = kReplaceRemedy});
  }
}

}  // namespace

std::vector<KeptWait> kept_waits(const FsmBase& before, const FsmBase& now, time_ns_t period_ns) {
  std::vector<KeptWait> kept;
  const std::map<const State*, time_ns_t> ends_ns = wait_ends_ns(now.initial());
  for (const auto& old : before.states()) {
    if (!old->is_wait) continue;
    for (const auto& [wait, end_ns] : ends_ns) {
      if (wait->name != old->name || (wait->event == nullptr) != (old->event == nullptr)) continue;
      kept.push_back({old.get(), wait, place_of(end_ns, period_ns)});
    }
  }
  return kept;
}

void require_places_kept(const FsmBase& before, time_ns_t period_before_ns, const FsmBase& now,
                         time_ns_t period_ns) {
  require_no_events(before, "the old");
  require_no_events(now, "the new");
  if (period_before_ns != period_ns) {
    throw Error(ErrorCode::bad_period, "an fsm on probation and the old fsm need the same period",
                {.element = "period of " + now.description(),
                 .expected = std::to_string(period_before_ns) + " ns",
                 .found = std::to_string(period_ns) + " ns",
                 .remedy = kReplaceRemedy});
  }
  const Places places_before = places_of(before, period_before_ns);
  const Places places_now = places_of(now, period_ns);
  require_same_places(places_before, places_now, "new");
  require_same_places(places_now, places_before, "old");
}

}  // namespace mauve
