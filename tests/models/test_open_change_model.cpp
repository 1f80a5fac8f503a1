// SPDX-License-Identifier: LGPL-3.0-or-later
// Changes that stay open hold in every interleaving, and none of the protocol's rules can be left out.
// Longer runs, by hand: the program explore_open_change.
#include <gtest/gtest.h>

#include <ostream>
#include <set>
#include <string>

#include "open_change/explorer.hpp"

namespace mauve::model::open_change {

struct Exploration {
  const char* scenario;
  long least_states;  // an exploration that finds fewer has lost a step
};

struct Weakening {
  const char* name;
  Twin twin;
  const char* scenario;
  const char* violation;
  int horizon{1};
  bool checks_order{true};
};

void PrintTo(const Exploration& exploration, std::ostream* out) { *out << exploration.scenario; }
void PrintTo(const Weakening& weakening, std::ostream* out) { *out << weakening.name; }

namespace {

class OpenChangeModel : public ::testing::TestWithParam<Exploration> {};

TEST_P(OpenChangeModel, HoldsInEveryInterleaving) {
  const Scenario* const scenario = find_scenario(GetParam().scenario);
  ASSERT_NE(nullptr, scenario);
#ifdef __SANITIZE_ADDRESS__
  constexpr long kSmall =
      300'000;  // the same code in each: a sanitizer finds in millions of states what it finds in these
  if (GetParam().least_states > kSmall) GTEST_SKIP() << "explored without a sanitizer";
#endif
  const Report report = explore({.scenario = *scenario});
  EXPECT_EQ("", report.violation) << report.trace;
  EXPECT_TRUE(report.is_complete);
  EXPECT_GE(report.states, GetParam().least_states);
  EXPECT_GT(report.made, 0) << "no run makes a change";
  EXPECT_GT(report.off, 0) << "no run calls a change off";
}

// Without "All": by hand, 40 million states (9 GB, 3 minutes) are not all of it, and break nothing.
INSTANTIATE_TEST_SUITE_P(
    Protocol, OpenChangeModel,
    ::testing::Values(Exploration{"LateResourceNew", 20'000}, Exploration{"LateResourceOld", 15'000},
                      Exploration{"ConnectRemoved", 80'000}, Exploration{"LateAdded", 100'000},
                      Exploration{"AddedStopped", 4'000}, Exploration{"Stuck", 600'000},
                      Exploration{"StuckTwo", 550'000}, Exploration{"RemoveHung", 450'000},
                      Exploration{"TwoWriters", 80'000}, Exploration{"FloorTwoChanges", 500'000},
                      Exploration{"MovedTwice", 350'000}, Exploration{"RemovedStarted", 1'500'000},
                      Exploration{"ParkedStarted", 250'000}, Exploration{"ParkedChanged", 250'000},
                      Exploration{"Probation", 250'000}, Exploration{"AdoptHung", 3'000'000},
                      Exploration{"AdoptSmall", 15'000}, Exploration{"HandoverHung", 100'000},
                      Exploration{"MovedBack", 200'000}, Exploration{"TakeHung", 250'000},
                      Exploration{"UrgentShared", 1'700'000}, Exploration{"Chain", 300'000},
                      Exploration{"AddThenRemove", 800'000}),
    [](const auto& info) { return std::string(info.param.scenario); });

class WeakenedOpenChangeModel : public ::testing::TestWithParam<Weakening> {};

TEST_P(WeakenedOpenChangeModel, Breaks) {
  const Scenario* const scenario = find_scenario(GetParam().scenario);
  ASSERT_NE(nullptr, scenario);
  const Report report = explore({.scenario = *scenario,
                                 .horizon = GetParam().horizon,
                                 .twin = GetParam().twin,
                                 .checks_order = GetParam().checks_order});
  EXPECT_EQ(GetParam().violation, report.violation) << report.states << " states\n" << report.trace;
}

constexpr const char *kNotListed = "a component that can run is not listed",
                     *kOtherParts = "adopts from parts that are not the ones it was drafted for",
                     *kWrongOrder =
                         "of two changes with a common element the later has not the later instant",
                     *kOldOverNew = "an old writer's value takes the place of a newer writer's",
                     *kStopWaits = "a prepared stop of an innocent component waits for another one",
                     *kUsesRetired = "a thread uses a resource that is retired",
                     *kStillCommands = "a component that is stopped, ended or condemned still commands",
                     *kFormerCommand = "the owner is condemned, and a former owner's command stands",
                     *kRunsOn = "a component's thread runs on after shutdown",
                     *kRemovedStarts = "a removed component starts";

const Weakening kWeakenings[] = {
    // The table.
    {"PublishedWhenAllPassed", Twin::kPublishedWhenAllPassed, "LateAdded", kNotListed},
    {"PublishedByRequester", Twin::kPublishedByRequester, "LateAdded", kNotListed},
    {"LookDoesNotFold", Twin::kLookDoesNotFold, "LateAdded", kNotListed},
    {"InstallDoesNotFold", Twin::kLookDoesNotFold, "Stuck", kWrongOrder},
    {"InstallDoesNotFoldAndAdopts", Twin::kLookDoesNotFold, "Stuck", kOtherParts, 1, false},
    {"WritersCountedByThreads", Twin::kWritersCountedByThreads, "TwoWriters", kOldOverNew, 2},
    {"VersionsNotCompared", Twin::kVersionsNotCompared, "Probation", kOtherParts},
    // Exclusion.
    {"ClaimsUntilAllPassed", Twin::kClaimsUntilAllPassed, "Stuck", kStopWaits},
    {"ClaimsBeforeSlotsAreFree", Twin::kClaimsBeforeSlotsAreFree, "StuckTwo",
     "innocents are claimed while their change waits for a late one"},
    {"NoClaimsOfResources", Twin::kNoClaimsOfResources, "ConnectRemoved",
     "a published component is connected to a removed resource"},
    {"UrgentWaitsForOpen", Twin::kUrgentWaitsForOpen, "Stuck", kStopWaits},
    {"UrgentStaleByAnyChange", Twin::kUrgentStaleByAnyChange, "Stuck",
     "a prepared stop of an innocent component was not made"},
    {"UrgentPressesOnce", Twin::kUrgentPressesOnce, "Stuck",
     "a prepared stop of an innocent component was not made"},
    {"OnlyRequesterEmptiesSlot", Twin::kOnlyRequesterEmptiesSlot, "StuckTwo", kStopWaits},
    {"AnswerWaitsForBusySlot", Twin::kAnswerWaitsForBusySlot, "AdoptSmall", "a requester is never answered"},
    // The order of instants.
    {"CutStartsAtZero", Twin::kCutStartsAtZero, "FloorTwoChanges", kWrongOrder},
    {"CutStartsAtZeroAndWrites", Twin::kCutStartsAtZero, "Chain", kOldOverNew, 1, false},
    {"SameInstantAllowed", Twin::kSameInstantAllowed, "MovedBack", kOldOverNew},
    {"RemovalOfHungIgnoresSince", Twin::kRemovalOfHungIgnoresSince, "RemoveHung", kWrongOrder},
    // Owners of a writer's end.
    {"FloorOnlyInSameChange", Twin::kFloorOnlyInSameChange, "FloorTwoChanges", kOldOverNew},
    {"SafeOutputPassesFloor", Twin::kSafeOutputPassesFloor, "FloorTwoChanges", kOldOverNew},
    {"SafeOutputByPresentEnds", Twin::kSafeOutputByPresentEnds, "TakeHung", kStillCommands},
    {"SafeOutputByTakenEnds", Twin::kSafeOutputByTakenEnds, "HandoverHung", kFormerCommand},
    {"SafeOutputByOwnClock", Twin::kSafeOutputByOwnClock, "MovedTwice", kFormerCommand},
    {"SafeOutputInTakeAtT", Twin::kSafeOutputInTakeAtT, "HandoverHung", kOldOverNew},
    {"CondemnedWrites", Twin::kCondemnedWrites, "TakeHung", kStillCommands},
    // Retirement.
    {"RetiredByRemoverAlone", Twin::kRetiredByRemoverAlone, "LateResourceOld", kUsesRetired},
    {"RetiredUnderCondemned", Twin::kRetiredUnderCondemned, "RemoveHung", kUsesRetired},
    {"RecordFreedAtAnswer", Twin::kRecordFreedAtAnswer, "AdoptSmall",
     "a thread is in a record that is freed"},
    {"OldCoreFreedOnProbation", Twin::kOldCoreFreedOnProbation, "Probation",
     "a revert puts in a core that is freed"},
    // Removal, start and stop.
    {"LeavingNotListed", Twin::kLeavingNotListed, "RemovedStarted", kNotListed},
    {"AbandonedTakes", Twin::kAbandonedTakes, "RemoveHung", "a removed resource is never retired"},
    {"StartBeforeSlot", Twin::kStartBeforeSlot, "ParkedStarted", kRemovedStarts},
    {"RemovedMayStart", Twin::kRemovedMayStart, "RemovedStarted", kRemovedStarts},
    {"StopOfUnstartedForgotten", Twin::kStopOfUnstartedForgotten, "AddedStopped",
     "a component runs on after its stop"},
    {"RevertLeavesOpenChange", Twin::kRevertLeavesOpenChange, "Probation", kOtherParts},
    {"ProbationKnownWhenAllPassed", Twin::kProbationKnownWhenAllPassed, "Probation",
     "a component runs on probation, and its revert is refused"},
    // Shutdown.
    {"ShutdownListsBeforeGate", Twin::kShutdownListsBeforeGate, "LateAdded", kRunsOn},
    {"ShutdownByNames", Twin::kShutdownByNames, "LateAdded", kRunsOn},
    {"ShutdownLeavesSlots", Twin::kShutdownLeavesSlots, "ParkedStarted", kRunsOn},
};

INSTANTIATE_TEST_SUITE_P(Twin, WeakenedOpenChangeModel, ::testing::ValuesIn(kWeakenings),
                         [](const auto& info) { return std::string(info.param.name); });

TEST(WeakenedOpenChangeModel, HasACaseOfEachTwin) {
  std::set<Twin> twins{Twin::kNone};
  for (const Weakening& weakening : kWeakenings) twins.insert(weakening.twin);
  EXPECT_EQ(static_cast<std::size_t>(Twin::kTwins), twins.size());
}

// The table's `since` gives the later instant, whether a take raises `entered` or not.
TEST(OpenChange, HoldsWithoutARaiseByTheTake) {
  const Report report = explore({.scenario = *find_scenario("Chain"), .take_raises = false});
  EXPECT_EQ("", report.violation) << report.trace;
  EXPECT_TRUE(report.is_complete);
}

}  // namespace
}  // namespace mauve::model::open_change
