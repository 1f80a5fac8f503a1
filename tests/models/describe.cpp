// SPDX-License-Identifier: LGPL-3.0-or-later
// A state of the model as one line of text, for traces.
#include <string>

#include "model.hpp"

namespace mauve::model {

namespace {

constexpr const char* kSteps[] = {
    "Waiting",       "Noticed",     "Looked",       "Adopting",    "AdoptHung",  "Voting",  "Counting",
    "Closing",       "IdleLooking", "IdleScanning", "IdleClosing", "Publishing", "Looking", "Taking",
    "Passing",       "Clearing",    "Raising",      "Beginning",   "Executing",  "Hung",    "Parking",
    "LookingParked", "CallingOff",  "Parked",       "Claimed",     "Ended"};
constexpr const char* kRequests[] = {"Awaiting",  "UrgentCall",  "Locking",    "Posting",  "Notifying",
                                     "VotingFor", "CountingFor", "ClosingFor", "Deciding", "Retracting",
                                     "Waking",    "TakenFor",    "Passing",    "Answered", "Freed"};
constexpr const char* kSlots[] = {"empty", "posted", "busy", "claimed"};

std::string flag(bool is_set, const char* name) { return is_set ? std::string(" ") + name : std::string(); }

std::string text(const Component& component, int i) {
  return " | C" + std::to_string(i) + " " + kSteps[static_cast<int>(component.step)] + " clock " +
         std::to_string(component.clock) + " entered " + std::to_string(component.entered) + " slot " +
         kSlots[static_cast<int>(component.slot)] + flag(component.voted, "voted") +
         flag(component.stop, "stop") + flag(component.timed_out, "timed_out") +
         flag(component.has_new[0], "has0") + flag(component.has_new[1], "has1");
}

std::string text(const Change& change, int k) {
  const CutWord cut = change.cut();
  return " | X" + std::to_string(k) + " " + kRequests[static_cast<int>(change.step)] + " at " +
         std::to_string(change.at) +
         (cut.is_closed() ? " CLOSED"
          : cut.is_off()  ? " OFF"
                          : " open") +
         " frontier " + std::to_string(change.frontier()) + " to vote " + std::to_string(change.to_vote) +
         " to pass " + std::to_string(change.to_pass);
}

}  // namespace

std::string Model::describe(const State& state) const {
  std::string line = "now " + std::to_string(state.now);
  for (int i = 0; i < options_.components; ++i) line += text(state.components[i], i);
  for (int k = 0; k < options_.changes; ++k) line += text(state.changes[k], k);
  return line;
}

}  // namespace mauve::model
