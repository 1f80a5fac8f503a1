// SPDX-License-Identifier: LGPL-3.0-or-later
// What a run of the model of open changes explores: the architecture, the changes, and the events that may occur.
#pragma once

#include <string_view>
#include <vector>

#include "open_change/state.hpp"
#include "open_change/twins.hpp"

namespace mauve::model::open_change {

/// A change's part in one component.
struct Part {
  bool takes_part{false}, replaces_core{false}, rewires{false}, removes{false}, adds{false}, stops{false};
  bool has_probation{false};
  Ends ends{0};  // of one that rewires: its new connections
};

struct Plan {
  bool exists{false};
  Part parts[kComponents]{};
  bool removes_resource[kResources]{};
};

/// Components, one bit each.
using Set = std::uint8_t;
constexpr bool has(Set set, int i) { return ((set >> i) & 1) != 0; }

struct Scenario {
  std::string_view name{};
  Ends ends[kComponents]{};  // at the start
  Set absent{0}, parked{0};  // at the start
  Plan plans[kChanges]{};
  Set hang{0}, hang_in_adopt{0}, hang_in_take{0}, refuse{0};  // which components may
  Set stop{0}, force{0}, start{0};                            // which components are asked to
  bool shutdown{false}, revert{false};
};

const std::vector<Scenario>& scenarios();
/// The scenario with this name, or none.
const Scenario* find_scenario(std::string_view name);

struct Options {
  Scenario scenario{};
  int horizon{1};  // clocks beyond it are not executed
  Twin twin{Twin::kNone};
  bool checks_order{true};  // of instants; without, a twin shows what follows from a wrong order
  bool take_raises{true};   // `entered`; it holds without, too
  long most_states{150'000'000};
};

}  // namespace mauve::model::open_change
