// SPDX-License-Identifier: LGPL-3.0-or-later
// A scenario of the seeds: threads share a state, a report, a reference or the conditions of rules without a lock.
#pragma once

#include <array>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "mauve_rt/base/present_state.hpp"
#include "mauve_rt/base/revocable_reference.hpp"
#include "mauve_rt/base/seam/ordinary_thread.hpp"
#include "mauve_rt/base/seam/sleep.hpp"
#include "mauve_rt/rules/rule_runner.hpp"
#include "mauve_rt/rules/signal.hpp"

#include "scenario/dice.hpp"
#include "scenario/rule_parts.hpp"

namespace mauve::testing {

class RandomWords {
 public:
  RandomWords(std::uint64_t seed, seeds::Findings& findings) : dice_(seed), findings_(findings) {}

  void run() {
    seeds::switch_often();
    switch (dice_.below(5)) {
      case 0:
        look_at_states();
        break;
      case 1:
        read_reports();
        break;
      case 2:
        listen_to_reports();
        break;
      case 3:
        revoke_references();
        break;
      default:
        evaluate_conditions();
    }
    seeds::expect_threads_end(findings_, ms_to_ns(100));
  }

 private:
  static constexpr int kTimes = 40;
  static constexpr double kThreshold = 5.0;
  static constexpr time_ns_t kSeen = ms_to_ns(40);  // from a write to the truth that it leads to

  /// `act` on another thread, `rest` on this one until `act` has ended.
  template <typename Act, typename Rest>
  static void meet(Act&& act, Rest&& rest) {
    bool is_over = false;
    OrdinaryThread other([&] {
      act();
      is_over = true;
    });
    while (!is_over) {
      rest();
      seeds::compute(us_to_ns(1));
    }
    other.join();
  }

  /// The fields of a present state belong together.
  void look_at_states() {
    PresentState present;
    const auto tell = [&] {
      for (std::uint32_t i = 1; i <= kTimes; ++i) {
        present.tell({.since_ns = i, .bound_ns = 100 + i, .name = i, .is_wait = i % 2 == 0});
        seeds::compute(us_to_ns(1));
      }
    };
    meet(tell, [&] {
      const auto fact = present.look();
      if (!fact || fact->since_ns == 0) return;
      findings_.count("states seen");
      const bool is_whole = fact->bound_ns == 100 + fact->since_ns &&
                            fact->name == static_cast<std::uint32_t>(fact->since_ns) &&
                            fact->is_wait == (fact->since_ns % 2 == 0);
      findings_.expect(is_whole, "the state since " + std::to_string(fact->since_ns) +
                                     " is seen with the fields of state " + std::to_string(fact->name));
    });
  }

  /// The fields of a report belong together, and no report comes after a later one.
  void read_reports() {
    rules::Signal signal(std::make_shared<rules::EngineWord>());
    const auto tell = [&] {
      for (int i = 1; i <= kTimes; ++i) {
        signal.tell(i, i);
        seeds::compute(us_to_ns(1));
      }
    };
    std::uint64_t before = 0;
    meet(tell, [&] {
      const rules::Signal::Last last = signal.last();
      findings_.count("reports read");
      findings_.expect(last.count >= before, "report " + std::to_string(last.count) +
                                                 " is read after report " + std::to_string(before));
      findings_.expect(
          static_cast<double>(last.count) == last.value && static_cast<double>(last.time_ns) == last.value,
          "report " + std::to_string(last.count) + " is torn");
      before = last.count;
    });
  }

  /// A listener that sleeps knows on which side of the threshold the last report is.
  void listen_to_reports() {
    const auto word = std::make_shared<rules::EngineWord>();
    rules::Signal signal(word);
    bool is_high = false;
    bool is_over = false;
    OrdinaryThread listener([&] {
      while (!is_over) {
        const std::uint32_t seen = word->value.load(std::memory_order_acquire);
        const rules::Signal::Last last = signal.last();
        is_high = last.value > kThreshold;
        const bool is_quiet =
            is_high ? signal.listen(kThreshold + 1, 1e9, last) : signal.listen(-1e9, kThreshold, last);
        if (is_quiet) futex_wait_until(word->value, seen, kForever);
      }
    });
    for (int bursts = 0; bursts < 10; ++bursts) {
      double value = 0.0;
      for (int reports = 1 + dice_.below(4); reports > 0; --reports) {
        value = dice_.once_in(2) ? kThreshold + 2 : 0.0;
        signal.tell(monotonic_now_ns(), value);
        seeds::compute(dice_.between(0, us_to_ns(3)));
      }
      pause(kSeen);
      findings_.count("reports listened to");
      findings_.expect(is_high == (value > kThreshold),
                       "the listener does not know the last report " + std::to_string(value));
    }
    is_over = true;
    word->bump();
    listener.join();
  }

