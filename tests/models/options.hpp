// SPDX-License-Identifier: LGPL-3.0-or-later
// What a model run explores: the components, the changes, the events that may occur, and at most one weakening.
#pragma once

namespace mauve::model {

/// A twin: the protocol with one rule left out. Each has to break an invariant, or the rule has no test.
enum class Twin {
  kNone,
  // Weakened cuts.
  kRaiseByStore,
  kRaiseLowers,
  kCloseOverOff,
  kOffOverClosed,
  kInstantIsFrontier,
  // Weakened participants.
  kChooseThenPublish,
  kLooksBeforeNotice,
  kVoteDoesNotRaise,
  kReleaseDoesNotRaise,
  kStopWithoutTake,
  kStopKeepsVote,
  kTakeDoesNotRaise,
  kTakeAtOnce,
  kPassBeforeTake,
  kNoFloor,
  // Weakened requesters.
  kRetireAtClose,
  kSecondOverFirst,
  kTimedOutCountsAsPassed,
  kFreeWithoutRetract,
  kNoWake,
  kClaimDoesNotRaise,
  kParkedDoesNotRaise,
  kStartDuringChange,
  kStartBeforeInstant,
  kParkedIsNotTaken,
  kEpochWithoutRaise,
  kEpochOfEachOne,
  kUrgentWithoutLock,
  // Weakened checked closes.
  kDuesBeforeCut,
  kDueMovesAtRelease,
  kEventWritesNothing,
  kClosesWithoutLook,
  kEventKeepsItsClock,
};

struct Options {
  int components{2};
  int changes{1};       // of two changes of three components, each has component 0 and one other
  int last_instant{4};  // real time and clocks end here

  bool stop{false};      // component 0 is asked to stop
  bool shutdown{false};  // all are asked to stop
  bool hang{false};      // component 0 may hang in an execution or in its adopt, and times out then
  bool lost{false};      // a thread that timed out never comes back
  bool refuse{false};    // each adopt may refuse
  bool event{false};     // the last component waits for events, not for instants
  bool skip{false};      // a late component may skip to the first instant that is not past
  bool remove{false};    // the change removes component 0
  bool moved_writer{
      false};          // the change moves the writer's end of a resource from component 0 to component 1
  bool parked{false};  // component 1 is parked at the start, after an execution at instant 2
  bool start{false};   // a command may start the parked component
  bool start_by_change{false};  // the change starts the parked component
  bool epoch{false};            // the change moves the epoch
  bool idle{false};             // the change is made while no job of a participant is pending
  bool urgent{false};           // the second change calls off the first one while that one is open

  Twin twin{Twin::kNone};
  long most_states{60'000'000};
};

}  // namespace mauve::model
