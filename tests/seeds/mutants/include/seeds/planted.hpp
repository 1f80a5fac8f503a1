// SPDX-License-Identifier: LGPL-3.0-or-later
// The switch of a planted fault: which mutant of mutants.yaml this process runs.
#pragma once

#include <type_traits>

namespace mauve::seeds {

/// The number of the mutant; 0: the sources as they are. Set before any thread is made.
inline int planted_number = 0;

/// How often a run came to the place of the mutant; test_mutants shares it with its children.
inline long own_reached = 0;
inline long* reached = &own_reached;

/// The sources that plant.py writes call this function. An expression that the compiler evaluates has no fault.
constexpr bool is_planted(int number) noexcept {
  if (std::is_constant_evaluated() || planted_number != number) return false;
  ++*reached;
  return true;
}

}  // namespace mauve::seeds
