// SPDX-License-Identifier: LGPL-3.0-or-later
// The scenarios of the seeds: test_seeds runs each of them, test_mutants runs all of them with each seed.
#pragma once

#include <array>
#include <cstdint>

#include "forked_run.hpp"
#include "random_architecture.hpp"
#include "random_bridge.hpp"
#include "random_commands.hpp"
#include "random_data.hpp"
#include "random_ends.hpp"
#include "random_idle.hpp"
#include "random_rules.hpp"
#include "random_words.hpp"

namespace mauve::testing {

struct SeedScenario {
  const char* name;
  void (*run)(std::uint64_t seed, seeds::Findings& findings);
  std::uint64_t percent;  // of all seeds: those that take less time have more
};

inline constexpr std::array kScenarios = std::to_array<SeedScenario>({
    {"random_architecture", random_architecture, 10},
    {"random_bridge", random_bridge, 5},
    {"random_commands", random_commands, 34},
    {"random_data", random_data, 4},
    {"random_ends", random_ends, 10},
    {"random_idle", random_idle, 5},
    {"random_meetings", random_meetings, 25},
    {"random_rules", random_rules, 4},
    {"random_words", random_words, 3},
});

}  // namespace mauve::testing
