// SPDX-License-Identifier: LGPL-3.0-or-later
#include "open_change/scenarios.hpp"

#include <algorithm>

namespace mauve::model::open_change {

namespace {

constexpr Set kA = 1, kB = 2, kC = 4;
constexpr Ends kNoEnds = 0, kReads0 = reads(0), kReads1 = reads(1), kWrites0 = writes(0),
               kWrites1 = writes(1);

constexpr Part kNoPart{};
constexpr Part kNewCore{.takes_part = true, .replaces_core = true};
constexpr Part kNewCoreOnProbation{.takes_part = true, .replaces_core = true, .has_probation = true};
constexpr Part kRemoval{.takes_part = true, .rewires = true, .removes = true};
constexpr Part kStop{.takes_part = true, .stops = true};
constexpr Part rewire(Ends ends) { return {.takes_part = true, .rewires = true, .ends = ends}; }
constexpr Part add(Ends ends) { return {.takes_part = true, .rewires = true, .adds = true, .ends = ends}; }

constexpr Plan kNoPlan{};
constexpr Plan plan(Part a, Part b, Part c) { return {true, {a, b, c}, {}}; }
constexpr Plan plan_without(int resource, Part a, Part b, Part c) {
  return {true, {a, b, c}, {resource == 0, resource == 1}};
}

constexpr Plan kStopsB = plan(kNoPart, kStop, kNoPart), kStopsC = plan(kNoPart, kNoPart, kStop);

std::vector<Scenario> make_scenarios() {
  return {
      // A is late; another change removes the resource that A gets, or the one that it leaves.
      {.name = "LateResourceNew",
       .ends = {kReads0},
       .plans = {plan(rewire(kReads1), kNewCore, kNoPart), plan_without(1, kNoPart, kNoPart, kNoPart)},
       .hang = kA,
       .force = kA},
      {.name = "LateResourceOld",
       .ends = {kReads0},
       .plans = {plan(rewire(kReads1), kNewCore, kNoPart), plan_without(0, kNoPart, kNoPart, kNoPart)},
       .hang = kA,
       .force = kA},
      {.name = "ConnectRemoved",
       .ends = {kReads0},
       .plans = {plan_without(0, rewire(kNoEnds), kNewCore, kNoPart),
                 plan(kNoPart, kNoPart, rewire(kReads0))},
       .hang = kA,
       .force = kA},
      // C is added while A is late.
      {.name = "LateAdded",
       .absent = kC,
       .plans = {plan(kNewCore, kNoPart, add(kWrites0))},
       .hang = kA,
       .stop = kA | kC,
       .force = kA,
       .shutdown = true},
      {.name = "AddedStopped",
       .absent = kC,
       .plans = {plan(kNewCore, kNoPart, add(kWrites0))},
       .hang = kA,
       .stop = kC,
       .force = kA},
      // A is late; the next change is about B, or about both, and a prepared stop of B comes.
      {.name = "Stuck",
       .plans = {plan(kNewCore, kNewCore, kNoPart), plan(kNoPart, kNewCore, kNoPart), kStopsB},
       .hang = kA,
       .hang_in_take = kA,
       .force = kA},
      {.name = "StuckTwo",
       .plans = {plan(kNewCore, kNewCore, kNoPart), plan(kNewCore, kNewCore, kNoPart), kStopsB},
       .hang = kA,
       .force = kA},
      {.name = "RemoveHung",
       .ends = {kReads0},
       .plans = {plan(rewire(kReads1), kNewCore, kNoPart), plan_without(1, kRemoval, kNoPart, kNoPart),
                 kStopsB},
       .hang = kA,
       .hang_in_take = kA,
       .force = kA},
      // A writer's end moves while its owner, or its next owner, is late.
      {.name = "TwoWriters",
       .ends = {kWrites0},
       .plans = {plan(rewire(kWrites1), kNewCore, kNoPart), plan(kNoPart, kNoPart, rewire(kWrites1))},
       .hang = kA,
       .force = kA},
      {.name = "FloorTwoChanges",
       .ends = {kWrites0},
       .plans = {plan(rewire(kNoEnds), kNewCore, kNoPart), plan(kNoPart, kNoPart, rewire(kWrites0))},
       .hang = kA,
       .stop = kA | kC,
       .force = kA | kC},
      {.name = "MovedTwice",
       .ends = {kWrites0},
       .plans = {plan(rewire(kNoEnds), rewire(kWrites0), kNoPart),
                 plan(kNoPart, rewire(kNoEnds), rewire(kWrites0))},
       .hang = kA,
       .hang_in_adopt = kB,
       .stop = kB,
       .force = kA | kB},
      // B is removed, and is asked to stop and to start.
      {.name = "RemovedStarted",
       .ends = {kNoEnds, kWrites0},
       .plans = {plan(kNewCore, kRemoval, kNoPart)},
       .hang = kB,
       .stop = kA | kB,
       .force = kA | kB,
       .start = kB,
       .shutdown = true},
      {.name = "ParkedStarted",
       .ends = {kNoEnds, kWrites0},
       .parked = kB,
       .plans = {plan(kNewCore, kRemoval, kNoPart)},
       .hang = kA,
       .stop = kA,
       .force = kA,
       .start = kB,
       .shutdown = true},
      {.name = "ParkedChanged",
       .ends = {kNoEnds, kWrites0},
       .parked = kB,
       .plans = {plan(kNewCore, kNewCore, kNoPart), plan(kNoPart, rewire(kWrites1), kNoPart)},
       .hang = kA,
       .stop = kB,
       .force = kA,
       .start = kB},
      // B runs on probation while A is late.
      {.name = "Probation",
       .plans = {plan(kNewCore, kNewCoreOnProbation, kNoPart), plan(kNoPart, kNewCore, kNoPart)},
       .hang = kA,
       .stop = kB,
       .force = kA,
       .revert = true},
      // Hooks refuse and hang.
      {.name = "AdoptHung",
       .plans = {plan(kNewCore, kNewCore, kNoPart), kNoPlan, kStopsC},
       .hang_in_adopt = kA | kB,
       .refuse = kA | kB,
       .force = kA | kB,
       .shutdown = true},
      {.name = "AdoptSmall",
       .plans = {plan(kNewCore, kNewCore, kNoPart)},
       .hang_in_adopt = kA | kB,
       .hang_in_take = kA | kB,
       .refuse = kA,
       .force = kA | kB},
      {.name = "HandoverHung",
       .ends = {kNoEnds, kWrites0},
       .plans = {plan(rewire(kWrites0), rewire(kNoEnds), kNoPart)},
       .hang = kA | kB,
       .hang_in_take = kA,
       .stop = kA | kB,
       .force = kA | kB},
      {.name = "MovedBack",
       .ends = {kWrites0},
       .plans = {plan(rewire(kNoEnds), rewire(kWrites0), kNoPart),
                 plan(rewire(kWrites0), rewire(kNoEnds), kNoPart)},
       .hang = kA | kB,
       .hang_in_take = kA,
       .force = kA | kB},
      {.name = "TakeHung",
       .ends = {kWrites0},
       .plans = {plan(rewire(kWrites1), kNewCore, kNoPart)},
       .hang = kA,
       .hang_in_take = kA,
       .stop = kA,
       .force = kA,
       .shutdown = true},
      // Three changes.
      {.name = "UrgentShared",
       .ends = {kNoEnds, kWrites0},
       .plans = {plan(kNewCore, rewire(kWrites1), kNoPart), plan(kNewCore, kNoPart, kNewCore), kStopsB},
       .hang = kA,
       .hang_in_adopt = kA,
       .refuse = kA,
       .force = kA},
      {.name = "Chain",
       .ends = {kWrites0},
       .plans = {plan(rewire(kWrites1), kNewCore, kNoPart), plan(kNoPart, kNoPart, rewire(kWrites0)),
                 kStopsB},
       .hang = kA,
       .hang_in_take = kA,
       .force = kA},
      {.name = "AddThenRemove",
       .absent = kC,
       .plans = {plan(kNewCore, kNoPart, add(kWrites0)), plan_without(0, kNoPart, kNoPart, kRemoval)},
       .hang = kA,
       .stop = kC,
       .force = kA | kC,
       .shutdown = true},
      {.name = "All",
       .ends = {kWrites0},
       .plans = {plan(rewire(kWrites1), kNewCore, kNoPart), plan(kRemoval, kNoPart, rewire(kWrites0)),
                 kStopsB},
       .hang = kA,
       .hang_in_adopt = kA,
       .hang_in_take = kA,
       .refuse = kA,
       .stop = kA,
       .force = kA,
       .shutdown = true},
  };
}

}  // namespace

const std::vector<Scenario>& scenarios() {
  static const std::vector<Scenario> all = make_scenarios();
  return all;
}

const Scenario* find_scenario(std::string_view name) {
  const auto found = std::find_if(scenarios().begin(), scenarios().end(),
                                  [name](const Scenario& scenario) { return scenario.name == name; });
  return found == scenarios().end() ? nullptr : &*found;
}

}  // namespace mauve::model::open_change
