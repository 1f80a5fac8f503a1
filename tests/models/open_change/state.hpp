// SPDX-License-Identifier: LGPL-3.0-or-later
// One state of the model of open changes: each thread's next step, the table of the architecture, and each change.
#pragma once

#include <cstdint>
#include <type_traits>

#include "mauve_rt/run/cut.hpp"

namespace mauve::model::open_change {

inline constexpr int kComponents = 3, kResources = 2;
/// Two ordinary changes, and the urgent one: a stop that was prepared beforehand.
inline constexpr int kChanges = 3, kUrgent = 2;

/// Connections of a component: one bit each.
using Ends = std::uint8_t;
constexpr Ends reads(int resource) { return static_cast<Ends>(1 << resource); }
constexpr Ends writes(int resource) { return static_cast<Ends>(4 << resource); }
constexpr Ends both(int resource) { return static_cast<Ends>(reads(resource) | writes(resource)); }

/// What a component's thread does next.
enum class Step : std::uint8_t {
  kWaiting,
  kAdopting,   // runs the adopt of its core
  kAdoptHung,  // an adopt that does not end
  kVoting,     // raises the cut and counts its vote
  kClosing,    // has counted the last vote
  kTaking,     // puts the new parts in
  kTakeHung,   // a take that does not end
  kExecuting,
  kHung,       // an execution that does not end
  kReturning,  // was condemned, and its hook or execution has ended
  kParked,     // sleeps until it is started
  kUnstarted,  // a change adds it: it sleeps until its take, which is its start
  kEnded,
};
/// Where a thread goes when it has left its slot.
enum class After : std::uint8_t { kWait, kExecute, kStayParked, kPark, kFault, kStayUnstarted };
enum class Slot : std::uint8_t { kEmpty, kPosted, kBusy };

/// What a requester does next.
enum class Request : std::uint8_t {
  kNone,  // the scenario has no such change
  kDrafting,
  kInstalling,
  kPressed,  // of a twin only: has called off the open changes
  kPosting,  // installed; of a twin a step of its own
  kDeciding,
  kPublishing,  // of a twin only: is about to put a made change into the table
  kPassing,     // waits for the participants' passes
  kRetracting,  // off: empties the slots
  kAnswered,
};
enum class Answer : std::uint8_t { kUnknown, kMade, kStale, kRefused, kCalledOff, kLate };

enum class Shutdown : std::uint8_t {
  kNone,
  kListedTooEarly,  // of a twin only: has the list, and the gate is not closed yet
  kGateClosed,
  kAllDecided,
  kListed,
  kStopping,
  kAnswered,
};
enum class Probation : std::uint8_t { kNone, kRunning, kReverted, kEndedByTake };
/// The newest value of a resource.
enum class Value : std::uint8_t {
  kSafe,
  kCommand,     // of the component `commander`
  kHandedOver,  // of a component that lost the writer's end
};

struct Component {
  Step step;
  After after;
  Slot slot;
  std::uint8_t slot_change;            // whose record, unless the slot is empty
  std::uint8_t clock;                  // in a wait the pending instant, in an execution the current one
  std::uint8_t last;                   // ghost: the last clock that was executed
  std::uint8_t entered;                // a vote raises the cut to this clock
  Ends ends;                           // the connections that its thread has
  std::uint8_t core;                   // 0: the first one; else 1 + the change that brought it
  std::uint8_t taken;                  // bits: the changes that it has taken
  std::uint8_t gained_at[kResources];  // T of each writer's end that it has
  std::uint8_t owner[kResources];      // ghost: its number among the owners of the writer's end
  bool voted, stop, start, was_started, was_asked_to_stop;
  bool condemned, claimed, abandoned, removed;
  bool is_lost;  // ghost: its hook never ends

  bool is_at(int change) const { return slot != Slot::kEmpty && slot_change == change; }
  bool has_taken(int change) const { return ((taken >> change) & 1) != 0; }
  /// Its thread exists and may run user code.
  bool is_alive() const { return step != Step::kEnded && step != Step::kUnstarted; }
  /// It runs, and neither stands still nor was condemned.
  bool can_run() const {
    const bool rests = after == After::kStayParked || after == After::kStayUnstarted;
    return step <= Step::kReturning && !condemned && !rests;
  }
  bool hangs() const { return step == Step::kHung || step == Step::kTakeHung || step == Step::kAdoptHung; }
};

struct Change {
  Request step;
  Answer answer;
  std::uint8_t word;  // the bits of a CutWord: model clocks are small
  std::uint8_t to_vote, to_pass;
  std::uint8_t drafted_for[kComponents];  // the versions that its draft has seen
  std::uint8_t owner[kResources];         // ghost: the number of the owner that it gives the writer's end to
  bool moves_writer[kResources];          // ghost: of a made one
  bool is_published, is_freed;

  CutWord cut() const { return {word}; }
  int instant() const { return static_cast<int>(cut().instant_ns()); }
  int frontier() const { return static_cast<int>(cut().frontier_ns()); }
};

/// What the architecture consists of, for each reader. It changes by the fold of a made change.
struct Table {
  bool has_component[kComponents], has_resource[kResources];
  Ends ends[kComponents];
  std::uint8_t version[kComponents];  // grows with each change but a mere stop
  std::uint8_t since[kComponents];    // T of the last change
  std::uint8_t resource_since[kResources];
  bool has_changed;
};

struct Resource {
  Value value;
  std::uint8_t commander;     // of a command: the component that wrote it
  std::uint8_t floor;         // older stamps are dropped
  std::uint8_t owners;        // ghost: how often a made change gave the writer's end away
  std::uint8_t newest_owner;  // ghost: the number of the owner that wrote the value
  bool is_retired;
};

struct State {
  Table table;
  Resource resources[kResources];
  Component components[kComponents];
  Change changes[kChanges];
  std::uint8_t old_core_freed[kComponents];  // bits: by which change the old core was put out
  Shutdown shutdown;
  std::uint8_t shutdown_list;  // bits: components
  Probation probation;
};
static_assert(std::has_unique_object_representations_v<State>, "states are compared by their bytes");

}  // namespace mauve::model::open_change
