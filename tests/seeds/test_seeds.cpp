// SPDX-License-Identifier: LGPL-3.0-or-later
// The kernel under the seeded scheduler: many seeds of a scenario, and one seed twice.
// MAUVE_SEEDS asks for so many seeds of all scenarios together, MAUVE_TWICE for so many that run twice, MAUVE_SEED for the first of them, MAUVE_SEED_TRACE for a file with the calls of that one.
#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <map>

#include "mauve_rt/base/seam/sleep.hpp"

#include "forked_run.hpp"
#include "scenarios.hpp"

namespace mauve::testing::test_seeds {

using seeds::Findings;
using seeds::Run;

std::uint64_t asked(const char* variable, std::uint64_t otherwise) {
  const std::string text = seeds::variable(variable);
  return text.empty() ? otherwise : std::stoull(text);
}

/// Deploys two components, lets them run, shuts down.
void deploy_two(std::uint64_t /*seed*/, Findings& findings) {
  {
    Architecture architecture;
    for (const char* name : {"first", "second"})
      architecture.add_component<TestShell, TestCore, TestFsm>(name, {.priority = 40});
    architecture.configure();
    Deployer deployer(architecture);
    deployer.deploy();
    sleep_for(ms_to_ns(50));
    deployer.shutdown();
    for (const char* name : {"first", "second"}) {
      const int runs = architecture.component(name).core_as<TestCore>().runs.load();
      findings.expect(runs >= 2, std::string(name) + " ran " + std::to_string(runs) + " times");
    }
  }
  seeds::expect_threads_end(findings, ms_to_ns(1));
}

/// Two threads lock two mutexes, each in its own order.
void lock_crosswise(std::uint64_t /*seed*/, Findings& /*findings*/) {
  Mutex one;
  Mutex other;
  OrdinaryThread thread([&] {
    const LockGuard first(one);
    const LockGuard second(other);
  });
  {
    const LockGuard first(other);
    const LockGuard second(one);
  }
  thread.join();
}

/// At least one, which MAUVE_SEED names.
template <typename Scenario>
void run_seeds(const Scenario& scenario, std::uint64_t percent) {
  const std::uint64_t first = asked("MAUVE_SEED", 1);
  const std::uint64_t count = (asked("MAUVE_SEEDS", 2'000) * percent + 99) / 100;
  std::map<std::string, std::int64_t> counts;
  for (std::uint64_t seed = first; seed < first + count; ++seed) {
    const Run run = run_forked(scenario, seed);
    for (const auto& [what, times] : run.counts) counts[what] += times;
    EXPECT_TRUE(run.is_good()) << "seed " << seed << ", status " << run.status << "\n" << run.text;
  }
  for (const auto& [what, times] : counts)
    std::printf("%12lld %s\n", static_cast<long long>(times), what.c_str());
}

/// Leaves other addresses and other rubbish in free memory to the next run.
void disturb_heap() {
  std::vector<std::string> kept;
  for (std::size_t length = 8; length < 5000; length += 24) {
    const std::string freed(length, 'r');
    kept.emplace_back(length, 'k');
  }
}

template <typename Scenario>
void run_twice(const Scenario& scenario, std::uint64_t seed) {
  const std::string file = seeds::variable("MAUVE_SEED_TRACE");
  const Run one = run_forked(scenario, seed, file);
  disturb_heap();
  const Run other = run_forked(scenario, seed, file.empty() ? "" : file + ".again");
  EXPECT_EQ(0, one.status);
  EXPECT_GT(one.outcome.calls, 0U);
  EXPECT_EQ(one.outcome, other.outcome) << "seed " << seed << " does not give the same run twice";
  EXPECT_EQ(one.text, other.text);
}

template <typename Scenario>
void run_twice(const Scenario& scenario) {
  const std::uint64_t first = asked("MAUVE_SEED", 1);
  const std::uint64_t end =
      first + asked("MAUVE_TWICE", std::min<std::uint64_t>(20, asked("MAUVE_SEEDS", 20)));
  for (std::uint64_t seed = first; seed < end; ++seed) run_twice(scenario, seed);
}

TEST(SeededScheduler, FindsADeadlockAndFindsItAgain) {
  std::uint64_t seed = 1;
  while (seed < 1000 && run_forked(lock_crosswise, seed).status == 0) ++seed;
  ASSERT_LT(seed, 1000U);
  EXPECT_EQ(SIGABRT, WTERMSIG(run_forked(lock_crosswise, seed).status));
}

TEST(SeedsOfADeployment, GiveTheSameRunTwice) { run_twice(deploy_two); }
TEST(SeedsOfADeployment, EndEachRun) { run_seeds(deploy_two, 1); }

class SeedsOf : public ::testing::TestWithParam<SeedScenario> {};

TEST_P(SeedsOf, GiveTheSameRunTwice) { run_twice(GetParam().run); }
TEST_P(SeedsOf, KeepTheRules) { run_seeds(GetParam().run, GetParam().percent); }

INSTANTIATE_TEST_SUITE_P(All, SeedsOf, ::testing::ValuesIn(kScenarios),
                         [](const auto& tested) { return std::string(tested.param.name); });

}  // namespace mauve::testing::test_seeds