  /// No object is in use after it was revoked.
  void revoke_references() {
    RevocableReference<bool> reference;
    std::array<bool, kTimes> is_revoked{};
    std::size_t next = 0;
    const auto revoke = [&] {
      for (bool& object : is_revoked) {
        reference.set(object);
        seeds::compute(dice_.between(0, us_to_ns(3)));
        const bool is_unused =
            dice_.once_in(2) ? reference.revoke(kForever) : reference.revoke(object, kForever);
        findings_.expect(is_unused, "a revoked object is in use");
        object = true;
        ++next;
      }
    };
    meet(revoke, [&] {
      reference.use([&](const bool& used) {
        for (int looks = 0; looks < 2; ++looks) {
          findings_.expect(!used, "object " + std::to_string(next) + " is used after it was revoked");
          seeds::compute(us_to_ns(1));
        }
        findings_.count("references used");
      });
    });
  }

  /// A rule knows whether its condition holds soon after each write, also where writes meet its look.
  void evaluate_conditions() {
    PluginRegistry registry;
    register_rule_parts(registry);
    Architecture architecture(&registry);
    auto& beat = architecture.add_resource<SharedData<Number>>("beat");
    architecture.add_component("c", "r/Shell", "r/First", "r/Fsm", {.priority = 20})
        .set_property("period_ms", std::int64_t{50});
    architecture.configure();
    Deployer deployer(architecture);
    deployer.deploy();
    const rules::When above{
        .kind = "value",
        .parameters = {
            {"resource", std::string("beat")}, {"field", std::string("value")}, {"above", kThreshold}}};
    // It holds for longer than the scenario lasts: the rule does nothing.
    const rules::Rule rule{.name = "rule", .when = above, .for_ns = s_to_ns(1000), .about = {"c"}};
    rules::RuleActions actions;
    actions.do_steps = {{.kind = "set_property", .target = "c", .name = "gain", .value = 3.0}};
    rules::RuleRunner runner(deployer, {rule}, {actions});
    runner.start();
    pause(kSeen);
    for (int bursts = 0; bursts < 12; ++bursts) {
      double value = 0.0;
      for (int writes = 1 + dice_.below(3); writes > 0; --writes) {
        value = dice_.once_in(2) ? kThreshold + 2 : 0.0;
        beat.write.write({value}, monotonic_now_ns());
        seeds::compute(dice_.between(0, us_to_ns(60)));
      }
      expect_known(runner, value);
    }
    runner.stop();
    deployer.shutdown();
  }
  /// Who asks for the facts while the rules decide does not keep them from being shown.
  void expect_known(const rules::RuleRunner& runner, double value) {
    for (int looks = dice_.below(20); looks > 0; --looks) {
      runner.facts();
      sleep_for(dice_.between(0, us_to_ns(20)));
    }
    pause(kSeen);
    findings_.count("conditions known");
    findings_.expect(runner.facts().front().status.truth == rules::truth_of(value > kThreshold),
                     "the rule does not know that the value is " + std::to_string(value));
  }

  /// So long, the stalls of the computer besides.
  static void pause(time_ns_t length_ns) {
    const time_ns_t until_ns = seeds::now_ns() + length_ns;
    const time_ns_t stalled_ns = seeds::outcome().stalled_ns;
    do {
      sleep_for(length_ns);
    } while (seeds::now_ns() < until_ns + seeds::outcome().stalled_ns - stalled_ns);
  }

  Dice dice_;
  seeds::Findings& findings_;
};

inline void random_words(std::uint64_t seed, seeds::Findings& findings) { RandomWords(seed, findings).run(); }

}  // namespace mauve::testing
