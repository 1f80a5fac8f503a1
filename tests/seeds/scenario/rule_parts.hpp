// SPDX-License-Identifier: LGPL-3.0-or-later
// The registered parts of random_rules: good cores, and cores whose hooks refuse, throw, are slow or hang.
#pragma once

#include <array>
#include <memory>
#include <set>
#include <stdexcept>
#include <string>

#include "mauve_rt/base/seam/sleep.hpp"
#include "mauve_rt/mauve_rt.hpp"

#include "dice.hpp"
#include "seed_parts.hpp"

namespace mauve::testing {

/// What all parts of a run share; a registry makes parts without parameters.
struct RuleParts {
  static inline bool may_hang{false};  // hooks, once the rules have started: the start waits for them
  static inline bool hung_may_go_on{false};
  static inline int hung_states{0};
  static inline int hung_hooks{0};
};

enum class RuleDeed : std::uint8_t { first, good, other, refuses, throws, slow, hangs, gets_stuck };
inline constexpr std::array kRuleCores{"r/First",    "r/Good", "r/Other",   "r/Refusing",
                                       "r/Throwing", "r/Slow", "r/Hanging", "r/Stuck"};
constexpr const char* name_of(RuleDeed deed) { return kRuleCores[static_cast<std::size_t>(deed)]; }

constexpr bool is_bad(RuleDeed deed) { return deed > RuleDeed::other && deed != RuleDeed::slow; }

struct RuleCore : Core<TestShell> {
  void act() {
    ++executions_;
    shell().output.write(Number{1.0});
    seeds::compute(us_to_ns(20));
    if (deed() == RuleDeed::gets_stuck && executions_ > 3) hang(RuleParts::hung_states);
  }
  bool configure_hook() override {
    if (deed() == RuleDeed::throws) throw std::runtime_error("as the seed wants");
    if (deed() == RuleDeed::slow) sleep_for(ms_to_ns(6));
    if (deed() == RuleDeed::hangs && RuleParts::may_hang) hang(RuleParts::hung_hooks);
    return true;
  }
  bool adopt(const CoreBase& /*old*/) override { return deed() != RuleDeed::refuses; }
  virtual RuleDeed deed() const { return RuleDeed::first; }

 private:
  static void hang(int& count) {
    ++count;
    while (!RuleParts::hung_may_go_on) sleep_for(ms_to_ns(1));
  }
  int executions_{0};
};
template <RuleDeed Deed>
struct RuleCoreThat final : RuleCore {
  RuleDeed deed() const override { return Deed; }
};

struct RuleFsm : Fsm<TestShell, RuleCore> {
  void define() override {
    State& run = execution("Run", "act", &RuleCore::act);
    State& pause = wait("Pause", ms_to_ns(shell().period_ms.value()));
    set_initial(run);
    next(run, pause);
    next(pause, run);
  }
};

template <RuleDeed... Deeds>
void register_rule_cores(PluginRegistry& registry) {
  (registry.core<RuleCoreThat<Deeds>>(name_of(Deeds), "r/Shell"), ...);
}
inline void register_rule_parts(PluginRegistry& registry) {
  registry.shell<TestShell>("r/Shell");
  registry.fsm<RuleFsm>("r/Fsm", "r/Shell");
  register_rule_cores<RuleDeed::first, RuleDeed::good, RuleDeed::other, RuleDeed::refuses, RuleDeed::throws,
                      RuleDeed::slow, RuleDeed::hangs, RuleDeed::gets_stuck>(registry);
}

}  // namespace mauve::testing
