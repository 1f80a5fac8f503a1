// SPDX-License-Identifier: LGPL-3.0-or-later
// What the engine makes of rules, by an injected clock.
#include <atomic>
#include <random>
#include <thread>

#include "mauve_rt/base/seam/futex.hpp"

#include "tried_engine.hpp"

namespace mauve::rules::test_engine {
namespace {

using namespace mauve::rules::test_fixtures;  // NOLINT(google-build-using-namespace): the fixture
using ::testing::ElementsAre;
using ::testing::HasSubstr;

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

TEST(Rules, EachIsActiveByItselfAndWhoIsOutrankedSaysSo) {
  Rule low = rule("low", silence(1.0, "a"), {"drive"});
  Rule high = rule("high", silence(2.0, "b"), {"drive", "arm"});
  high.priority = 5;
  const Rule apart = rule("apart", silence(1.0, "c"), {"camera"});
  Tried tried({low, high, apart});
  tried.run_to(ms(1500));
  EXPECT_TRUE(tried.engine.status(0).active);
  EXPECT_TRUE(tried.engine.status(2).active);
  tried.run_to(ms(2500));
  EXPECT_TRUE(tried.engine.status(1).active);
  EXPECT_TRUE(tried.engine.status(0).active) << "it goes on to want what it wants";
  EXPECT_EQ("2000 low suppressed outranked by a rule of higher rank", tried.words.back());
  EXPECT_EQ(1, tried.decisions.back().other);
  tried.words.clear();
  tried.tell(1);  // b is heard again: high is undone, to what low wants
  EXPECT_FALSE(tried.engine.status(1).active);
  EXPECT_TRUE(tried.engine.status(0).in_effect);
  EXPECT_THAT(tried.words, ElementsAre("2500 high condition_false", "2500 high undo", "2500 high done"));
}

TEST(Rules, WhoIsOutrankedInAllItWantsHasNothingToDo) {
  Rule low = rule("low", silence(2.0, "a"), {"drive"});
  Rule high = rule("high", silence(1.0, "b"), {"drive"});
  high.priority = 5;
  Tried tried({low, high});
  tried.run_to(ms(1500));
  tried.engine.set_in_place(0, Act::do_, true);
  tried.words.clear();
  tried.run_to(ms(2500));
  EXPECT_THAT(tried.words, ElementsAre("2000 low condition_true",
                                       "2000 low suppressed outranked by a rule of higher rank"));
  EXPECT_TRUE(tried.engine.status(0).active);
}

TEST(Rules, ASafetyRuleIsAboveAllOthers) {
  Rule safe = rule("safe", silence(1.0), {"drive"});
  Rule high = rule("high", silence(1.0), {"drive"});
  safe.safety = true;
  high.priority = 1000;
  Tried tried({high, safe});
  tried.acts = false;
  tried.run_to(ms(1001));
  ASSERT_TRUE(tried.engine.pending());
  EXPECT_EQ(1U, tried.engine.pending()->rule);
}

TEST(Rules, ALatchedRuleEndsByAResetOnceItsConditionIsFalse) {
  Rule stop{
      .name = "stop", .when = leaf("boolean", {{"topic", "pressed"}}), .undoes = true, .about = {"base"}};
  stop.latch = true;
  Tried tried({stop});
  tried.tell(0, 1.0);
  EXPECT_TRUE(tried.engine.status(0).in_effect);
  EXPECT_FALSE(tried.engine.reset(0, tried.now_ns)) << "its cause is there";
  tried.tell(0, 0.0);
  tried.run_to(s_to_ns(60));
  EXPECT_TRUE(tried.engine.status(0).active);
  EXPECT_TRUE(tried.engine.reset(0, tried.now_ns));
  tried.run_to(tried.now_ns);
  EXPECT_FALSE(tried.engine.status(0).active);
  EXPECT_FALSE(tried.engine.status(0).in_effect);
  EXPECT_FALSE(tried.engine.reset(0, tried.now_ns)) << "it is not active";
}

TEST(Rules, AnAdoptedLatchedRuleIsNotResetWhileNothingIsKnown) {
  Rule stop{
      .name = "stop", .when = leaf("boolean", {{"topic", "pressed"}}), .undoes = true, .about = {"base"}};
  stop.latch = true;
  Tried tried({stop});
  tried.engine.adopt(0, true, 0);
  tried.run_to(ms(100));
  EXPECT_FALSE(tried.engine.reset(0, tried.now_ns));
  EXPECT_TRUE(tried.engine.status(0).active);
}

TEST(Rules, OneThatIsReleasedEndsAtOnce) {
  Rule gone = rule("gone", {}, {"drive"});
  gone.is_released = true;
  gone.latch = true;
  Tried tried({gone});
  tried.engine.adopt(0, true, 0);
  tried.run_to(ms(1));
  EXPECT_THAT(tried.words, ElementsAre("0 gone adopted", "0 gone undo", "0 gone done"));
  EXPECT_FALSE(tried.engine.status(0).is_at_work);
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

TEST(Rules, NothingAboutItsComponentsIsPreparedWhileAnActionIsUnderWay) {
  TwoDue tried({"c"});
  EXPECT_TRUE(tried.engine.may_prepare(1));
  EXPECT_EQ(0U, tried.begin());
  EXPECT_FALSE(tried.engine.may_prepare(1));
  tried.engine.ended(0, Act::do_, Ended::done, tried.now_ns);
  EXPECT_TRUE(tried.engine.may_prepare(1));
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

TEST(Rules, WhatIsNoLongerInPlaceIsDoneOnceMore) {
  Tried tried({rule("r", silence(1.0))});
  tried.run_to(ms(1500));
  tried.words.clear();
  tried.engine.set_in_place(0, Act::do_, false);  // another value is wanted, or there
  tried.run_to(ms(1600));
  EXPECT_THAT(tried.words, ElementsAre("1500 r do", "1500 r done"));
  EXPECT_TRUE(tried.engine.status(0).in_effect);
}

TEST(Rules, WhatIsInPlaceIsNotDoneAgain) {
  Tried tried({rule("r", silence(1.0))});
  tried.engine.set_in_place(0, Act::do_, true);
  tried.run_to(ms(1500));
  EXPECT_TRUE(tried.engine.status(0).in_effect);
  EXPECT_EQ("1000 r suppressed it is in effect already", tried.words.back());
}

TEST(Rules, WhoStartsWhileItIsActiveUndoesIt) {
  Tried tried({rule("r", silence(1.0))});
  tried.engine.adopt(0, true, tried.now_ns);
  tried.run_to(ms(100));
  EXPECT_TRUE(tried.holds()) << "it held when somebody acted on it";
  EXPECT_TRUE(tried.engine.status(0).in_effect);
  tried.tell(0);
  EXPECT_FALSE(tried.engine.status(0).in_effect);
  EXPECT_EQ("100 r done", tried.words.back());
}

/// While it was undone, to what a lower rule wants, that one has ended.
TEST(Rules, WhatIsUndoneToSomethingElseThanWhatIsWantedIsUndoneOnceMore) {
  Tried tried({rule("r", leaf("boolean", {{"topic", "a"}}), {"c"})});
  tried.engine.set_in_place(0, Act::undo, true);
  tried.tell(0, 1.0);
  tried.engine.set_in_place(0, Act::undo, false);
  tried.tell(0, 0.0);
  EXPECT_TRUE(tried.engine.status(0).is_at_work) << "not confirmed";
  tried.words.clear();
  tried.engine.set_in_place(0, Act::undo, false);
  tried.run_to(ms(1));
  EXPECT_THAT(tried.words, ElementsAre("0 r undo", "0 r done"));
  tried.engine.set_in_place(0, Act::undo, true);
  EXPECT_FALSE(tried.engine.status(0).is_at_work);
  tried.engine.set_in_place(0, Act::undo, false);
  EXPECT_FALSE(tried.engine.status(0).is_at_work) << "what others do later is not its business";
}

TEST(Rules, WhatIsActiveAgainBeforeItWasUndoneIsDoneWhereItIsNotThere) {
  Tried tried({rule("r", leaf("boolean", {{"topic", "a"}}), {"c"})});
  tried.acts = false;
  tried.engine.adopt(0, false, 0);                // what it did is to be undone ...
  tried.engine.set_in_place(0, Act::do_, false);  // ... and is not there
  tried.run_to(ms(1));
  EXPECT_EQ(Act::undo, tried.engine.pending()->act);
  tried.acts = true;
  tried.tell(0, 1.0);
  EXPECT_TRUE(tried.engine.status(0).in_effect);
  EXPECT_EQ(Act::do_, tried.decisions.back().act);
  EXPECT_EQ(Decided::done, tried.decisions.back().decided);
}

/// An emergency stop by a value that is published once: in effect, and the engine is a new one.
struct AdoptedStop : Tried {
  AdoptedStop() : Tried({stop()}) {
    engine.adopt(0, true, 0);
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

TEST(Rules, WhatARuleTookCountsFromWhenItsCooldownWasOver) {
  Rule link = rule("r", leaf("boolean", {{"topic", "a"}}), {"c"});
  link.for_ns = ms(100);
  link.cooldown_ns = ms(2'000);
  Tried tried({link});
  tried.tell(0, 1.0);
  tried.run_to(ms(200));
  tried.tell(0, 0.0);
  tried.run_to(ms(2'200));  // undone at 2100
  tried.tell(0, 1.0);
  tried.run_to(ms(5'000));
  std::vector<std::pair<time_ns_t, time_ns_t>> held;  // of each outcome: when, and for how long
  for (const Decision& one : tried.decisions) {
    if (one.decided == Decided::done) held.emplace_back(one.stamp_ns / 1'000'000, one.held_ns / 1'000'000);
  }
  EXPECT_THAT(held, ElementsAre(std::pair(100, 0), std::pair(2'100, 1'900), std::pair(4'100, 1'800)));
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
