// SPDX-License-Identifier: LGPL-3.0-or-later
// One state of the model: every thread's next step, and every word that threads share.
#pragma once

#include <cstdint>
#include <type_traits>

#include "mauve_rt/run/cut.hpp"

namespace mauve::model {

inline constexpr int kMostComponents = 3, kMostChanges = 2;

/// What a component's thread does next. Each is one atomic operation on a shared word.
enum class Step : std::uint8_t {
  kWaiting,       // wakes up when it is notified, or for a release
  kNoticed,       // has taken the notice, is about to look at its slot
  kLooked,        // of a twin only: has found its slot empty, is about to take the notice
  kAdopting,      // runs the adopt of its core
  kAdoptHung,     // an adopt that does not end
  kVoting,        // raises the cut by its last clock
  kCounting,      // counts its vote
  kClosing,       // has counted the last vote
  kIdleLooking,   // all have voted: looks at the cut, then at each participant
  kIdleScanning,  // looks whether participant `at` has a job pending
  kIdleClosing,   // closes the cut if it is the one that it saw
  kPublishing,    // of a twin only: has chosen T, has not published it
  kLooking,       // looks at the cut, in its wait
  kTaking,        // puts the new parts in
  kPassing,       // counts that it has taken
  kClearing,      // empties its slot
  kRaising,       // raises the cut by the clock of its release
  kBeginning,     // begins an execution
  kExecuting,
  kHung,           // an execution that does not end
  kParking,        // is about to say that it is parked
  kLookingParked,  // has said so, looks at its slot once more
  kCallingOff,     // calls the change off, because it parks or because its adopt refused
  kParked,         // sleeps until it is started
  kClaimed,        // hung, timed out, and voted for by the requester that removes it
  kEnded,          // was removed
};
/// Where a component's thread goes once it has emptied its slot.
enum class After : std::uint8_t { kWait, kExecute, kPark };

/// Which thread uses the record of the change in a component's slot.
enum class Slot : std::uint8_t {
  kEmpty,
  kPosted,   // none; the component's thread may become busy, the requester may withdraw
  kBusy,     // the component's thread
  kClaimed,  // the requester, in the place of a parked component
};

/// What a requester does next.
enum class Request : std::uint8_t {
  kAwaiting,    // waits until no earlier change is in a slot of its participants
  kUrgentCall,  // of a twin only: has found an earlier change, is about to call it off
  kLocking,     // locks the participants' command mutexes
  kPosting,     // posts the change to participant `at`
  kNotifying,   // wakes participant `at`, or claims its slot if it is parked
  kVotingFor,   // raises the cut by the last clock of participant `at`, which is parked or claimed
  kCountingFor,
  kClosingFor,
  kDeciding,    // sleeps until the change is decided, or until its own time is up
  kRetracting,  // off: empties the slots
  kWaking,      // closed: wakes participant `at`, or takes in its place if it is parked
  kTakenFor,    // has taken for participant `at`
  kPassing,     // sleeps until all have taken
  kAnswered,    // has answered; keeps the record for a participant that timed out
  kFreed,       // has answered and freed everything
};

struct Component {
  Step step;
  After after;
  std::uint8_t clock;    // in a wait the pending instant, in an execution the current one
  std::uint8_t last;     // ghost: the last clock that was executed
  std::uint8_t entered;  // by which a vote raises: the last clock executed, or T - 1 of the last change
  std::uint8_t chosen;   // of a twin only: a T that is not published
  std::uint8_t seen;     // the bits of the cut that it looks for an idle instant at
  std::uint8_t at;       // participant
  Slot slot;
  std::uint8_t slot_change;   // whose record, unless the slot is empty
  std::uint8_t mutex_holder;  // of the command mutex: 0, or 1 + change
  bool voted, notified, stop, timed_out, started;
  bool has_new[kMostChanges];

  bool is_at(int change) const { return slot != Slot::kEmpty && slot_change == change; }
  bool is_parked() const { return step == Step::kLookingParked || step == Step::kParked; }
  bool has_come_to_rest() const {
    return step == Step::kWaiting || step == Step::kParked || step == Step::kEnded;
  }
  /// A thread that does not execute may sleep here; everywhere else it goes on without waiting for anybody.
  bool may_rest() const {
    return has_come_to_rest() || step == Step::kHung || step == Step::kAdoptHung || step == Step::kClaimed;
  }
};

struct Change {
  std::uint8_t word;  // the bits of a CutWord: model clocks are small
  std::uint8_t to_vote, to_pass;
  Request step;
  std::uint8_t at;            // participant
  std::uint8_t requested_at;  // ghost, of a change of epoch
  bool record_freed, old_freed, kept, has_pressed;

  CutWord cut() const { return {word}; }
  int instant() const { return static_cast<int>(cut().instant_ns()); }
  int frontier() const { return static_cast<int>(cut().frontier_ns()); }
};

struct State {
  std::uint8_t now;      // real time
  std::uint8_t earlier;  // ghost: 1 + the change that was posted first to the component that both change
  bool has_floor;        // of the resource whose writer's end moves: drops old values from now on
  bool newest_is_new;    // of that resource: a new value is in it
  Component components[kMostComponents];
  Change changes[kMostChanges];
};
static_assert(std::has_unique_object_representations_v<State>, "states are compared by their bytes");

}  // namespace mauve::model
