// SPDX-License-Identifier: LGPL-3.0-or-later
// Conditions, by an injected clock.
#include <cmath>
#include <random>

#include "tried_engine.hpp"

namespace mauve::rules::test_conditions {
namespace {

using namespace mauve::rules::test_fixtures;  // NOLINT(google-build-using-namespace): the fixture
using ::testing::ElementsAre;
using ::testing::HasSubstr;

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
      if (spec.type == "float") continue;
      const std::size_t bar = spec.type.find('|');  // else it is one of these words
      when.parameters[spec.name] = bar == std::string::npos ? std::string("x") : spec.type.substr(0, bar);
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

}  // namespace
}  // namespace mauve::rules::test_conditions
