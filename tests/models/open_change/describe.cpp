// SPDX-License-Identifier: LGPL-3.0-or-later
// A state of the model as one line of text, for traces.
#include <string>

#include "open_change/model.hpp"

namespace mauve::model::open_change {

namespace {

constexpr const char* kSteps[] = {"Waiting", "Adopting",  "AdoptHung", "Voting", "Closing",
                                  "Taking",  "TakeHung",  "Executing", "Hung",   "Returning",
                                  "Parked",  "Unstarted", "Ended"};
constexpr const char* kRequests[] = {"None",     "Drafting",   "Installing", "Pressed",    "Posting",
                                     "Deciding", "Publishing", "Passing",    "Retracting", "Answered"};
constexpr const char* kSlots[] = {"empty", "posted", "busy"};
constexpr const char* kValues[] = {"safe", "command", "handed over"};

std::string flag(bool is_set, const char* name) { return is_set ? std::string(" ") + name : std::string(); }

std::string text(const Component& component, int i) {
  std::string line = std::string(" | ") + static_cast<char>('A' + i) + " " +
                     kSteps[static_cast<int>(component.step)] + " clock " + std::to_string(component.clock) +
                     " ends " + std::to_string(component.ends) + " slot " +
                     kSlots[static_cast<int>(component.slot)];
  if (component.slot != Slot::kEmpty) line += " of X" + std::to_string(component.slot_change);
  for (int k = 0; k < kChanges; ++k) {
    if (component.has_taken(k)) line += " has" + std::to_string(k);
  }
  return line + flag(component.voted, "voted") + flag(component.stop, "stop") +
         flag(component.start, "start") + flag(component.condemned, "condemned") +
         flag(component.claimed, "claimed") + flag(component.abandoned, "abandoned") +
         flag(component.removed, "removed");
}

std::string text(const Change& change, int k) {
  const CutWord cut = change.cut();
  return " | X" + std::to_string(k) + " " + kRequests[static_cast<int>(change.step)] +
         (cut.is_closed() ? " CLOSED"
          : cut.is_off()  ? " OFF"
                          : " open") +
         " frontier " + std::to_string(change.frontier()) + flag(change.is_published, "published");
}

std::string text(const Resource& resource, int r) {
  return " | R" + std::to_string(r) + " " + kValues[static_cast<int>(resource.value)] + " floor " +
         std::to_string(resource.floor) + flag(resource.is_retired, "retired");
}

}  // namespace

std::string Model::describe(const State& state) const {
  std::string line = "shutdown " + std::to_string(static_cast<int>(state.shutdown));
  for (int i = 0; i < kComponents; ++i) line += text(state.components[i], i);
  for (int k = 0; k < kChanges; ++k) {
    if (exists(k)) line += text(state.changes[k], k);
  }
  for (int r = 0; r < kResources; ++r) line += text(state.resources[r], r);
  return line;
}

}  // namespace mauve::model::open_change
