// SPDX-License-Identifier: LGPL-3.0-or-later
// The protocol of a change holds in every interleaving, and none of its rules can be left out.
// Longer runs, by hand: the program explore_change.
#include <gtest/gtest.h>

#include <ostream>
#include <string>

#include "explorer.hpp"

namespace mauve::model {

struct Configuration {
  const char* name;
  Options options;
  long least_states;  // an exploration that finds fewer has lost a step
};

struct Weakening {
  const char* name;
  Options options;
  const char* violation;
};

void PrintTo(const Configuration& configuration, std::ostream* out) { *out << configuration.name; }
void PrintTo(const Weakening& weakening, std::ostream* out) { *out << weakening.name; }

namespace {

class ChangeModel : public ::testing::TestWithParam<Configuration> {};

TEST_P(ChangeModel, HoldsInEveryInterleaving) {
  const Report report = explore(GetParam().options);
  EXPECT_EQ("", report.violation) << report.trace;
  EXPECT_TRUE(report.is_complete);
  EXPECT_GE(report.states, GetParam().least_states);
  EXPECT_GT(report.made, 0) << "no run makes the change";
  EXPECT_GT(report.off, 0) << "no run calls the change off";
}

INSTANTIATE_TEST_SUITE_P(
    Protocol, ChangeModel,
    ::testing::Values(
        Configuration{"OneParticipant", {.components = 1, .stop = true, .hang = true, .refuse = true}, 7'000},
        Configuration{"TwoParticipants", {}, 50'000},
        Configuration{"Stop", {.last_instant = 3, .stop = true}, 50'000},
        Configuration{"Hang", {.last_instant = 3, .hang = true, .refuse = true}, 30'000},
        Configuration{"Lost", {.last_instant = 3, .hang = true, .lost = true}, 20'000},
        Configuration{"RemovesTheHungOne", {.last_instant = 3, .hang = true, .remove = true}, 30'000},
        Configuration{"EventWait", {.last_instant = 3, .event = true}, 30'000},
        Configuration{"SkipPolicy", {.skip = true}, 50'000},
        Configuration{"MovedWriter", {.moved_writer = true}, 50'000},
        Configuration{"Parked", {.shutdown = true, .hang = true, .parked = true}, 20'000},
        Configuration{"ParkedAndStarted", {.hang = true, .parked = true, .start = true}, 40'000},
        Configuration{
            "StartedByTheChange", {.components = 3, .parked = true, .start_by_change = true}, 50'000},
        Configuration{"Epoch", {.last_instant = 3, .epoch = true}, 30'000},
        Configuration{"EpochAndStart",
                      {.last_instant = 6, .parked = true, .start_by_change = true, .epoch = true},
                      10'000},
        Configuration{"Idle", {.idle = true}, 50'000},
        Configuration{"IdleOfThree", {.components = 3, .last_instant = 2, .idle = true}, 50'000},
        Configuration{"IdleWithEventWait", {.last_instant = 3, .event = true, .idle = true}, 50'000},
        Configuration{
            "IdleWithStopAndHang", {.last_instant = 2, .stop = true, .hang = true, .idle = true}, 30'000},
        Configuration{"IdleWithAParkedOne", {.parked = true, .start = true, .idle = true}, 10'000},
        Configuration{"TwoChanges", {.changes = 2, .last_instant = 1}, 50'000},
        Configuration{"UrgentChange", {.changes = 2, .last_instant = 1, .urgent = true}, 50'000},
        Configuration{"TwoChangesWithAParkedOne",
                      {.changes = 2, .last_instant = 3, .parked = true, .start = true},
                      50'000}),
    [](const auto& info) { return std::string(info.param.name); });

class WeakenedChangeModel : public ::testing::TestWithParam<Weakening> {};

TEST_P(WeakenedChangeModel, Breaks) {
  const Report report = explore(GetParam().options);
  EXPECT_EQ(GetParam().violation, report.violation) << report.states << " states\n" << report.trace;
}

constexpr const char *kEarlyT = "T lies before an execution that had old parts",
                     *kOldFromT = "an execution from T on has old parts",
                     *kNewBeforeT = "an execution before T has new parts",
                     *kNotTaken = "a change is made, but a participant has not taken",
                     *kUsedAfterFree = "a change's record is used after it is freed",
                     *kNoAnswer = "a requester is never answered";

INSTANTIATE_TEST_SUITE_P(
    TwinOfTheCut, WeakenedChangeModel,
    ::testing::Values(Weakening{"RaiseByStore", {.parked = true, .twin = Twin::kRaiseByStore}, kNotTaken},
                      Weakening{"RaiseLowers", {.twin = Twin::kRaiseLowers}, kEarlyT},
                      Weakening{"CloseOverOff", {.twin = Twin::kCloseOverOff}, kNotTaken},
                      Weakening{"OffOverClosed",
                                {.twin = Twin::kOffOverClosed},
                                "a participant takes a change that is not made"},
                      Weakening{"InstantIsFrontier", {.twin = Twin::kInstantIsFrontier}, kEarlyT},
                      Weakening{"ChooseThenPublish", {.twin = Twin::kChooseThenPublish}, kEarlyT}),
    [](const auto& info) { return std::string(info.param.name); });

INSTANTIATE_TEST_SUITE_P(
    TwinOfAParticipant, WeakenedChangeModel,
    ::testing::Values(
        Weakening{"LooksBeforeNotice", {.twin = Twin::kLooksBeforeNotice}, "the notice of a change is lost"},
        Weakening{"VoteDoesNotRaise", {.twin = Twin::kVoteDoesNotRaise}, kEarlyT},
        Weakening{"ReleaseDoesNotRaise", {.parked = true, .twin = Twin::kReleaseDoesNotRaise}, kOldFromT},
        Weakening{"StopWithoutTake", {.hang = true, .twin = Twin::kStopWithoutTake}, kNotTaken},
        Weakening{"StopKeepsVote", {.hang = true, .twin = Twin::kStopKeepsVote}, kNotTaken},
        Weakening{"TakeDoesNotRaise", {.event = true, .twin = Twin::kTakeDoesNotRaise}, kNewBeforeT},
        Weakening{"TakeAtOnce", {.last_instant = 2, .twin = Twin::kTakeAtOnce}, kNewBeforeT},
        Weakening{"PassBeforeTake", {.twin = Twin::kPassBeforeTake}, kUsedAfterFree},
        Weakening{"NoFloor",
                  {.moved_writer = true, .twin = Twin::kNoFloor},
                  "a late old value replaces a new one"}),
    [](const auto& info) { return std::string(info.param.name); });

constexpr const char *kPending = "a job is pending at T",
                     *kOldAfterClose = "a job has old parts after the idle close";

INSTANTIATE_TEST_SUITE_P(
    TwinOfTheCheckedClose, WeakenedChangeModel,
    ::testing::Values(
        Weakening{"DuesBeforeCut", {.idle = true, .twin = Twin::kDuesBeforeCut}, kPending},
        Weakening{"DueMovesAtRelease", {.idle = true, .twin = Twin::kDueMovesAtRelease}, kPending},
        Weakening{"EventWritesNothing",
                  {.last_instant = 3, .event = true, .idle = true, .twin = Twin::kEventWritesNothing},
                  kPending},
        Weakening{"ClosesWithoutLook", {.idle = true, .twin = Twin::kClosesWithoutLook}, kPending},
        Weakening{"EventKeepsItsClock",
                  {.last_instant = 3, .event = true, .idle = true, .twin = Twin::kEventKeepsItsClock},
                  kOldAfterClose}),
    [](const auto& info) { return std::string(info.param.name); });

INSTANTIATE_TEST_SUITE_P(
    TwinOfARequester, WeakenedChangeModel,
    ::testing::Values(
        Weakening{
            "RetireAtClose", {.twin = Twin::kRetireAtClose}, "a participant takes from parts that are freed"},
        Weakening{"SecondOverFirst",
                  {.changes = 2, .last_instant = 2, .twin = Twin::kSecondOverFirst},
                  kUsedAfterFree},
        Weakening{"TimedOutCountsAsPassed",
                  {.hang = true, .twin = Twin::kTimedOutCountsAsPassed},
                  "parts are freed below an execution"},
        Weakening{"FreeWithoutRetract", {.twin = Twin::kFreeWithoutRetract}, kUsedAfterFree},
        Weakening{"NoWake", {.twin = Twin::kNoWake}, kNoAnswer},
        Weakening{
            "ClaimDoesNotRaise", {.hang = true, .remove = true, .twin = Twin::kClaimDoesNotRaise}, kEarlyT},
        Weakening{"ParkedDoesNotRaise", {.parked = true, .twin = Twin::kParkedDoesNotRaise}, kEarlyT},
        Weakening{"ParkedIsNotTaken", {.parked = true, .twin = Twin::kParkedIsNotTaken}, kNotTaken},
        Weakening{"StartDuringChange",
                  {.parked = true, .start = true, .twin = Twin::kStartDuringChange},
                  "a clock is executed twice"},
        Weakening{
            "StartBeforeInstant",
            {.components = 3, .parked = true, .start_by_change = true, .twin = Twin::kStartBeforeInstant},
            kNewBeforeT},
        Weakening{"EpochWithoutRaise",
                  {.epoch = true, .twin = Twin::kEpochWithoutRaise},
                  "the new epoch was past when it was asked for"},
        Weakening{"EpochOfEachOne",
                  {.epoch = true, .twin = Twin::kEpochOfEachOne},
                  "an execution is not on the grid of the new epoch"},
        Weakening{"UrgentWithoutLock",
                  {.changes = 2, .last_instant = 1, .urgent = true, .twin = Twin::kUrgentWithoutLock},
                  kUsedAfterFree}),
    [](const auto& info) { return std::string(info.param.name); });

}  // namespace
}  // namespace mauve::model
