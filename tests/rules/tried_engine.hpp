// SPDX-License-Identifier: LGPL-3.0-or-later
// An engine with an injected clock, for tests.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "mauve_rt/base/error.hpp"
#include "mauve_rt/rules/engine.hpp"
#include "mauve_rt/run/task.hpp"

namespace mauve::rules::test_fixtures {

inline When leaf(const std::string& kind, Parameters parameters) {
  return {.kind = kind, .parameters = std::move(parameters)};
}
inline When silence(double longer_than_s = 1.0, const std::string& topic = "radio") {
  return leaf("silence", {{"topic", topic}, {"longer_than_s", longer_than_s}});
}
inline When combine(const std::string& kind, std::vector<When> parts, std::int64_t count = 0) {
  return {.kind = kind, .parts = std::move(parts), .count = count};
}
constexpr time_ns_t ms(std::int64_t milliseconds) { return ms_to_ns(milliseconds); }

/// An engine whose rules are armed at instant 0, and what it decided, in words.
struct Tried {
  explicit Tried(std::vector<Rule> rules, bool armed = true) : engine(std::move(rules)) {
    if (armed) engine.arm(0);
    take();
    words.clear();
  }
  Signal& signal(std::size_t i = 0) { return *engine.signals().at(i).signal; }
  /// Steps at each instant that the engine asks for, until then; what it wants is done at once.
  void run_to(time_ns_t until_ns) {
    for (;;) {
      due_ns = engine.step(now_ns);
      while (engine.pending() && acts) {
        const PendingAction action = *engine.pending();
        engine.begun(now_ns);
        engine.ended(action.rule, action.act, ending, now_ns);
        due_ns = engine.step(now_ns);
      }
      take();
      if (due_ns > until_ns) break;
      EXPECT_GT(due_ns, now_ns) << "it asks for an instant to come";
      now_ns = due_ns;
      ++steps;
    }
    now_ns = until_ns;
  }
  void tell(std::size_t i, double value = 0.0) {
    signal(i).tell(now_ns, value);
    run_to(now_ns);
  }
  void take() {
    while (const auto decision = engine.take()) {
      decisions.push_back(*decision);
      std::string word = std::to_string(decision->stamp_ns / 1'000'000) + " " +
                         engine.rule(static_cast<std::size_t>(decision->rule)).name + " " +
                         std::string(name_of(decision->decided));
      if (decision->why != Why::none) word += " " + std::string(words_of(decision->why));
      words.push_back(word);
    }
  }
  /// Of the component that the signal is about.
  void tell_state(std::size_t i, ComponentState state) {
    const SignalSpec wanted{SignalKind::state, engine.signals().at(i).spec.target};
    for (const Engine::Heard& heard : engine.signals()) {
      if (heard.spec == wanted) heard.signal->tell(now_ns, static_cast<double>(state));
    }
    run_to(now_ns);
  }
  bool holds(std::size_t i = 0) { return engine.status(i).holds(); }
  Truth truth(std::size_t i = 0) { return engine.status(i).truth; }

  Engine engine;
  time_ns_t now_ns{0};
  time_ns_t due_ns{0};
  Ended ending{Ended::done};
  bool acts{true};
  int steps{0};
  std::vector<Decision> decisions;
  std::vector<std::string> words;
};

inline Rule rule(const std::string& name, When when, std::vector<std::string> about = {}) {
  return {.name = name, .when = std::move(when), .undoes = true, .about = std::move(about)};
}

}  // namespace mauve::rules::test_fixtures
