// SPDX-License-Identifier: LGPL-3.0-or-later
// A scenario of the seeds: what has just begun ends at any moment, and no thread misses its end.
#pragma once

#include <memory>
#include <string>
#include <utility>

#include "mauve_rt/base/seam/ordinary_thread.hpp"
#include "mauve_rt/base/seam/sleep.hpp"
#include "mauve_rt/rules/rule_runner.hpp"

#include "scenario/dice.hpp"
#include "scenario/seed_parts.hpp"

namespace mauve::testing {

/// Another thread does it again and again while `rest` runs.
template <typename Act, typename Rest>
void beside(Act&& act, Rest&& rest) {
  OrdinaryThread other([&act] {
    for (int times = 0; times < 20; ++times) {
      act();
      seeds::compute(us_to_ns(1));
    }
  });
  rest();
  other.join();
}

/// Ends a watchdog while a component wakes it.
inline void end_watchdogs(Dice& dice, seeds::Findings& findings) {
  for (int times = 0; times < 10; ++times) {
    Watchdog watchdog;
    beside([&] { watchdog.expect_end(0); },
           [&] {
             seeds::compute(dice.between(0, us_to_ns(40)));
             watchdog.stop();
           });
    findings.count("watchdogs ended");
  }
}

/// A deployment with a watchdog, a shadow and rules; each lives for some microseconds.
inline void random_ends(std::uint64_t seed, seeds::Findings& findings) {
  Dice dice(seed);
  if (dice.once_in(2)) return end_watchdogs(dice, findings);
  const auto live = [&dice] { sleep_for(dice.between(0, us_to_ns(dice.once_in(2) ? 30 : 400))); };
  const auto shared = std::make_shared<Shared>(findings);
  {
    Architecture architecture;
    architecture.add_component("c", new_part<Shell, TestShell>(),
                               std::make_unique<SeedCore>(shared, 0, 0, Manner{}, seed),
                               new_part<FsmBase, BoundedFsm>(), {.priority = 20});
    architecture.configure();
    Deployer deployer(architecture);
    deployer.deploy();
    for (int times = dice.below(3); times > 0; --times) {
      rules::RuleRunner runner(deployer, {}, {});
      runner.start();
      beside([&] { architecture.changes().bump(); },
             [&] {
               live();
               runner.stop();
             });
      findings.count("runners ended");
    }
    if (dice.once_in(2)) {
      Transaction change;
      const bool is_fresh = dice.once_in(2);
      if (!is_fresh) shared->copied.insert(1);
      change.shadow("c", std::make_unique<SeedCore>(shared, 0, 1, Manner{}, seed),
                    {.budget_ns = ms_to_ns(1), .is_fresh = is_fresh}, std::make_unique<TestShell>());
      try {
        deployer.commit(std::move(change), {.timeouts = {.phase_ns = 0}});
      } catch (const Error&) {  // a stall may be longer than the bound of a state
        if (architecture.component("c").task().state() != ComponentState::faulted) throw;
        findings.count("faulted before their shadow");
      }
    }
    live();
    deployer.shutdown();
    findings.count("deployments ended");
  }
  seeds::expect_threads_end(findings, ms_to_ns(100));
  for (const auto& [number, core] : shared->cores) findings.expect(false, "is left: " + core);
}

}  // namespace mauve::testing
