// SPDX-License-Identifier: LGPL-3.0-or-later
// Rules: conditions and what the engine makes of them, by an injected clock.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <thread>

#include "mauve_rt/base/error.hpp"
#include "mauve_rt/rules/engine.hpp"
#include "mauve_rt/run/task.hpp"

namespace mauve::rules::test_engine {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

When leaf(const std::string& kind, Parameters parameters) {
  return {.kind = kind, .parameters = std::move(parameters)};
}
When silence(double longer_than_s = 1.0, const std::string& topic = "radio") {
  return leaf("silence", {{"topic", topic}, {"longer_than_s", longer_than_s}});
}
When combine(const std::string& kind, std::vector<When> parts, std::int64_t count = 0) {
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

Rule rule(const std::string& name, When when, std::vector<std::string> about = {}) {
  return {.name = name, .when = std::move(when), .undoes = true, .about = std::move(about)};
}

// ---- conditions

TEST(Conditions, SilenceHoldsFromTheInstantAfterItsTimeOn) {
  Tried tried({rule("r", silence())});
  tried.run_to(ms(500));
  tried.tell(0);
  EXPECT_EQ(ms(1445), tried.due_ns) << "to see that it does not stand still itself";
  tried.run_to(ms(1500));
  EXPECT_EQ(ms(1500) + 1, tried.due_ns);
  EXPECT_FALSE(tried.holds());
  tried.run_to(ms(1500) + 1);
  EXPECT_TRUE(tried.holds());
  EXPECT_EQ(kForever, tried.due_ns) << "only a message can end it";
  tried.tell(0);
  EXPECT_FALSE(tried.holds());
}

TEST(Conditions, BeforeAFirstMessageSilenceCountsFromArmingOn) {
  Tried tried({rule("r", silence())}, false);
  tried.signal().tell(ms(1));
  tried.now_ns = ms(5000);
  tried.engine.arm(ms(5000));
  tried.run_to(ms(6000));
  EXPECT_FALSE(tried.holds());
  tried.run_to(ms(6001));
  EXPECT_TRUE(tried.holds());
}

/// A stall of any length, at any instant: the messages of that time come a little later than the engine goes on.
TEST(Conditions, AnEngineThatStoodStillTellsThatFromSilence) {
  std::minstd_rand random(1);
  for (int stall = 0; stall < 2000; ++stall) {
    Tried tried({rule("r", silence(0.1))});
    for (const time_ns_t begins_ns = ms(static_cast<std::int64_t>(20 + random() % 300));
         tried.now_ns < begins_ns;) {
      if (tried.now_ns % ms(20) == 0) tried.signal().tell(tried.now_ns);
      tried.run_to(tried.now_ns + ms(1));
    }
    tried.now_ns += ms(static_cast<std::int64_t>(10 + random() % 2000));
    const auto later_ms = static_cast<std::int64_t>(random() % 45);
    tried.run_to(tried.now_ns + ms(later_ms));
    tried.signal().tell(tried.now_ns);
    tried.run_to(tried.now_ns + ms(90));
    ASSERT_TRUE(tried.words.empty()) << tried.words.front();
    tried.run_to(tried.now_ns + ms(11));
    EXPECT_TRUE(tried.holds()) << "silence is found all the same";
  }
}

TEST(Conditions, AnEngineThatNeverComesToRestFindsSilenceAllTheSame) {
  Tried tried({rule("r", silence(0.1))});
  for (int look = 0; look < 120; ++look) {
    tried.now_ns += ms(50);
    tried.engine.step(tried.now_ns);
  }
  EXPECT_TRUE(tried.holds());
}

TEST(Conditions, SilenceIsProvenAsFarAsTheReceiverHasReported) {
  Tried tried({rule("r", silence(0.1))});
  tried.signal().tell(0);
  tried.signal().set_reported_until(ms(10));
  tried.run_to(ms(200));
  EXPECT_FALSE(tried.holds()) << "a message of since then may be waiting";
  tried.signal().set_reported_until(ms(205));
  tried.run_to(ms(210));
  EXPECT_TRUE(tried.holds());
  EXPECT_EQ(ms(100), tried.engine.status(0).since_ns);
}

TEST(Conditions, WhatIsAliveWakesNobody) {
  Tried tried({rule("r", silence())});
  tried.run_to(0);
  const std::uint32_t word = tried.engine.word();
  for (int i = 1; i <= 900; ++i) tried.signal().tell(ms(i));
  EXPECT_EQ(word, tried.engine.word());
  tried.run_to(ms(1500));
  EXPECT_FALSE(tried.holds());
  EXPECT_LE(tried.steps, 1) << "when silence could have been long enough";
  tried.run_to(ms(1901));
  EXPECT_TRUE(tried.holds());
  tried.signal().tell(ms(1902));
  EXPECT_NE(word, tried.engine.word());
}

TEST(Conditions, AValueIsHeldAgainstItsBoundsAndANaNViolatesThem) {
  Tried tried(
      {rule("r", leaf("value", {{"resource", "x"}, {"field", "v"}, {"above", 10.0}, {"hysteresis", 2.0}}))});
  const std::vector<std::pair<double, bool>> told{{10.0, false}, {10.1, true}, {8.5, true},
                                                  {8.0, false},  {9.9, false}, {NAN, true},
                                                  {9.0, true},   {7.0, false}, {1e9, true}};
  for (const auto& [value, holds] : told) {
    tried.tell(0, value);
    EXPECT_EQ(holds, tried.holds()) << value;
  }
}

TEST(Conditions, ValuesOnTheQuietSideWakeNobody) {
  Tried tried({rule("r", leaf("value", {{"topic", "t"}, {"field", "v"}, {"below", 0.0}, {"above", 10.0}}))});
  tried.tell(0, 5.0);
  std::uint32_t word = tried.engine.word();
  for (int i = 0; i <= 10; ++i) tried.signal().tell(ms(1), i);
  EXPECT_EQ(word, tried.engine.word());
  tried.signal().tell(ms(1), 10.5);
  EXPECT_NE(word, tried.engine.word());
  tried.run_to(ms(1));
  word = tried.engine.word();
  tried.signal().tell(ms(2), 99.0);
  EXPECT_EQ(word, tried.engine.word()) << "it is above as before";
  tried.signal().tell(ms(2), -1.0);
  EXPECT_NE(word, tried.engine.word());
}

TEST(Conditions, OverrunsCountWithinATime) {
  Tried tried(
      {rule("r", leaf("overruns", {{"component", "c"}, {"at_least", std::int64_t{3}}, {"within_s", 1.0}}))});
  tried.tell(0, 1);
  tried.run_to(ms(400));
  tried.tell(0, 2);
  tried.run_to(ms(999));
  tried.tell(0, 3);
  EXPECT_TRUE(tried.holds());
  EXPECT_EQ(ms(1000), tried.due_ns);
  tried.run_to(ms(1000));
  EXPECT_FALSE(tried.holds());
  tried.run_to(ms(5000));
  tried.tell(0, 6);
  EXPECT_TRUE(tried.holds()) << "three at once";
}

TEST(Conditions, NoReleaseCountsPeriods) {
  Tried tried({rule("r", leaf("no_release", {{"component", "c"}, {"periods", 3.0}}))});
  tried.run_to(ms(100));
  EXPECT_FALSE(tried.holds()) << "nobody knows its period yet";
  tried.tell(0, 0.010);
  tried.run_to(ms(130));
  EXPECT_EQ(ms(130) + 1, tried.due_ns);
  EXPECT_FALSE(tried.holds());
  tried.run_to(ms(131));
  EXPECT_TRUE(tried.holds());
  tried.tell(0, 0.010);
  EXPECT_FALSE(tried.holds());
}

TEST(Conditions, StatesPeersDiagnosticsAndBooleansAreLookedUp) {
  Tried tried({rule("fault", leaf("fault", {{"component", "c"}})),
               rule("peer", leaf("peer", {{"executor", "e"}})),
               rule("diagnostic", leaf("diagnostic", {{"status", "s"}})),
               rule("boolean", leaf("boolean", {{"topic", "t"}, {"is", false}}))});
  for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(Truth::unknown, tried.truth(i)) << i;
  tried.tell_state(0, ComponentState::running);
  EXPECT_EQ(Truth::no, tried.truth(0));
  tried.tell_state(0, ComponentState::faulted);
  EXPECT_EQ(Truth::yes, tried.truth(0));
  tried.tell(2, static_cast<double>(PeerState::unheard));
  EXPECT_EQ(Truth::unknown, tried.truth(1)) << "it may be gone";
  tried.tell(2, static_cast<double>(PeerState::there));
  EXPECT_EQ(Truth::no, tried.truth(1));
  tried.tell(2, static_cast<double>(PeerState::gone));
  EXPECT_EQ(Truth::yes, tried.truth(1));
  tried.tell(3, 1);
  EXPECT_EQ(Truth::no, tried.truth(2));
  tried.tell(3, 2);
  EXPECT_EQ(Truth::yes, tried.truth(2));
  tried.tell(4, 1);
  EXPECT_EQ(Truth::no, tried.truth(3));
  tried.tell(4, 0);
  EXPECT_EQ(Truth::yes, tried.truth(3));
}

TEST(Conditions, ThatAPeerWasNeverReceivedIsKnown) {
  Tried tried({rule("unheard", leaf("peer", {{"executor", "e"}, {"is", "unheard"}}))});
  tried.tell(0, static_cast<double>(PeerState::unheard));
  EXPECT_EQ(Truth::yes, tried.truth());
  tried.tell(0, static_cast<double>(PeerState::there));
  EXPECT_EQ(Truth::no, tried.truth());
}

TEST(Conditions, ThatNothingHappensToAComponentIsUnknownWhileItDoesNotRun) {
  for (const char* kind : {"overruns", "over_declared", "fault"}) {
    Tried tried({rule("r", leaf(kind, {{"component", "c"}}))});
    EXPECT_EQ(Truth::unknown, tried.truth()) << kind;
    tried.tell_state(0, ComponentState::running);
    EXPECT_EQ(Truth::no, tried.truth()) << kind;
    tried.tell_state(0, ComponentState::stopped);
    EXPECT_EQ(Truth::unknown, tried.truth()) << kind;
    tried.run_to(ms(5));
    tried.tell_state(0, ComponentState::running);
    EXPECT_EQ(Truth::no, tried.truth()) << kind;
    EXPECT_EQ(ms(5), tried.engine.status(0).since_ns) << "the evidence was broken: " << kind;
  }
}

TEST(Conditions, WhatHasHappenedToAComponentIsKnownThoughItStops) {
  Tried tried({rule("r", leaf("overruns", {{"component", "c"}, {"within_s", 1.0}}))});
  tried.tell_state(0, ComponentState::running);
  tried.tell(0, 1);
  tried.tell_state(0, ComponentState::stopped);
  EXPECT_EQ(Truth::yes, tried.truth());
  tried.run_to(ms(1'001));
  EXPECT_EQ(Truth::unknown, tried.truth());
}

TEST(Conditions, AFirstValueWithinTheHysteresisShowsNothing) {
  const auto above = leaf("value", {{"topic", "t"}, {"field", "v"}, {"above", 10.0}, {"hysteresis", 2.0}});
  Tried tried({rule("r", above)});
  tried.tell(0, 9.0);
  EXPECT_EQ(Truth::unknown, tried.truth()) << "it may have been above 10 before";
  tried.tell(0, 7.0);
  EXPECT_EQ(Truth::no, tried.truth());
  tried.tell(0, 9.0);
  EXPECT_EQ(Truth::no, tried.truth());
  tried.tell(0, 11.0);
  tried.tell(0, 9.0);
  EXPECT_EQ(Truth::yes, tried.truth());
}

TEST(Conditions, CombinationsFollowKleenesThreeValues) {
  const auto boolean = [](const char* topic) { return leaf("boolean", {{"topic", topic}}); };
  const std::vector<When> parts{boolean("a"), boolean("b"), boolean("c")};
  constexpr std::array kTruths{Truth::no, Truth::yes, Truth::unknown};
  for (int i = 0; i < 27; ++i) {
    const std::array told{kTruths[i % 3], kTruths[i / 3 % 3], kTruths[i / 9]};
    Tried one({rule("all", combine("all", parts)), rule("any", combine("any", parts)),
               rule("two", combine("at_least", parts, 2)), rule("not", combine("not", {boolean("a")}))});
    for (std::size_t at = 0; at < one.engine.signals().size(); ++at) {
      if (const Truth truth = told[at % 3]; truth != Truth::unknown)
        one.tell(at, truth == Truth::yes ? 1 : 0);
    }
    const auto count = [&](Truth truth) { return std::count(told.begin(), told.end(), truth); };
    const auto at_least = [&](int many) {
      if (count(Truth::yes) >= many) return Truth::yes;
      return 3 - count(Truth::no) < many ? Truth::no : Truth::unknown;
    };
    EXPECT_EQ(at_least(3), one.truth(0)) << i;
    EXPECT_EQ(at_least(1), one.truth(1)) << i;
    EXPECT_EQ(at_least(2), one.truth(2)) << i;
    EXPECT_EQ(told[0] == Truth::unknown ? Truth::unknown : truth_of(told[0] == Truth::no), one.truth(3)) << i;
  }
}

TEST(Conditions, ForNeedsUnbrokenEvidence) {
  When overruns = leaf("overruns", {{"component", "c"}, {"within_s", 1e-3}});
  When calm = combine("not", {overruns});
  calm.for_ns = ms(10);
  Tried tried({rule("calm", calm)});
  tried.tell_state(0, ComponentState::running);
  tried.run_to(ms(9));
  EXPECT_EQ(Truth::unknown, tried.truth()) << "whether it was calm before nobody knows";
  tried.tell_state(0, ComponentState::stopped);
  tried.run_to(ms(20));
  EXPECT_EQ(Truth::unknown, tried.truth());
  tried.tell_state(0, ComponentState::running);
  tried.run_to(ms(29));
  EXPECT_EQ(Truth::unknown, tried.truth());
  tried.run_to(ms(31));
  EXPECT_EQ(Truth::yes, tried.truth());
  tried.tell(0, 1);
  EXPECT_EQ(Truth::no, tried.truth());
  tried.run_to(ms(35));
  EXPECT_EQ(Truth::no, tried.truth()) << "it was not, and has not been for long enough";
}

TEST(Conditions, OnePeerLostOfThree) {
  std::vector<When> peers;
  for (const char* name : {"a", "b", "c"}) peers.push_back(silence(1.0, name));
  Tried tried({rule("any", combine("any", peers)), rule("two", combine("at_least", peers, 2)),
               rule("all", combine("all", peers)), rule("not", combine("not", {silence(1.0, "a")}))});
  tried.run_to(ms(500));
  for (const std::size_t i : {1U, 2U, 4U, 5U, 7U, 8U}) tried.tell(i);  // b and c, of three trees
  tried.run_to(ms(1001));
  EXPECT_TRUE(tried.holds(0));
  EXPECT_FALSE(tried.holds(1));
  EXPECT_FALSE(tried.holds(2));
  EXPECT_FALSE(tried.holds(3));
  tried.run_to(ms(1501));
  EXPECT_TRUE(tried.holds(1));
  EXPECT_TRUE(tried.holds(2));
}

TEST(Conditions, ForAndWithinAreCountedFromTheInstantsThemselves) {
  When held = silence(1.0);
  held.for_ns = ms(300);
  When lately = silence(1.0);
  lately.within_ns = ms(700);
  Tried tried({rule("for", held), rule("within", lately)});
  tried.run_to(ms(1299));
  EXPECT_FALSE(tried.holds(0));
  EXPECT_TRUE(tried.holds(1));
  tried.run_to(ms(1301));
  EXPECT_TRUE(tried.holds(0));
  tried.tell(1);
  EXPECT_TRUE(tried.holds(1));
  EXPECT_EQ(ms(2001), tried.due_ns);
  tried.run_to(ms(2000));
  EXPECT_TRUE(tried.holds(1));
  tried.run_to(ms(2001));
  EXPECT_FALSE(tried.holds(1));
}

TEST(Conditions, WhatCannotBeSoIsRefusedInWords) {
  const auto refusal = [](const When& when) -> std::string {
    try {
      Engine engine({rule("r", when)});
    } catch (const Error& failure) {
      return failure.what();
    }
    return "accepted";
  };
  EXPECT_THAT(refusal(leaf("silense", {})), HasSubstr("one of all, any, not, at_least, silence"));
  EXPECT_THAT(refusal(leaf("silence", {{"topic", "t"}})), HasSubstr("longer_than_s"));
  EXPECT_THAT(refusal(leaf("silence", {{"longer_than_s", 1.0}})), HasSubstr("a topic or a resource"));
  EXPECT_THAT(refusal(leaf("silence", {{"topic", "t"}, {"longer_than_s", -1.0}})), HasSubstr("-1"));
  EXPECT_THAT(refusal(leaf("silence", {{"topic", "t"}, {"longer_than_s", NAN}})), HasSubstr("nan"));
  EXPECT_THAT(refusal(leaf("silence", {{"topic", "t"}, {"longer", 1.0}, {"longer_than_s", 1.0}})),
              HasSubstr("correct the name"));
  EXPECT_THAT(refusal(leaf("peer", {{"executor", "e"}, {"is", std::string("dead")}})), HasSubstr("gone"));
  EXPECT_THAT(refusal(leaf("value", {{"topic", "t"}, {"field", "f"}})), HasSubstr("above"));
  EXPECT_THAT(refusal(combine("at_least", {silence()}, 2)), HasSubstr("1 to 1"));
  EXPECT_THAT(refusal(combine("all", {})), HasSubstr("none"));
}

TEST(Conditions, EachKindOfTheTableCanBeMadeFromWhatItRequires) {
  for (const ConditionKind& kind : condition_kinds()) {
    When when{.kind = kind.name};
    for (const ParameterSpec& spec : kind.parameters) {
      if (spec.name == "topic" && kind.name != "boolean") when.parameters["topic"] = std::string("t");
      if (spec.name == "above") when.parameters["above"] = 1.0;
      if (!spec.required) continue;
      if (spec.type == "float") when.parameters[spec.name] = 1.0;
      if (spec.type != "float") when.parameters[spec.name] = std::string("x");
    }
    Tried tried({rule("r", when)});
    const auto& heard = tried.engine.signals();
    const auto is_state = [](const auto& each) { return each.spec.kind == SignalKind::state; };
    const auto states = std::count_if(heard.begin(), heard.end(), is_state);
    EXPECT_EQ(1 + (states > 0 ? 1 : 0), std::ssize(heard))
        << "what it is about, and whether that runs: " << kind.name;
    EXPECT_FALSE(kind.summary.empty());
    tried.run_to(ms(1));
    EXPECT_FALSE(tried.holds()) << kind.name;
  }
}

// ---- rules

/// Threads wake up a little late: silence is found by the first look after its instant, for all the looks before.
TEST(Conditions, SilenceIsFoundAtItsInstantThoughEveryLookIsLate) {
  for (const double limit_s : {0.01, 0.1, 1.0}) {
    Tried tried({rule("r", silence(limit_s))});
    const auto due_ns = static_cast<time_ns_t>(limit_s * 1e9);
    time_ns_t now_ns = 0;
    while (now_ns < 2 * due_ns) {
      const time_ns_t next_ns = tried.engine.step(now_ns);
      if (tried.holds()) break;
      now_ns = next_ns + us_to_ns(next_ns > due_ns ? 20 : 300);  // the last one less than those before
    }
    tried.take();
    EXPECT_GT(now_ns, due_ns);
    EXPECT_EQ(Decided::condition_true, tried.decisions.back().decided);
    EXPECT_LT(tried.decisions.back().stamp_ns, due_ns + us_to_ns(100)) << limit_s;
  }
}

TEST(Rules, DoesAndUndoes) {
  Rule link = rule("link", silence(1.0));
  link.undo_for_ns = ms(3000);
  Tried tried({link});
  tried.run_to(ms(2000));
  tried.tell(0);
  tried.run_to(ms(4000));
  for (int i = 0; i < 50; ++i) {
    tried.tell(0);
    tried.run_to(tried.now_ns + ms(100));
  }
  EXPECT_THAT(tried.words, ElementsAre("1000 link condition_true", "1000 link do", "1000 link done",
                                       "2000 link condition_false", "3000 link condition_true",
                                       "4000 link condition_false", "7000 link undo", "7000 link done"));
  EXPECT_EQ(ms(1000) + 1, tried.decisions[1].stamp_ns);
  EXPECT_EQ(ms(1000), tried.decisions[1].cause_ns);
}

TEST(Rules, AFlappingLinkActsOncePerCooldown) {
  Rule link = rule("link", silence(0.1));
  link.cooldown_ns = ms(2000);
  Tried tried({link});
  for (int i = 0; i < 100; ++i) {
    tried.run_to(tried.now_ns + ms(150));
    tried.tell(0);
  }
  std::vector<time_ns_t> acted;
  for (const Decision& decision : tried.decisions) {
    if (decision.decided == Decided::do_ || decision.decided == Decided::undo)
      acted.push_back(decision.stamp_ns);
  }
  ASSERT_GT(acted.size(), 3U);
  for (std::size_t i = 1; i < acted.size(); ++i) EXPECT_GE(acted[i] - acted[i - 1], ms(2000));
}

TEST(Rules, TheHighestDecidesAndWhoLostSaysSo) {
  Rule low = rule("low", silence(1.0, "a"), {"drive"});
  Rule high = rule("high", silence(2.0, "b"), {"drive", "arm"});
  high.priority = 5;
  const Rule apart = rule("apart", silence(1.0, "c"), {"camera"});
  Tried tried({low, high, apart});
  tried.run_to(ms(1500));
  EXPECT_TRUE(tried.engine.status(0).in_effect);
  EXPECT_TRUE(tried.engine.status(2).in_effect);
  tried.run_to(ms(2500));
  EXPECT_TRUE(tried.engine.status(1).in_effect);
  EXPECT_FALSE(tried.engine.status(0).in_effect) << "what it did is gone";
  EXPECT_EQ("2000 low suppressed outranked by a rule of higher rank", tried.words.back());
  EXPECT_EQ(1, tried.decisions.back().other);
  tried.tell(1);  // b is heard again: high is undone, and low has its way
  EXPECT_FALSE(tried.engine.status(1).in_effect);
  EXPECT_TRUE(tried.engine.status(0).in_effect);
}

/// Two rules that are due at once; the actions stay under way.
struct TwoDue : Tried {
  explicit TwoDue(std::vector<std::string> other_about, std::int64_t priority = 0)
      : Tried({ranked("a", priority, {"c"}), ranked("b", 0, std::move(other_about))}) {
    acts = false;
    run_to(ms(1001));
  }
  static Rule ranked(const std::string& name, std::int64_t priority, std::vector<std::string> about) {
    Rule made = rule(name, silence(1.0));
    made.priority = priority;
    made.about = std::move(about);
    return made;
  }
  std::size_t begin() {
    const std::size_t begun = engine.pending() ? engine.pending()->rule : SIZE_MAX;
    engine.begun(now_ns);
    run_to(now_ns + ms(1));
    return begun;
  }
};

TEST(Rules, ActionsAboutDifferentComponentsAreUnderWaySideBySide) {
  TwoDue tried({"d"});
  EXPECT_EQ(0U, tried.begin());
  EXPECT_EQ(1U, tried.begin()) << "it does not wait for the first";
  EXPECT_FALSE(tried.engine.gives_way(0));
  EXPECT_FALSE(tried.engine.gives_way(1));
  tried.engine.ended(1, Act::do_, Ended::done, tried.now_ns);
  tried.engine.ended(0, Act::do_, Ended::timed_out, tried.now_ns);
  EXPECT_TRUE(tried.engine.status(1).in_effect);
  EXPECT_FALSE(tried.engine.status(0).in_effect);
}

TEST(Rules, OfTheSameComponentTheLowerOneWaits) {
  TwoDue tried({"c"});
  EXPECT_EQ(0U, tried.begin());
  EXPECT_FALSE(tried.engine.pending());
  EXPECT_FALSE(tried.engine.gives_way(0)) << "the other does not come before it";
  tried.engine.ended(0, Act::do_, Ended::refused, tried.now_ns);
  tried.run_to(tried.now_ns + ms(1));
  EXPECT_EQ(1U, tried.begin());
}

TEST(Rules, ARuleOfHigherRankHasTheLowerOnesActionCalledOff) {
  Tried tried({TwoDue::ranked("low", 0, {"c"}), TwoDue::ranked("high", 1000, {"c", "d"})});
  tried.acts = false;
  tried.tell(1);
  tried.now_ns = ms(500);
  tried.tell(1);
  tried.run_to(ms(1001));
  ASSERT_EQ(0U, tried.engine.pending()->rule);
  tried.engine.begun(tried.now_ns);
  tried.run_to(ms(1400));
  EXPECT_FALSE(tried.engine.gives_way(0));
  tried.run_to(ms(1501));
  EXPECT_EQ(Act::do_, tried.engine.gives_way(0));
  EXPECT_FALSE(tried.engine.pending()) << "once the lower one has let go";
  tried.engine.ended(0, Act::do_, Ended::withdrawn, tried.now_ns);
  tried.run_to(ms(1502));
  ASSERT_TRUE(tried.engine.pending());
  EXPECT_EQ(1U, tried.engine.pending()->rule);
  EXPECT_FALSE(tried.engine.gives_way(0));
}

TEST(Rules, ARuleOfHigherRankKeepsItsPlaceWhileItIsMadeReady) {
  Tried tried({TwoDue::ranked("low", 0, {"c"}), TwoDue::ranked("high", 1000, {"c"})});
  tried.acts = false;
  tried.engine.set_ready(1, Act::do_, false);
  tried.run_to(ms(1100));
  EXPECT_FALSE(tried.engine.pending());
  EXPECT_FALSE(tried.engine.may_prepare(0)) << "that would be in the way of the higher one";
  EXPECT_TRUE(tried.engine.may_prepare(1));
  tried.run_to(ms(1101));
  ASSERT_TRUE(tried.engine.pending()) << "one that cannot leaves the way free";
  EXPECT_EQ(0U, tried.engine.pending()->rule);
  EXPECT_TRUE(tried.engine.may_prepare(0));
}

TEST(Rules, ARuleOfHigherRankKeepsItsPlaceWhereItsActionWasStale) {
  Tried tried({TwoDue::ranked("low", 0, {"c"}), TwoDue::ranked("high", 1000, {"c"})});
  tried.acts = false;
  tried.run_to(ms(1001));
  time_ns_t wait_ns = ms(10);
  for (; wait_ns <= ms(80); wait_ns *= 2) {
    ASSERT_TRUE(tried.engine.pending());
    EXPECT_EQ(1U, tried.engine.pending()->rule);
    tried.engine.begun(tried.now_ns);
    EXPECT_FALSE(tried.engine.may_prepare(0));
    tried.engine.ended(1, Act::do_, Ended::stale, tried.now_ns);
    tried.run_to(tried.now_ns + wait_ns - 1);
    EXPECT_FALSE(tried.engine.pending());
    EXPECT_FALSE(tried.engine.may_prepare(0));
    tried.run_to(tried.now_ns + 1);
  }
  tried.engine.begun(tried.now_ns);
  tried.engine.ended(1, Act::do_, Ended::stale, tried.now_ns);
  tried.run_to(tried.now_ns);
  ASSERT_TRUE(tried.engine.pending()) << "one that cannot leaves the way free";
  EXPECT_EQ(0U, tried.engine.pending()->rule);
}

TEST(Rules, OfTwoThatDoTheSameTheHigherOneHasDoneIt) {
  Tried tried({TwoDue::ranked("low", 0, {"c"}), TwoDue::ranked("high", 1, {"c"})});
  tried.acts = false;
  tried.run_to(ms(500));
  tried.tell(1);
  tried.acts = true;
  tried.run_to(ms(1100));
  EXPECT_TRUE(tried.engine.status(0).in_effect);
  tried.engine.set_in_place(1, Act::do_, true, tried.now_ns);
  tried.run_to(ms(1600));
  EXPECT_TRUE(tried.engine.status(1).in_effect);
  for (int i = 0; i < 3; ++i) {
    tried.engine.set_in_place(0, Act::do_, true, tried.now_ns);
    tried.engine.set_in_place(1, Act::do_, true, tried.now_ns);
    tried.run_to(tried.now_ns + ms(1));
    EXPECT_TRUE(tried.engine.status(1).in_effect) << "the lower one does not take it over";
    EXPECT_FALSE(tried.engine.status(0).in_effect);
  }
}

/// A rule with a reserve action 200 ms after `do` is due.
Rule reserved() {
  Rule made = rule("r", silence(1.0));
  made.otherwise_after_ns = ms(200);
  return made;
}

TEST(Rules, TheReserveActionComesWhereWhatItDoesIsNotReady) {
  Tried tried({reserved()});
  tried.engine.set_ready(0, Act::do_, false);
  tried.run_to(ms(1500));
  EXPECT_THAT(tried.words, ElementsAre("1000 r condition_true", "1100 r suppressed it is not prepared",
                                       "1200 r otherwise", "1200 r done"));
  EXPECT_FALSE(tried.engine.status(0).in_effect);
}

TEST(Rules, TheReserveActionComesWhereWhatItDoesHangs) {
  Tried tried({reserved()});
  tried.acts = false;
  tried.run_to(ms(1001));
  tried.engine.begun(tried.now_ns);
  tried.run_to(ms(1199));
  EXPECT_FALSE(tried.engine.pending());
  tried.run_to(ms(1201));
  ASSERT_TRUE(tried.engine.pending());
  EXPECT_EQ(Act::otherwise, tried.engine.pending()->act);
  EXPECT_FALSE(tried.engine.gives_way(0));
  tried.engine.begun(tried.now_ns);
  EXPECT_EQ(Act::do_, tried.engine.gives_way(0)) << "its own action is called off";
}

TEST(Rules, TheReserveActionIsTriedAgainWhereItFailed) {
  Tried tried({reserved()});
  tried.engine.set_ready(0, Act::do_, false);
  tried.ending = Ended::timed_out;
  tried.run_to(ms(1650));
  EXPECT_EQ(3, std::count(tried.words.begin(), tried.words.end(), "1200 r otherwise") +
                   std::count(tried.words.begin(), tried.words.end(), "1400 r otherwise") +
                   std::count(tried.words.begin(), tried.words.end(), "1600 r otherwise"));
}

TEST(Rules, AnOutcomeTellsTheSampleThatCausedItsAction) {
  const auto last = [](const Tried& tried, Decided decided) {
    return std::find_if(tried.decisions.rbegin(), tried.decisions.rend(),
                        [decided](const Decision& each) { return each.decided == decided; })
        ->sample_ns;
  };
  Tried silent({rule("r", combine("any", {silence(1.0)}))});
  silent.now_ns = ms(300);
  silent.tell(0);
  silent.run_to(ms(1500));
  EXPECT_EQ(ms(300), last(silent, Decided::done)) << "the last sample before the silence";
  silent.tell(0);
  EXPECT_EQ(ms(1500), last(silent, Decided::done)) << "the first one after it";
  When high = leaf("value", {{"topic", "radio"}, {"field", "x"}, {"above", 1.0}});
  high.for_ns = ms(200);
  Tried beyond({rule("r", high)});
  for (const std::int64_t at : {100, 150, 200, 250}) {
    beyond.run_to(ms(at));
    beyond.tell(0, 2.0);
  }
  beyond.run_to(ms(400));
  EXPECT_EQ(ms(100), last(beyond, Decided::done)) << "the first one beyond the bound";
}

TEST(Rules, ThereIsNoReserveActionForWhatIsDoneOrOutranked) {
  Rule low = reserved();
  low.about = {"c"};
  Tried tried({low, TwoDue::ranked("high", 1, {"c"})});
  tried.run_to(ms(3000));
  EXPECT_TRUE(tried.engine.status(1).in_effect);
  for (const std::string& word : tried.words) EXPECT_THAT(word, ::testing::Not(HasSubstr("otherwise")));
  Tried done({reserved()});
  done.run_to(ms(3000));
  EXPECT_TRUE(done.engine.status(0).in_effect);
  for (const std::string& word : done.words) EXPECT_THAT(word, ::testing::Not(HasSubstr("otherwise")));
}

TEST(Rules, WhatFailedIsTriedAgainLaterEachTime) {
  Tried tried({rule("r", silence(1.0))});
  tried.ending = Ended::refused;
  tried.run_to(ms(6000));
  std::vector<time_ns_t> waits;
  for (const Decision& decision : tried.decisions) {
    if (decision.decided == Decided::failed) waits.push_back(decision.wait_ns / 1'000'000);
  }
  EXPECT_THAT(waits, ElementsAre(500, 1000, 2000, 4000));
  tried.ending = Ended::done;
  tried.run_to(ms(9000));
  EXPECT_TRUE(tried.engine.status(0).in_effect);
}

TEST(Rules, ItNeverFightsAPerson) {
  Tried tried({rule("r", silence(1.0))});
  tried.run_to(ms(1500));
  tried.engine.set_in_place(0, Act::do_, false, tried.now_ns);
  tried.run_to(ms(1600));
  EXPECT_TRUE(tried.engine.status(0).changed_by_another);
  EXPECT_THAT(tried.words.back(), HasSubstr("by another requester"));
  tried.tell(0);
  tried.run_to(ms(3000));
  EXPECT_TRUE(tried.engine.status(0).in_effect) << "the next time it acts again";
}

TEST(Rules, WhatIsInPlaceIsNotDoneAgain) {
  Tried tried({rule("r", silence(1.0))});
  tried.engine.set_in_place(0, Act::do_, true, 0);
  tried.run_to(ms(1500));
  EXPECT_TRUE(tried.engine.status(0).in_effect);
  EXPECT_EQ("1000 r suppressed it is in effect already", tried.words.back());
}

TEST(Rules, WhoStartsWhileItIsInEffectUndoesIt) {
  Tried tried({rule("r", silence(1.0))});
  tried.engine.adopt(0, tried.now_ns);
  tried.run_to(ms(100));
  EXPECT_TRUE(tried.holds()) << "it held when somebody acted on it";
  EXPECT_TRUE(tried.engine.status(0).in_effect);
  tried.tell(0);
  EXPECT_FALSE(tried.engine.status(0).in_effect);
  EXPECT_EQ("100 r done", tried.words.back());
}

/// An emergency stop by a value that is published once: in effect, and the engine is a new one.
struct AdoptedStop : Tried {
  AdoptedStop() : Tried({stop()}) {
    engine.adopt(0, 0);
    take();
    words.clear();
  }
  static Rule stop() {
    return {.name = "stop",
            .when = leaf("boolean", {{"topic", "pressed"}}),
            .undoes = true,
            .undo_for_ns = ms(500),
            .about = {"base"}};
  }
};

TEST(Rules, WhatIsInEffectStaysWhileNothingIsKnown) {
  AdoptedStop tried;
  tried.run_to(s_to_ns(60));
  EXPECT_TRUE(tried.engine.status(0).in_effect);
  EXPECT_THAT(tried.words, ElementsAre("0 stop condition_unknown"));
  EXPECT_FALSE(tried.engine.status(0).next);
}

TEST(Rules, TheDwellOfUndoCountsFromTheFirstThatIsKnown) {
  AdoptedStop tried;
  tried.run_to(ms(2'000));
  tried.words.clear();
  tried.tell(0, 0.0);
  tried.run_to(ms(2'600));
  EXPECT_THAT(tried.words, ElementsAre("2000 stop condition_false", "2500 stop undo", "2500 stop done"));
}

TEST(Rules, WhatWasDueIsStillDoneWhenTheConditionBecomesUnknown) {
  Tried tried({{.name = "r",
                .when = leaf("overruns", {{"component", "c"}, {"within_s", 0.1}}),
                .undoes = true,
                .about = {"a"}}});
  tried.ending = Ended::refused;
  tried.tell_state(0, ComponentState::running);
  tried.tell(0, 1);
  tried.tell_state(0, ComponentState::stopped);
  tried.run_to(ms(200));
  EXPECT_EQ(Truth::unknown, tried.truth());
  tried.ending = Ended::done;
  tried.run_to(ms(600));
  EXPECT_TRUE(tried.engine.status(0).in_effect) << "the second try";
  tried.run_to(s_to_ns(60));
  EXPECT_TRUE(tried.engine.status(0).in_effect);
  tried.tell_state(0, ComponentState::running);
  EXPECT_FALSE(tried.engine.status(0).in_effect);
}

TEST(Rules, WhatARuleTookCountsFromWhenItWasEntitled) {
  Rule low{.name = "low",
           .when = leaf("boolean", {{"topic", "a"}}),
           .for_ns = ms(100),
           .undoes = true,
           .about = {"c"}};
  Rule high = low;
  high.name = "high";
  high.when = leaf("boolean", {{"topic", "b"}});
  high.priority = 9;
  Tried tried({low, high});
  tried.tell(1, 1.0);
  tried.run_to(ms(500));
  tried.tell(0, 1.0);  // due at 600, and outranked
  tried.run_to(ms(7'000));
  tried.tell(1, 0.0);
  tried.run_to(ms(8'000));
  const auto done = std::find_if(tried.decisions.rbegin(), tried.decisions.rend(), [](const Decision& one) {
    return one.decided == Decided::done && one.rule == 0;
  });
  ASSERT_NE(tried.decisions.rend(), done);
  EXPECT_EQ(ms(500), done->cause_ns);
  EXPECT_EQ(ms(7'000) - ms(600), done->held_ns);
  for (const Decision& one : tried.decisions) {
    EXPECT_TRUE(one.rule == 0 || one.held_ns == 0);
  }
}

TEST(Rules, WhoFailsSaysSoUntilItSucceedsOrItsConditionEnds) {
  Tried tried({{.name = "r", .when = leaf("boolean", {{"topic", "a"}}), .undoes = true, .about = {"c"}}});
  tried.ending = Ended::refused;
  tried.tell(0, 1.0);
  EXPECT_EQ(Act::do_, tried.engine.status(0).failed);
  EXPECT_EQ(Why::refused, tried.engine.status(0).why);
  tried.ending = Ended::done;
  tried.run_to(s_to_ns(2));
  EXPECT_FALSE(tried.engine.status(0).failed);
  tried.ending = Ended::timed_out;
  tried.tell(0, 0.0);
  EXPECT_EQ(Act::undo, tried.engine.status(0).failed);
  tried.tell(0, 1.0);
  EXPECT_FALSE(tried.engine.status(0).failed);
}

TEST(Rules, WhatSomebodyElseDidIsNotUndone) {
  Rule undoing = rule("r", silence(1.0));
  for (const bool takes_over : {false, true}) {
    SCOPED_TRACE(takes_over);
    undoing.takes_over = takes_over;
    for (const bool is_before : {false, true}) {
      SCOPED_TRACE(is_before);
      Tried tried({undoing});
      tried.engine.set_own(0, false);
      tried.engine.set_in_place(0, Act::do_, true, 0);
      if (is_before) tried.engine.adopt(0, tried.now_ns);  // as who arms the rule would
      tried.run_to(ms(1500));
      EXPECT_EQ(takes_over, tried.engine.status(0).in_effect);
      tried.tell(0);
      tried.run_to(ms(1600));
      const auto undone = std::count_if(tried.decisions.begin(), tried.decisions.end(),
                                        [](const Decision& one) { return one.decided == Decided::undo; });
      EXPECT_EQ(takes_over ? 1 : 0, undone);
      tried.engine.set_in_place(0, Act::do_, false, tried.now_ns);  // and the other one takes it back
      tried.run_to(ms(3500));
      EXPECT_TRUE(tried.engine.status(0).in_effect) << "the next time it acts again";
    }
  }
}

TEST(Rules, WhatIsNotReadyIsNotWishedAndSaysSo) {
  Tried tried({rule("r", silence(1.0))});
  tried.engine.set_ready(0, Act::do_, false);
  tried.run_to(ms(2000));
  EXPECT_EQ("1100 r suppressed it is not prepared", tried.words.back());
  tried.engine.set_ready(0, Act::do_, true);
  tried.run_to(ms(2001));
  EXPECT_TRUE(tried.engine.status(0).in_effect);
}

TEST(Rules, WhatIsMadeReadySoonIsNoNews) {
  Tried tried({rule("r", silence(1.0))});
  tried.engine.set_ready(0, Act::do_, false);
  tried.run_to(ms(1050));
  tried.engine.set_ready(0, Act::do_, true);
  tried.run_to(ms(1051));
  EXPECT_TRUE(tried.engine.status(0).in_effect);
  for (const std::string& word : tried.words) EXPECT_EQ(std::string::npos, word.find("suppressed")) << word;
}

TEST(Rules, WhatIsAbsentIsNotWatched) {
  Tried tried({rule("r", silence(1.0))});
  tried.engine.set_present(0, false, 0);
  tried.run_to(ms(5000));
  EXPECT_EQ(kForever, tried.due_ns);
  tried.engine.set_present(0, true, tried.now_ns);
  tried.run_to(ms(6000));
  EXPECT_FALSE(tried.holds()) << "what was before does not count";
  tried.run_to(ms(6001));
  EXPECT_TRUE(tried.holds());
}

TEST(Rules, OneThatSomebodyElseRunsIsForgottenAndTheOthersGoOn) {
  Tried tried({rule("left", silence(1.0)), rule("kept", silence(1.0))});
  tried.run_to(ms(1500));
  ASSERT_TRUE(tried.engine.status(0).in_effect);
  tried.engine.forget(0);
  EXPECT_FALSE(tried.engine.status(0).armed);
  EXPECT_FALSE(tried.engine.status(0).in_effect);
  EXPECT_TRUE(tried.engine.status(1).armed);
  tried.engine.set_present(0, true, tried.now_ns);
  tried.run_to(ms(2000));
  EXPECT_FALSE(tried.engine.status(0).in_effect) << "nothing of before counts";
  tried.run_to(ms(2600));
  EXPECT_TRUE(tried.engine.status(0).in_effect);
}

TEST(Rules, StatusSaysWhatComesNextAndWhen) {
  Rule link = rule("link", silence(1.0));
  link.for_ns = ms(200);
  link.undo_for_ns = ms(3000);
  Tried tried({link});
  tried.run_to(ms(100));
  EXPECT_EQ(Act::do_, tried.engine.status(0).next);
  EXPECT_EQ(ms(1200) + 1, tried.engine.status(0).next_ns);
  tried.run_to(ms(1100));
  EXPECT_EQ(ms(1200), tried.engine.status(0).next_ns);
  tried.run_to(ms(1500));
  EXPECT_FALSE(tried.engine.status(0).next);
  tried.tell(0);
  EXPECT_EQ(Act::undo, tried.engine.status(0).next);
  EXPECT_EQ(ms(4500), tried.engine.status(0).next_ns);
}

TEST(Rules, NothingIsLostWithoutBeingCounted) {
  Tried tried({rule("r", silence(1.0))});
  for (int i = 0; i < 1000; ++i) tried.engine.set_present(0, i % 2 == 0, i);
  int taken = 0;
  while (tried.engine.take()) ++taken;
  EXPECT_EQ(999U, static_cast<std::size_t>(taken) + tried.engine.lost()) << "it was there before";
}

// ---- against stepping at every instant

When random_tree(std::mt19937_64& random, int depth) {
  const auto up_to = [&](int most) { return static_cast<int>(random() % static_cast<unsigned>(most + 1)); };
  When when;
  if (depth == 0 || up_to(2) == 0) {
    const int kind = up_to(4);
    if (kind == 0) when = silence(0.002 * (1 + up_to(9)), "t" + std::to_string(up_to(2)));
    if (kind == 1)
      when = leaf(
          "value",
          {{"topic", std::string("t")}, {"field", std::string("v")}, {"above", 2.0}, {"hysteresis", 1.0}});
    if (kind == 2)
      when = leaf(
          "overruns",
          {{"component", std::string("c")}, {"at_least", std::int64_t{1 + up_to(2)}}, {"within_s", 0.01}});
    if (kind == 3) when = leaf("no_release", {{"component", std::string("c")}, {"periods", 2.0}});
    if (kind == 4) when = leaf("boolean", {{"topic", std::string("b")}});
  } else {
    std::vector<When> parts;
    for (int i = up_to(2); i >= 0; --i) parts.push_back(random_tree(random, depth - 1));
    const int kind = up_to(3);
    if (kind == 0) when = combine("all", parts);
    if (kind == 1) when = combine("any", parts);
    if (kind == 2) when = combine("not", {parts.front()});
    if (kind == 3) when = combine("at_least", parts, 1 + up_to(static_cast<int>(parts.size()) - 1));
  }
  if (up_to(3) == 0) when.for_ns = ms(1 + up_to(9));
  if (up_to(5) == 0) when.within_ns = ms(1 + up_to(9));
  return when;
}

/// The engine steps only when it asked to, or a signal woke it; the other one at each half millisecond. They decide alike.
TEST(Rules, SteppedOnlyWhenItAsksForItDecidesAsIfItWereSteppedAllTheTime) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  constexpr std::uint64_t kSeeds = 200;
#else
  constexpr std::uint64_t kSeeds = 3000;
#endif
  std::size_t decisions = 0;
  std::size_t actions = 0;
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    std::mt19937_64 random(seed);
    std::vector<Rule> rules;
    for (int i = 0; i < 3; ++i) {
      Rule each = rule("r" + std::to_string(i), random_tree(random, 2), {random() % 2 == 0 ? "c" : "d"});
      each.for_ns = ms(static_cast<std::int64_t>(random() % 5));
      each.undo_for_ns = ms(static_cast<std::int64_t>(random() % 5));
      each.cooldown_ns = ms(static_cast<std::int64_t>(random() % 10));
      each.priority = static_cast<std::int64_t>(random() % 3);
      each.undoes = random() % 4 != 0;
      rules.push_back(each);
    }
    Tried lazy(rules);
    Tried busy(rules);
    lazy.run_to(0);
    busy.run_to(0);
    const std::size_t signals = lazy.engine.signals().size();
    std::uint32_t word = lazy.engine.word();
    // Told between the instants that anything can be due at, so that one step sees what happened before the next.
    for (time_ns_t now = 0; now < ms(150); now += us_to_ns(500)) {
      busy.run_to(now);
      if (lazy.due_ns <= now) lazy.run_to(now);
      busy.run_to(now + us_to_ns(250));
      if (lazy.due_ns <= now + us_to_ns(250)) lazy.run_to(now + us_to_ns(250));
      lazy.now_ns = busy.now_ns = now + us_to_ns(250);
      if (random() % 4 != 0) continue;
      const std::size_t i = random() % signals;
      double value = static_cast<double>(random() % 5);
      if (lazy.engine.signals()[i].spec.kind == SignalKind::release) value = 0.004;
      if (lazy.engine.signals()[i].spec.kind == SignalKind::overruns)
        value = lazy.signal(i).last().value + static_cast<double>(random() % 2);
      lazy.signal(i).tell(lazy.now_ns, value);
      busy.signal(i).tell(busy.now_ns, value);
      busy.run_to(busy.now_ns);
      if (lazy.engine.word() != word) lazy.run_to(lazy.now_ns);
      word = lazy.engine.word();
    }
    ASSERT_EQ(busy.words, lazy.words) << "seed " << seed;
    decisions += busy.decisions.size();
    for (const Decision& each : busy.decisions) actions += each.decided == Decided::done ? 1 : 0;
  }
  EXPECT_GT(decisions, kSeeds * 16) << "so it was asked something";
  EXPECT_GT(actions, kSeeds * 3 / 2);
}

// ---- threads

TEST(Rules, WhatIsToldOnOtherThreadsIsSeen) {
  Tried tried({rule("r", leaf("value", {{"topic", "t"}, {"field", "v"}, {"above", 0.5}}))});
  tried.run_to(0);
  constexpr int kTimes = 20'000;
  std::atomic<int> told{0};
  std::thread teller([&] {
    for (int i = 1; i <= kTimes; ++i) {
      tried.signal().tell(i, i % 2);
      told = i;
    }
  });
  std::uint32_t word = 0;
  for (int i = 0; told < kTimes; ++i) {
    word = tried.engine.word();
    tried.engine.step(kTimes + i);
    while (tried.engine.take()) {
    }
    const Signal::Last last = tried.signal().last();
    EXPECT_EQ(static_cast<double>(last.time_ns % 2), last.value) << "one that was told";
    if (told < kTimes / 2) futex_wait_until(tried.engine.word(), word, monotonic_now_ns() + ms(1));
  }
  teller.join();
  tried.now_ns = 2 * kTimes;
  tried.run_to(3 * kTimes);  // what was between the looks, and then the last
  EXPECT_FALSE(tried.holds()) << "the last was 0";
}

}  // namespace
}  // namespace mauve::rules::test_engine
