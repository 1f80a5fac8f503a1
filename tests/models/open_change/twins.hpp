// SPDX-License-Identifier: LGPL-3.0-or-later
// The twins of the model of open changes: the protocol with one rule left out.
#pragma once

namespace mauve::model::open_change {

/// Each has to break an invariant, or the rule has no test.
enum class Twin {
  kNone,
  // The table.
  kPublishedWhenAllPassed,
  kPublishedByRequester,
  kLookDoesNotFold,  // only the requester folds, after the decision
  kWritersCountedByThreads,
  kVersionsNotCompared,
  // Exclusion.
  kClaimsUntilAllPassed,
  kClaimsBeforeSlotsAreFree,
  kNoClaimsOfResources,
  kUrgentWaitsForOpen,
  kUrgentStaleByAnyChange,
  kUrgentPressesOnce,  // an ordinary change that is installed afterwards makes it stale
  kOnlyRequesterEmptiesSlot,
  kAnswerWaitsForBusySlot,
  // The order of instants.
  kCutStartsAtZero,
  kSameInstantAllowed,
  kRemovalOfHungIgnoresSince,
  // Owners of a writer's end.
  kFloorOnlyInSameChange,
  kSafeOutputPassesFloor,
  kSafeOutputByPresentEnds,  // a take that hangs has none
  kSafeOutputByTakenEnds,
  kSafeOutputByOwnClock,
  kSafeOutputInTakeAtT,  // also of an end that the take gives away
  kCondemnedWrites,
  // Retirement.
  kRetiredByRemoverAlone,
  kRetiredUnderCondemned,
  kRecordFreedAtAnswer,
  kOldCoreFreedOnProbation,
  // Removal, start and stop.
  kLeavingNotListed,
  kAbandonedTakes,
  kStartBeforeSlot,
  kRemovedMayStart,
  kStopOfUnstartedForgotten,
  kRevertLeavesOpenChange,
  kProbationKnownWhenAllPassed,
  // Shutdown.
  kShutdownListsBeforeGate,
  kShutdownByNames,
  kShutdownLeavesSlots,
  kTwins,
};

constexpr const char* kTwinNames[] = {
    "the protocol",
    "a change is published when all have passed",
    "a change is published by its requester, after the decision",
    "a look at the table does not fold first",
    "writers are counted by the ends that threads have",
    "versions are not compared",
    "claims are kept until all have passed",
    "claims come before the slots are empty",
    "open changes do not exclude each other by resources",
    "an urgent change waits for an open one",
    "an urgent change is stale after any change",
    "an urgent change calls off open changes once",
    "only the requester empties a slot whose change is off",
    "the answer waits for a busy slot",
    "a cut starts at 0",
    "a later change may have the same instant",
    "the removal of a hung component ignores since",
    "a floor only where the same change moves the end",
    "a safe output passes the floor",
    "safe outputs through present ends only",
    "safe outputs through taken ends only",
    "a safe output has the stamp of the own clock",
    "safe outputs in a take have the stamp T",
    "a condemned component writes",
    "a resource is retired when its remover has passed",
    "retirement does not count a condemned thread",
    "the record is freed at the answer",
    "the old core is freed on probation",
    "a leaving component is not listed",
    "an abandoned thread takes",
    "a start does not look at the slot",
    "a removed component may be started",
    "a stop of an unstarted component is forgotten",
    "a revert leaves an open change",
    "a probation is known when all have passed",
    "a shutdown lists before it closes the gate",
    "a shutdown goes by names",
    "a shutdown does not wait for slots",
};
static_assert(sizeof kTwinNames / sizeof *kTwinNames == static_cast<unsigned>(Twin::kTwins));

}  // namespace mauve::model::open_change
