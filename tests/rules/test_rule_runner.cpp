// SPDX-License-Identifier: LGPL-3.0-or-later
// Rules at work beside components, on threads and in virtual time.
#include <atomic>
#include <random>
#include <thread>

#include "mauve_rt/rules/rule_runner.hpp"

#include "data/action_types.hpp"
#include "hosts.hpp"

namespace mauve::rules::test_rule_runner {
namespace {

using namespace mauve::testing;  // NOLINT(google-build-using-namespace): the kernel's fixtures
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

When leaf(const std::string& kind, Parameters parameters) {
  return {.kind = kind, .parameters = std::move(parameters)};
}
ActionSteps core(const std::string& implementation, const std::string& target = "c") {
  return {{.kind = "replace_core", .target = target, .name = implementation}};
}

/// Counts what is done with cores of its kind.
struct CountedCore : TestCore {
  CountedCore() { made.fetch_add(1); }
  bool configure_hook() override {
    configuring.fetch_add(1);
    while (closed.load()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    return TestCore::configure_hook();
  }
  bool adopt(const CoreBase& /*old*/) override {
    made_at_adopt.store(made.load());
    adopted.fetch_add(1);
    return true;
  }
  static void reset() {
    for (std::atomic<int>* count : {&made, &made_at_adopt, &configuring, &adopted}) count->store(0);
    closed.store(false);
  }

  static inline std::atomic<int> made{0};
  static inline std::atomic<int> made_at_adopt{0};
  static inline std::atomic<int> configuring{0};
  static inline std::atomic<int> adopted{0};
  static inline std::atomic<bool> closed{false};  // none is configured until it is open
};
/// A state that does not end while the gate is closed.
class Gate {
 public:
  /// Before the component starts.
  void guard(TestCore& core) {
    core.work = [this] {
      while (is_closed_.load()) {
        is_held_.store(true);
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      }
    };
  }
  template <typename Way>
  void close(Way& way) {
    is_closed_.store(true);
    way.until([this] { return is_held_.load(); }, "the state");
  }
  void open() { is_closed_.store(false); }

 private:
  std::atomic<bool> is_closed_{false};
  std::atomic<bool> is_held_{false};
};

/// Component "c", whose core a rule replaces; "w", about which it asks; and the resource "beat", which the test writes.
template <typename Way>
class RuleRunnerTest : public Hosted<Way> {
 protected:
  RuleRunnerTest() : beat(this->architecture.template add_resource<SharedData<Number>>("beat")) {
    CountedCore::reset();
    this->registry.template core<CountedCore>("t/Counted", "t/Shell");
    for (const char* name : {"c", "w"})
      this->add(name).allow({"t/Counting", "t/Counted", "t/Refusing", "t/Throwing", "t/Unready"}, true);
    watched = &this->architecture.component("w");
  }
  ~RuleRunnerTest() override {
    gate.open();
    if (runner) runner->stop();
    this->way.shutdown();
  }

  void add_rule(When when, ActionSteps undo = core("t/Core"), ActionSteps act = core("t/Counting")) {
    rules.push_back({.name = "rule" + std::to_string(rules.size()),
                     .when = std::move(when),
                     .undoes = !undo.empty(),
                     .about = {"c"}});
    actions.push_back({.do_steps = std::move(act), .undo_steps = std::move(undo)});
  }
  void make() { runner = std::make_unique<RuleRunner>(this->host(), rules, actions, std::move(topics)); }
  /// The rules take the place of those that were at work; `in_between` happens while none is.
  void load(const std::function<void()>& in_between = [] {}) {
    runner->stop();
    take();
    words.clear();
    from = 0;
    in_between();
    auto next = std::make_unique<RuleRunner>(this->host(), rules, actions, topics, runner.get());
    runner = std::move(next);
    runner->start();
    see("armed");
  }
  void begin() {
    make();
    runner->start();
    see("armed");
  }
  /// Time passes until a decision of this word was told since the last such call.
  void see(const std::string& word, std::size_t times = 1) {
    const auto seen = [&] {
      take();
      return static_cast<std::size_t>(std::count(words.begin() + from, words.end(), word)) >= times;
    };
    this->way.until(seen, word.c_str());
    if (this->HasFatalFailure()) add_facts();
    from = static_cast<std::ptrdiff_t>(words.size());
  }
  void add_facts() {
    for (const RuleFacts& facts : runner->facts()) {
      ADD_FAILURE() << facts.name << (facts.ready ? " is ready " : " is not ready ") << facts.problem
                    << (facts.status.active ? " active" : " inactive")
                    << (facts.status.in_effect ? " in effect" : "")
                    << (facts.status.is_at_work ? " at work" : "");
    }
  }
  /// The same, where it may have been told before: in virtual time much happens in one look.
  void see_once(const std::string& word) {
    if (std::count(words.begin(), words.end(), word) == 0) see(word);
  }
  void live(time_ns_t duration_ns) {
    for (const time_ns_t until = this->host().now_ns() + duration_ns; this->host().now_ns() < until;) {
      this->way.run_for(us_to_ns(100));
      take();
    }
  }
  void take() {
    if constexpr (RuleRunnerTest::is_virtual) runner->advance();
    for (Told& told : runner->wait_told(0)) {
      words.emplace_back(name_of(told.decision.decided));
      whole.push_back(std::move(told));
    }
  }
  /// Both rules are ready; then the first one acts, and the second one after it, while "w" does not come to a wait.
  void let_both_act_while_held() {
    gate.guard(this->core(*watched));
    this->deploy();
    begin();
    await_ready(0);
    await_ready(1);
    gate.close(this->way);
    beat.write.write({.value = 4.0}, 1);
    see("do");
    beat.write.write({.value = 20.0}, 2);
  }
  void await_ready(std::size_t rule = 0) {
    const auto is_ready = [&] {
      take();
      return runner->facts()[rule].ready;
    };
    this->way.until(is_ready, "the action to be ready");
  }
  /// A rule without `undo` that puts in Counting, below one that puts in Counted and undoes that.
  void begin_counting_below_counted(When counting, When counted) {
    add_rule(std::move(counting), {}, core("t/Counting"));
    add_rule(std::move(counted), {}, core("t/Counted"));
    rules.back().undoes = true;
    rules.back().priority = 9;
    this->deploy();
    begin();
    await_ready(0);
    await_ready(1);
  }
  void commit_by(const std::string& author, const ActionSteps& steps) {
    this->host().commit(std::move(make_transaction(steps).by(author)), {});
  }
  void act_and_undo() {
    await_ready();
    beat.write.write({.value = 4.0}, 1);
    see("done");
    beat.write.write({.value = 1.0}, 1);
    see("done");
  }
  double gain_of_w() {
    for (const ShownProperty& one : watched->shown().properties) {
      if (one.name == "gain") return std::get<double>(one.value);
    }
    return 0.0;
  }
  void until_there(const std::string& core_of_c, std::optional<double> gain = std::nullopt) {
    const auto is_there = [&] {
      take();
      return present() == core_of_c && (!gain || gain_of_w() == *gain);
    };
    this->way.until(is_there, core_of_c.c_str());
    if (this->HasFatalFailure()) add_facts();
  }
  std::string present() { return this->architecture.component("c").shown().core; }
  Told last(Decided decided) {
    const auto found = std::find_if(whole.rbegin(), whole.rend(),
                                    [&](const Told& told) { return told.decision.decided == decided; });
    EXPECT_NE(whole.rend(), found);
    return found != whole.rend() ? *found : Told{};
  }

  SharedData<Number>& beat;
  Component* watched;
  Gate gate;  // of "w", where the test guards it
  std::vector<mauve::rules::Rule> rules;
  std::vector<RuleActions> actions;
  std::map<std::string, std::string> topics;
  std::unique_ptr<RuleRunner> runner;
  std::vector<std::string> words;
  std::vector<Told> whole;
  std::ptrdiff_t from{0};
};
TYPED_TEST_SUITE(RuleRunnerTest, EveryHost, HostNames);

When silent(double longer_than_s = 0.05) {
  return leaf("silence", {{"resource", "beat"}, {"longer_than_s", longer_than_s}});
}

TYPED_TEST(RuleRunnerTest, DoesAndUndoes) {
  this->add_rule(silent());
  this->deploy();
  this->begin();
  this->see("done");
  EXPECT_EQ("t/Counting", this->present());
  const Told done = this->last(Decided::done);
  ASSERT_TRUE(done.action.report);
  EXPECT_EQ("t/Counting", done.action.report->steps.at(0).to_core);
  EXPECT_GE(done.decision.stamp_ns - done.decision.cause_ns, 0);
  this->beat.write.write({}, 1);
  this->see("done");
  const auto undo = std::find(this->words.begin(), this->words.end(), "undo");
  const auto undone =
      std::find(undo, this->words.end(), "done");  // where the computer stalls, silence is first
  ASSERT_NE(this->words.end(), undone);
  const auto& report = this->whole[static_cast<std::size_t>(undone - this->words.begin())].action.report;
  ASSERT_TRUE(report);
  EXPECT_EQ("t/Core", report->steps.at(0).to_core);
  EXPECT_THAT(std::vector(this->words.begin(), undo + 1),
              ElementsAre("armed", "condition_true", "do", "done", "condition_false", "undo"));
}

When too_high(double above = 3.0) {
  return leaf("value", {{"resource", "beat"}, {"field", "value"}, {"above", above}});
}

TYPED_TEST(RuleRunnerTest, PreparesNothingWhenItIsTime) {
  this->add_rule(too_high(), core("t/Core"), core("t/Counted"));
  this->deploy();
  this->begin();
  this->await_ready();
  EXPECT_GT(this->runner->facts()[0].memory_bytes, 0U);
  const int made = CountedCore::made.load();
  EXPECT_GT(made, 0);
  this->beat.write.write({.value = 4.0}, 1);
  this->see("done");
  EXPECT_EQ("t/Counted", this->present());
  EXPECT_EQ(made, CountedCore::made_at_adopt.load()) << "the core was there before";
}

TYPED_TEST(RuleRunnerTest, ActsWhileNothingCanBePrepared) {
  if (TestFixture::is_virtual) GTEST_SKIP() << "in virtual time nothing lasts";
  this->add_rule(too_high(), core("t/Core"), core("t/Counted"));
  this->add_rule(silent(3600.0), {}, core("t/Counted", "w"));
  this->deploy();
  this->begin();
  this->await_ready(0);
  this->await_ready(1);
  CountedCore::closed.store(true);
  const int configuring = CountedCore::configuring.load();
  std::thread changing([this] { this->host().set_property("w", "gain", 2.0); });  // what is prepared is stale
  this->way.until([&] { return CountedCore::configuring.load() > configuring; }, "the preparation");
  changing.join();
  this->beat.write.write({.value = 4.0}, 1);
  this->way.until([] { return CountedCore::adopted.load() > 0; }, "the commit");
  CountedCore::closed.store(false);
  this->see("done");
  EXPECT_EQ("t/Counted", this->present());
}

// ---- no rule waits for another

TYPED_TEST(RuleRunnerTest, ActsWhileAnothersComponentDoesNotComeToAWait) {
  if (TestFixture::is_virtual) GTEST_SKIP() << "in virtual time nothing lasts";
  this->add_rule(too_high(3.0), {}, core("t/Counting", "w"));
  this->rules.back().about = {"w"};
  this->add_rule(too_high(10.0), {});
  this->let_both_act_while_held();
  this->see("done");
  EXPECT_EQ(1, this->last(Decided::done).decision.rule);
  EXPECT_EQ("t/Counting", this->present());
  this->see("failed");
  EXPECT_EQ(Why::timed_out, this->last(Decided::failed).decision.why);
  EXPECT_EQ(0, this->last(Decided::failed).decision.rule);
  this->gate.open();
  this->see("done");
}

TYPED_TEST(RuleRunnerTest, CallsOffTheActionOfALowerRule) {
  if (TestFixture::is_virtual) GTEST_SKIP() << "in virtual time nothing lasts";
  this->add_rule(too_high(3.0), {}, core("t/Counting", "w"));
  this->add_rule(too_high(10.0), {}, core("t/Counted", "w"));
  for (auto& rule : this->rules) rule.about = {"w"};
  this->rules.back().priority = 1000;
  this->let_both_act_while_held();
  this->see("failed");
  EXPECT_EQ(0, this->last(Decided::failed).decision.rule);
  EXPECT_EQ(Why::withdrawn, this->last(Decided::failed).decision.why);
  const auto has_begun = [this] {
    this->take();
    return this->last(Decided::do_).decision.rule == 1;
  };
  this->way.until(has_begun, "the higher rule to act");
  this->gate.open();
  this->see("done");
  EXPECT_EQ(1, this->last(Decided::done).decision.rule);
  EXPECT_EQ("t/Counted", this->watched->shown().core);
}

/// Whether it could be undone is found out by claiming the component: not at every change of something else.
TYPED_TEST(RuleRunnerTest, IsReadyBesideChangesOfOthers) {
  this->add_rule(too_high(), core("t/Counted"), core("t/Counting"));
  this->deploy();
  this->begin();
  this->await_ready();
  const int made = CountedCore::made.load();
  EXPECT_EQ(1, made) << "it could be undone";
  for (int i = 0; i < 50; ++i) {
    this->host().set_property("w", "gain", 1.0 + i % 2);
    this->live(us_to_ns(500));
  }
  EXPECT_EQ(made, CountedCore::made.load());
  EXPECT_TRUE(this->runner->facts()[0].ready);
  this->beat.write.write({.value = 4.0}, 1);
  this->see("done");
  EXPECT_EQ("t/Counting", this->present());
}

TYPED_TEST(RuleRunnerTest, PreparesWhileAnothersPartIsSlow) {
  if (TestFixture::is_virtual) GTEST_SKIP() << "in virtual time nothing lasts";
  this->add_rule(too_high(), core("t/Core", "w"), core("t/Counted", "w"));
  this->rules.back().about = {"w"};
  this->add_rule(too_high(), core("t/Core"));
  this->deploy();
  this->begin();
  this->await_ready(0);
  CountedCore::closed.store(true);
  const int configuring = CountedCore::configuring.load();
  this->host().set_property("w", "gain", 2.0);  // what is prepared of it is stale
  this->way.until([&] { return CountedCore::configuring.load() > configuring; }, "the slow preparation");
  this->host().set_property("c", "gain", 2.0);
  this->await_ready(1);
  this->beat.write.write({.value = 4.0}, 1);
  this->see("done");
  EXPECT_EQ("t/Counting", this->present());
  this->beat.write.write({.value = 1.0}, 1);
  this->see("done");
  EXPECT_EQ("t/Core", this->present()) << "the undo was prepared, too";
  CountedCore::closed.store(false);
}

/// Each action that was begun has one outcome, and of rules about one component only one is under way at a time.
TYPED_TEST(RuleRunnerTest, KeepsActionsApartInAStorm) {
  std::mt19937 random(7);
  for (int i = 0; i < 6; ++i) {
    const std::string target = i % 2 == 0 ? "c" : "w";
    this->add_rule(too_high(1.0 + i), core("t/Core", target),
                   core(i < 3 ? "t/Counting" : "t/Counted", target));
    this->rules.back().about = {target};
    this->rules.back().priority = static_cast<std::int64_t>(random() % 3);
  }
  this->deploy();
  this->begin();
  const auto actions = [this] { return std::count(this->words.begin(), this->words.end(), "do"); };
  const time_ns_t until = this->host().now_ns() + ms_to_ns(500);
  while (this->host().now_ns() < until || actions() <= 10) {
    this->beat.write.write({.value = static_cast<double>(random() % 9)}, 1);
    try {
      if (random() % 20 == 0) this->host().set_property("w", "gain", 2.0);
    } catch (const Error& failure) {  // an action of a rule came before it
      EXPECT_EQ(ErrorCode::wrong_revision, failure.code());
    }
    this->way.run_for(us_to_ns(static_cast<std::int64_t>(random() % 3000)));
    if (random() % 2 == 0) this->take();
  }
  this->beat.write.write({.value = 0.0}, 2);
  const auto is_calm = [this] {
    this->take();
    const std::vector<RuleFacts> facts = this->runner->facts();
    return this->present() == "t/Core" && this->watched->shown().core == "t/Core" &&
           std::none_of(facts.begin(), facts.end(),
                        [](const RuleFacts& each) { return each.status.holds() || each.status.in_effect; });
  };
  this->way.until(is_calm, "all to be undone");
  if (this->HasFatalFailure()) this->add_facts();
  this->runner->stop();
  this->take();
  std::map<std::string, std::int32_t> under_way;  // by component
  int begun = 0;
  std::sort(this->whole.begin(), this->whole.end(),
            [](const Told& one, const Told& other) { return one.number < other.number; });
  for (const Told& told : this->whole) {
    const Decided decided = told.decision.decided;
    const std::string& about = this->rules.at(static_cast<std::size_t>(told.decision.rule)).about.front();
    if (decided == Decided::do_ || decided == Decided::undo) {
      EXPECT_FALSE(under_way.contains(about)) << "two at a time";
      under_way[about] = told.decision.rule;
      ++begun;
    } else if (decided == Decided::done || decided == Decided::failed) {
      ASSERT_TRUE(under_way.contains(about));
      EXPECT_EQ(told.decision.rule, under_way.at(about));
      under_way.erase(about);
    }
  }
  EXPECT_TRUE(under_way.empty()) << "an action without an outcome";
  EXPECT_GT(begun, 10);
}

// ---- the reserve action

TYPED_TEST(RuleRunnerTest, StopsWhereWhatItDoesCannotBeMadeReady) {
  this->add_rule(silent(), {}, core("t/Unready"));
  this->rules.back().otherwise_after_ns = ms_to_ns(10);
  this->deploy();
  this->begin();
  this->see("done");
  EXPECT_EQ(Act::otherwise, this->last(Decided::done).decision.act);
  EXPECT_EQ(ComponentState::stopped, this->architecture.component("c").task().state());
  EXPECT_EQ(ComponentState::running, this->watched->task().state());
  const auto is_disarmed =
      [this] {  // a busy machine lets a first try fail, and the component stop by the second
        this->take();
        return std::any_of(this->whole.begin(), this->whole.end(),
                           [](const Told& told) { return told.decision.decided == Decided::disarmed; });
      };
  this->way.until(is_disarmed, "the rule to watch no longer");
}

TYPED_TEST(RuleRunnerTest, MakesOutputsSafeWhereItsComponentHangs) {
  if (TestFixture::is_virtual) GTEST_SKIP() << "in virtual time nothing lasts";
  this->add_rule(silent(), {}, core("t/Counting", "w"));
  this->rules.back().about = {"w"};
  this->rules.back().otherwise_after_ns = ms_to_ns(10);
  this->actions.back().reserve = ReserveKind::safe_outputs;
  this->gate.guard(this->core(*this->watched));
  this->deploy();
  this->begin();
  this->gate.close(this->way);
  this->see("done");
  EXPECT_EQ(Act::otherwise, this->last(Decided::done).decision.act);
  EXPECT_EQ(ComponentState::faulted, this->watched->task().state()) << "while its state lasts";
  EXPECT_EQ(ComponentState::running, this->architecture.component("c").task().state());
  const auto is_called_off = [this] {
    this->take();
    return std::find(this->words.begin(), this->words.end(), "failed") != this->words.end();
  };
  this->way.until(is_called_off, "the end of what it does");
  EXPECT_EQ(Act::do_, this->last(Decided::failed).decision.act);
}

TYPED_TEST(RuleRunnerTest, LetsAStateEndBeforeItGivesItsComponentUp) {
  if (TestFixture::is_virtual) GTEST_SKIP() << "in virtual time nothing lasts";
  this->add_rule(silent(), {}, core("t/Unready", "w"));
  this->rules.back().about = {"w"};
  this->rules.back().otherwise_after_ns = ms_to_ns(10);
  this->gate.guard(this->core(*this->watched));
  this->deploy();
  this->begin();
  this->gate.close(this->way);
  this->see("otherwise");
  this->gate.open();
  this->see("done");
  const ComponentState state =
      this->watched->task().state();  // a stall may have lasted longer than the patience
  EXPECT_TRUE(state == ComponentState::stopped || state == ComponentState::faulted);
}

TYPED_TEST(RuleRunnerTest, WritesEveryDecisionIntoTheTrace) {
  this->add_rule(too_high());
  this->deploy();
  this->begin();
  this->beat.write.write({.value = 4.0}, 1);
  this->see("done");
  this->beat.write.write({.value = 3.0}, 1);
  this->see("done");
  const std::vector<std::string> names = this->architecture.trace_components();
  std::vector<std::int64_t> codes;
  std::vector<std::uint64_t> sequences;
  for (const TraceRecord& record : this->host().drain_trace().records) {
    if (record.kind != static_cast<std::uint16_t>(TraceKind::decision)) continue;
    EXPECT_EQ("(rules)", names.at(record.component));
    EXPECT_EQ("rule0", TraceNames::word(record.name));
    EXPECT_EQ(this->whole.at(codes.size()).decision.stamp_ns, record.time_ns);
    EXPECT_EQ(this->whole.at(codes.size()).decision.cause_ns, record.b);
    codes.push_back(record.a);
    sequences.push_back(record.sequence);
  }
  EXPECT_THAT(codes, ElementsAre(0, 3, 5, 7, 4, 6, 8)) << "as TraceRecord.msg counts";
  EXPECT_THAT(sequences, ElementsAre(0, 1, 2, 3, 4, 5, 6));
}

TYPED_TEST(RuleRunnerTest, HearsMessagesOfABoundTopic) {
  this->topics = {{"radio/in", "beat"}};
  this->add_rule(leaf("silence", {{"topic", "radio/in"}, {"longer_than_s", 0.05}}));
  this->deploy();
  this->begin();
  this->see("done");
  EXPECT_EQ("t/Counting", this->present());
}

TYPED_TEST(RuleRunnerTest, TakesWhatIsInEffectAsItsOwn) {
  this->add_rule(silent());
  this->deploy();
  this->begin();
  this->see("done");
  this->runner.reset();
  this->from = 0;
  this->words.clear();
  this->begin();
  this->live(ms_to_ns(20));
  EXPECT_THAT(this->words, ElementsAre("adopted", "armed", "condition_true"));
  this->beat.write.write({}, 1);
  this->see("done");
  EXPECT_EQ("t/Core", this->present());
}

/// What was there before comes back, whoever put it there.
TYPED_TEST(RuleRunnerTest, PutsBackWhatAnOperatorChose) {
  for (const bool takes_over : {false, true}) {
    SCOPED_TRACE(takes_over);
    if (this->rules.empty()) {
      this->add_rule(too_high());
      this->deploy();
    }
    this->actions.back().takes_over = takes_over;
    this->beat.write.write({.value = 1.0}, 1);
    this->commit_by("operator", core("t/Counted"));
    this->begin();
    this->await_ready();
    this->beat.write.write({.value = 4.0}, 1);
    this->see("done");
    EXPECT_EQ("t/Counting", this->present());
    this->beat.write.write({.value = 1.0}, 1);
    this->see("done");
    EXPECT_EQ(takes_over ? "t/Core" : "t/Counted", this->present());
    this->runner->stop();
    this->runner.reset();
    this->words.clear();
    this->from = 0;
  }
}

TYPED_TEST(RuleRunnerTest, WhatNobodyNamesComesBackToo) {
  this->add_rule(too_high(), {}, core("t/Counting"));
  this->rules.back().undoes = true;
  this->actions.back().do_steps.push_back(
      {.kind = "set_property", .target = "w", .name = "gain", .value = 7.0});
  this->deploy();
  this->host().set_property("w", "gain", 3.0);
  this->begin();
  this->act_and_undo();
  EXPECT_EQ("t/Core", this->present());
  EXPECT_EQ(3.0, this->gain_of_w());
}

/// Of a lower rule that a higher one takes one of two elements from, both in any order.
TYPED_TEST(RuleRunnerTest, EachElementIsDecidedByItself) {
  this->add_rule(too_high(3.0), {}, core("t/Counting"));
  this->actions.back().do_steps.push_back(
      {.kind = "set_property", .target = "w", .name = "gain", .value = 7.0});
  this->rules.back().about = {"c", "w"};
  this->add_rule(too_high(10.0), {}, core("t/Counted"));
  for (auto& rule : this->rules) rule.undoes = true;
  this->rules.back().priority = 9;
  this->deploy();
  this->begin();
  const double nominal = this->gain_of_w();
  for (const bool low_first : {true, false}) {
    SCOPED_TRACE(low_first);
    this->await_ready(0);
    this->await_ready(1);
    if (low_first) {
      this->beat.write.write({.value = 4.0}, 1);
      this->until_there("t/Counting", 7.0);
    }
    this->beat.write.write({.value = 20.0}, 1);
    this->until_there("t/Counted", 7.0);
    this->beat.write.write({.value = 1.0}, 1);
    this->until_there("t/Core", nominal);
  }
}

TYPED_TEST(RuleRunnerTest, FromAHigherRulesEndItGoesStraightToTheLowerOnesWant) {
  this->add_rule(too_high(3.0), core("t/Core"), core("t/Counting"));
  this->add_rule(too_high(10.0), core("t/Core"), core("t/Counted"));
  this->rules.back().priority = 9;
  this->deploy();
  this->begin();
  this->await_ready(0);
  this->await_ready(1);
  this->beat.write.write({.value = 20.0}, 1);
  this->until_there("t/Counted");
  this->beat.write.write({.value = 4.0}, 1);
  Told undone;
  const auto is_undone = [&] {
    this->take();
    for (const Told& told : this->whole) {
      if (told.decision.decided == Decided::done && told.decision.act == Act::undo) undone = told;
    }
    return undone.action.report.has_value();
  };
  this->way.until(is_undone, "the undo");
  ASSERT_TRUE(undone.action.report);
  EXPECT_EQ("t/Counted", undone.action.report->steps.at(0).from_core);
  EXPECT_EQ("t/Counting", undone.action.report->steps.at(0).to_core);
  this->beat.write.write({.value = 1.0}, 1);
  this->until_there("t/Core");
}

TYPED_TEST(RuleRunnerTest, TheFactsAreShownAlsoWhereTheyAreAskedForAllTheTime) {
  this->add_rule(too_high(3.0));
  this->rules.back().for_ns = s_to_ns(1000);  // it does nothing
  this->deploy();
  this->begin();
  std::atomic<bool> is_over{false};
  std::thread other([&] {
    while (!TestFixture::is_virtual && !is_over) this->runner->facts();
  });
  for (int i = 0; i < 300 && !this->HasFatalFailure(); ++i) {
    const bool is_high = i % 2 == 0;
    this->beat.write.write({.value = is_high ? 4.0 : 1.0}, 1);
    const auto is_shown = [&] {
      this->take();
      return this->runner->facts()[0].status.truth == truth_of(is_high);
    };
    this->way.until(is_shown, "the truth of the condition");
  }
  is_over = true;
  other.join();
}

TYPED_TEST(RuleRunnerTest, ARuleWithoutUndoLeavesNothingThatWasNotInForce) {
  this->begin_counting_below_counted(too_high(10.0), too_high(3.0));
  const auto await_active = [this](bool is_expected) {
    const auto is_so = [this, is_expected] {
      this->take();
      return this->runner->facts()[0].status.active == is_expected;
    };
    this->way.until(is_so, "the lower rule to turn");
  };
  this->beat.write.write({.value = 4.0}, 1);
  this->until_there("t/Counted");
  this->beat.write.write({.value = 20.0}, 1);
  await_active(true);
  this->beat.write.write({.value = 4.0}, 1);
  await_active(false);
  this->beat.write.write({.value = 1.0}, 1);
  this->until_there("t/Core");
}

TYPED_TEST(RuleRunnerTest, ARuleWithoutUndoLeavesWhatWasInForceBelowAnother) {
  this->begin_counting_below_counted(too_high(3.0), too_high(10.0));
  this->beat.write.write({.value = 4.0}, 1);
  this->until_there("t/Counting");
  this->beat.write.write({.value = 20.0}, 1);
  this->until_there("t/Counted");
  this->beat.write.write({.value = 1.0}, 1);
  this->until_there("t/Counting");
}

TYPED_TEST(RuleRunnerTest, WhatProbationRejectedIsNotPutInAgain) {
  this->add_rule(too_high(), core("t/Counted"), core("t/Counting"));
  this->deploy();
  this->begin();
  this->await_ready();
  this->beat.write.write({.value = 4.0}, 1);
  this->see("done");
  this->architecture.overlays().reject(
      {.element = {.target = "c", .name = "core"},
       .step = {.kind = "replace_core", .target = "c", .name = "t/Counted"}});
  this->beat.write.write({.value = 1.0}, 1);
  this->see("done");
  EXPECT_EQ("t/Core", this->present()) << "the base before";
}

TYPED_TEST(RuleRunnerTest, ARuleThatIsGoneIsUndone) {
  this->add_rule(too_high(), {}, core("t/Counting"));
  this->rules.back().undoes = true;
  this->add_rule(too_high(100.0), {}, core("t/Counted", "w"));
  this->deploy();
  this->begin();
  this->await_ready();
  this->beat.write.write({.value = 4.0}, 1);
  this->see("done");
  this->rules.erase(this->rules.begin());
  this->actions.erase(this->actions.begin());
  this->load();
  this->until_there("t/Core");
}

TYPED_TEST(RuleRunnerTest, ARuleThatIsAnotherStaysActiveWithWhatItWantsNow) {
  this->add_rule(too_high(), {}, core("t/Counting"));
  this->rules.back().undoes = true;
  this->actions.back().do_steps.push_back(
      {.kind = "set_property", .target = "w", .name = "gain", .value = 7.0});
  this->deploy();
  this->begin();
  const double nominal = this->gain_of_w();
  this->await_ready();
  this->beat.write.write({.value = 4.0}, 1);
  this->until_there("t/Counting", 7.0);
  this->actions.back().do_steps = core("t/Counted");
  this->load();
  this->until_there("t/Counted", nominal);
  this->beat.write.write({.value = 1.0}, 1);
  this->until_there("t/Core", nominal);
}

TYPED_TEST(RuleRunnerTest, WhatIsActiveIsInForceBeforeTheFirstReleaseAfterAnActivation) {
  this->add_rule(too_high(), {}, {{.kind = "stop", .target = "c"}});
  this->rules.back().undoes = true;
  this->deploy();
  this->begin();
  this->await_ready();
  this->beat.write.write({.value = 4.0}, 1);
  this->see("done");
  this->runner->stop();
  this->way.shutdown();
  this->deploy();
  EXPECT_EQ(ComponentState::stopped, this->architecture.component("c").task().state());
  EXPECT_EQ(ComponentState::running, this->watched->task().state());
  this->load();
  this->beat.write.write({.value = 1.0}, 1);
  this->way.until(
      [this] {
        this->take();
        return this->architecture.component("c").task().state() == ComponentState::running;
      },
      "the component to start again");
}

TYPED_TEST(RuleRunnerTest, IsTheAuthorOfWhatItDoes) {
  this->add_rule(silent());
  this->deploy();
  this->begin();
  this->see("done");
  EXPECT_THAT(this->architecture.authors(),
              ElementsAre(Authored{.target = "c", .element = "core", .author = "rule rule0"}));
  this->host().replace_core("c", "t/Counting");
  EXPECT_TRUE(this->architecture.authors().empty()) << "the program itself, now";
}

TYPED_TEST(RuleRunnerTest, ItIsInForceWhileItIsActiveWhateverAProgramDoes) {
  this->add_rule(silent());
  this->deploy();
  this->begin();
  this->see("done");
  this->host().replace_core("c", "t/Counted");
  this->see("done");
  EXPECT_EQ("t/Counting", this->present());
  this->beat.write.write({}, 1);
  this->see("done");
  EXPECT_EQ("t/Core", this->present());
}

TYPED_TEST(RuleRunnerTest, SaysAtOnceWhatCannotBeMadeReady) {
  this->add_rule(silent(1.0), core("t/Core"), core("t/Unready"));
  this->add_rule(silent(1.0), core("t/Undeclared"));
  this->deploy();
  this->begin();
  this->take();
  const std::vector<RuleFacts> facts = this->runner->facts();
  ASSERT_THAT(facts, SizeIs(2));
  EXPECT_FALSE(facts[0].ready);
  EXPECT_THAT(facts[0].problem, HasSubstr("t/Unready"));
  EXPECT_TRUE(facts[1].ready);
  EXPECT_THAT(facts[1].problem, HasSubstr("t/Undeclared")) << "it could not be undone";
}

TYPED_TEST(RuleRunnerTest, SaysSoWhenAnActionCanNoLongerBeMadeReady) {
  this->add_rule(silent(600), {{.kind = "connect", .target = "c", .name = "input", .value = "gone.read"}},
                 {{.kind = "connect", .target = "c", .name = "input", .value = "late.read"}});
  this->architecture.template add_resource<SharedData<Number>>("late");
  this->architecture.template add_resource<SharedData<Number>>("gone");
  this->deploy();
  this->begin();
  this->await_ready();
  Transaction transaction;
  transaction.remove_resource("late");
  this->commit(transaction);
  this->way.until(
      [&] {
        this->take();
        return !this->runner->facts()[0].ready;
      },
      "the action not to be ready");
  EXPECT_THAT(this->runner->facts()[0].problem, HasSubstr("late"));
}

TYPED_TEST(RuleRunnerTest, IsNotArmedBeforeItsComponentRuns) {
  this->add_rule(silent());
  this->deploy();
  this->host().stop("c", s_to_ns(10));
  this->make();
  this->runner->start();
  this->live(ms_to_ns(100));
  EXPECT_THAT(this->words, IsEmpty());
  this->host().start("c");
  this->see("done");
  EXPECT_EQ("armed", this->words.front());
}

// ---- what there is at the start, and from one set of rules to the next

TYPED_TEST(RuleRunnerTest, BeginsWithTheValueThatIsThere) {
  this->add_rule(too_high());
  this->deploy();
  this->beat.write.write({.value = 4.0}, 1);
  this->begin();
  this->see_once("done");
  EXPECT_EQ("t/Counting", this->present());
}

TYPED_TEST(RuleRunnerTest, KnowsNothingOfAResourceThatWasNeverWritten) {
  this->add_rule({.kind = "not", .parts = {too_high()}});
  this->deploy();
  this->begin();
  this->live(ms_to_ns(20));
  EXPECT_EQ("t/Core", this->present());
  EXPECT_EQ(Truth::unknown, this->runner->facts()[0].status.truth);
  this->beat.write.write({.value = 1.0}, 1);
  this->see("done");
  EXPECT_EQ("t/Counting", this->present());
}

TYPED_TEST(RuleRunnerTest, AStopByAValueThatStaysIsNotUndoneByNewRules) {
  this->add_rule(too_high());
  this->deploy();
  this->begin();
  this->beat.write.write({.value = 4.0}, 1);
  this->see("done");
  this->load();
  this->live(ms_to_ns(20));
  EXPECT_THAT(this->words, ElementsAre("armed")) << "the same rule goes on";
  EXPECT_TRUE(this->runner->facts()[0].status.in_effect);
  this->rules[0].undo_for_ns = ms_to_ns(1);  // another rule of the name, about the same
  this->load();
  this->live(ms_to_ns(20));
  EXPECT_TRUE(this->runner->facts()[0].status.in_effect);
  EXPECT_EQ("t/Counting", this->present());
  this->beat.write.write({.value = 1.0}, 1);
  this->see("done");
  EXPECT_EQ("t/Core", this->present());
}

TYPED_TEST(RuleRunnerTest, NothingIsMissedFromOneSetOfRulesToTheNext) {
  this->add_rule(too_high());
  this->deploy();
  this->begin();
  this->load([this] {
    for (const double value : {2.0, 4.0, 2.0}) this->beat.write.write({.value = value}, 1);
  });
  this->see_once("condition_true");
}

TYPED_TEST(RuleRunnerTest, DwellTimesGoOnFromOneSetOfRulesToTheNext) {
  this->add_rule(too_high());
  this->rules.back().for_ns = ms_to_ns(200);
  this->deploy();
  this->begin();
  this->beat.write.write({.value = 4.0}, 1);
  this->see("condition_true");
  const time_ns_t true_ns = this->last(Decided::condition_true).decision.cause_ns;
  for (int i = 0; i < 5; ++i) {
    this->live(ms_to_ns(20));
    this->load();
  }
  this->see_once("done");
  EXPECT_EQ(true_ns, this->last(Decided::do_).decision.cause_ns);
}

TYPED_TEST(RuleRunnerTest, NewRulesThatCannotHearLeaveTheOldOnesAsTheyWere) {
  this->add_rule(too_high());
  this->deploy();
  this->begin();
  this->beat.write.write({.value = 4.0}, 1);
  this->see("done");
  this->runner->stop();
  const auto good = this->rules;
  this->add_rule(leaf("silence", {{"resource", "nothing"}, {"longer_than_s", 1.0}}));
  const auto make = [&] { RuleRunner(this->host(), this->rules, this->actions, {}, this->runner.get()); };
  EXPECT_THAT(this->refusal(make).what(), HasSubstr("nothing"));
  this->rules = good;
  this->actions.pop_back();
  this->load();
  this->live(ms_to_ns(20));
  EXPECT_TRUE(this->runner->facts()[0].status.in_effect);
  this->beat.write.write({.value = 1.0}, 1);
  this->see("done");
  EXPECT_EQ("t/Core", this->present());
}

TYPED_TEST(RuleRunnerTest, RulesAboutOneComponentComeAndGo) {
  this->add_rule(leaf("fault", {{"component", "w"}}));
  this->deploy();
  this->begin();
  for (int i = 0; i < 10; ++i) {
    this->add_rule(leaf("overruns", {{"component", "w"}}), {});
    this->load();
    this->rules.pop_back();
    this->actions.pop_back();
    this->load();
  }
  this->host().stop("w", s_to_ns(10));
  this->core(*this->watched).work = [] { throw std::runtime_error("broken"); };
  this->host().start("w");
  this->see("done");
  EXPECT_EQ("t/Counting", this->present());
}

// ---- what it hears

TYPED_TEST(RuleRunnerTest, HearsAValueAndItsComingBack) {
  this->add_rule(leaf("value", {{"resource", "beat"}, {"field", "value"}, {"above", 3.0}}));
  this->deploy();
  this->begin();
  this->beat.write.write({.value = 2.0}, 1);
  this->live(ms_to_ns(20));
  EXPECT_THAT(this->words, ElementsAre("armed"));
  this->beat.write.write({.value = 4.0}, 1);
  this->see("done");
  this->beat.write.write({.value = 3.0}, 1);
  this->see("done");
  EXPECT_EQ("t/Core", this->present());
}

TYPED_TEST(RuleRunnerTest, ALinkIsNotSilentWhileMessagesArriveThatAreNotWrittenYet) {
  this->topics = {{"radio/in", "beat"}};
  this->add_rule(leaf("link_silence", {{"topic", "radio/in"}, {"longer_than_s", 0.05}}));
  this->deploy();
  this->begin();
  this->see("done");
  this->beat.arrived(1);
  this->see("done");
  EXPECT_EQ("t/Core", this->present());
}

TYPED_TEST(RuleRunnerTest, ATopicIsSilentUntilAMessageCanBeRead) {
  this->topics = {{"radio/in", "beat"}};
  this->add_rule(leaf("silence", {{"topic", "radio/in"}, {"longer_than_s", 0.05}}));
  this->deploy();
  this->begin();
  this->see("done");
  for (int i = 0; i < 10; ++i) {
    this->beat.arrived(1);
    this->live(ms_to_ns(20));
  }
  EXPECT_EQ("t/Counting", this->present());
  this->beat.write.write({.value = 1.0}, 1);
  this->see("done");
  EXPECT_EQ("t/Core", this->present());
}

TYPED_TEST(RuleRunnerTest, SilenceIsProvenAsFarAsWhoReceivesHasCaughtUp) {
  this->add_rule(silent());
  this->deploy();
  this->make();
  this->beat.caught_up(this->host().now_ns());
  this->runner->start();
  this->live(ms_to_ns(200));
  this->beat.caught_up(this->host().now_ns());
  this->see("done");
  EXPECT_EQ("t/Counting", this->present());
  const time_ns_t armed_ns = this->last(Decided::armed).decision.stamp_ns;
  EXPECT_GE(this->last(Decided::condition_true).decision.stamp_ns - armed_ns, ms_to_ns(150))
      << "not after 50";
}

/// A value that was beyond its bound between two looks only.
TYPED_TEST(RuleRunnerTest, HearsEveryPulse) {
  this->add_rule(too_high());
  this->deploy();
  this->begin();
  const auto pulse = [this] {
    for (const double value : {2.0, 4.0, 2.0}) this->beat.write.write({.value = value}, 1);
  };
  this->await_ready();
  pulse();
  this->see("done", 2);
  EXPECT_EQ("t/Core", this->present());
  for (int i = 1; i < 20; ++i) {  // acted on or not: what is to be done may not be ready again
    pulse();
    this->see("condition_false");
  }
  EXPECT_EQ(20, std::count(this->words.begin(), this->words.end(), "condition_true"));
}

TYPED_TEST(RuleRunnerTest, HearsThatTheNodeIsSilent) {
  this->add_rule(leaf("node_silent", {{"longer_than_s", 2.0}}));
  this->deploy();
  this->begin();
  if (TestFixture::is_virtual) {  // whoever advances time is at work
    for (int k = 0; k < 30; ++k) {
      this->way.run_for(ms_to_ns(100));
      this->take();
    }
    EXPECT_THAT(this->words, ElementsAre("armed"));
    return;
  }
  this->see("done");
  EXPECT_EQ("t/Counting", this->present());
  this->runner->beat();
  this->see("done");
  EXPECT_EQ("t/Core", this->present());
}

/// A value that flaps faster than its decisions are reported: memory stays bounded, and no outcome is lost.
TYPED_TEST(RuleRunnerTest, LeavesOutDecisionsThatNobodyTakes) {
  this->rules.push_back({.name = "flapping", .when = too_high(), .for_ns = s_to_ns(3600), .about = {"c"}});
  this->actions.push_back({.do_steps = core("t/Counting")});
  this->deploy();
  this->begin();
  const auto flap = [&] {
    for (const double value : {4.0, 2.0}) {
      this->beat.write.write({.value = value}, 1);
      if constexpr (TestFixture::is_virtual) this->runner->advance();
      this->way.run_for(us_to_ns(100));
    }
    return this->runner->lost() > 0;
  };
  const time_ns_t until = monotonic_now_ns() + s_to_ns(60);
  while (!flap()) ASSERT_LT(monotonic_now_ns(), until);
  EXPECT_EQ(1000U, this->runner->wait_told(0).size());
}

TYPED_TEST(RuleRunnerTest, HearsAFault) {
  this->add_rule(leaf("fault", {{"component", "w"}}));
  this->deploy();
  this->begin();
  this->host().stop("w", s_to_ns(10));
  this->core(*this->watched).work = [] { throw std::runtime_error("broken"); };
  this->host().start("w");
  this->see("done");
  EXPECT_EQ("t/Counting", this->present());
}

TYPED_TEST(RuleRunnerTest, HearsOverruns) {
  const auto many =
      leaf("overruns", {{"component", "w"}, {"at_least", std::int64_t{3}}, {"within_s", 100.0}});
  this->add_rule(many, {});
  this->deploy();
  this->begin();
  this->host().stop("w", s_to_ns(10));
  const Clock& clock = this->host().clock();
  this->core(*this->watched).work = [&clock] {
    clock.spend(ms_to_ns(5));  // of virtual time
    if constexpr (!TestFixture::is_virtual) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  };
  this->host().start("w");
  this->see("done");
  EXPECT_GE(this->last(Decided::do_).decision.measured, 3.0);
}

TYPED_TEST(RuleRunnerTest, HearsLateResponses) {
  const auto slow = leaf("late", {{"component", "w"}, {"what", "response"}, {"longer_than_s", 0.001}});
  this->add_rule(slow, {});
  this->deploy();
  this->host().stop("w", s_to_ns(10));
  this->begin();
  const Clock& clock = this->host().clock();
  this->core(*this->watched).work = [&clock] {
    clock.spend(us_to_ns(1500));
    if constexpr (!TestFixture::is_virtual) std::this_thread::sleep_for(std::chrono::microseconds(1500));
  };
  this->host().start("w");
  this->see("done");
}

TYPED_TEST(RuleRunnerTest, HearsThatReleasesDoNotCome) {
  this->add_rule(leaf("no_release", {{"component", "w"}, {"periods", 50.0}}));
  this->deploy();
  this->begin();
  this->live(ms_to_ns(30));
  EXPECT_THAT(this->words, ElementsAre("armed"));
  this->host().stop("w", s_to_ns(10));
  this->see("done");
  const Told acted = this->last(Decided::do_);
  EXPECT_GE(acted.decision.measured, 0.1) << "50 periods of 2 ms";
  this->host().start("w");
  this->see("done");
  EXPECT_EQ("t/Core", this->present());
}

TYPED_TEST(RuleRunnerTest, HearsOfChangesOfTheArchitectureAndOfAComponent) {
  this->add_rule(leaf("since_change", {{"longer_than_s", 0.1}}), {}, core("t/Counting", "w"));
  this->add_rule(leaf("since_change", {{"component", "w"}, {"longer_than_s", 0.1}}), {});
  this->deploy();
  this->begin();
  const time_ns_t changed_ns = this->host().now_ns();
  this->host().set_property("w", "gain", 2.0);
  this->see("done", 2);
  EXPECT_GE(this->whole.back().decision.stamp_ns, changed_ns + ms_to_ns(100));
}

/// A server of goals, as a component and the bridge see it.
template <typename Way>
class RulesOfGoals : public RuleRunnerTest<Way> {
 protected:
  RulesOfGoals() { decide.connect(drive.decide, "drive"); }
  ~RulesOfGoals() override { decide.disconnect(); }
  void watch(Parameters told) {
    told["resource"] = std::string("drive");
    this->add_rule(leaf("action", std::move(told)));
    this->deploy();
    this->begin();
    this->live(ms_to_ns(20));
    EXPECT_EQ("t/Core", this->present());
    EXPECT_EQ(Truth::no, this->runner->facts()[0].status.truth);
  }
  void ask() { EXPECT_EQ(GoalReason::none, GoalCarrier(drive).ask(++asked, 1, this->host().now_ns())); }
  /// As a component that reads `status`: the goals that wait for an answer are accepted.
  void accept() {
    ActionGoal goal;
    time_ns_t time_ns = 0;
    ReaderState reader;
    drive.status.read(goal, time_ns, reader);
    EXPECT_EQ(GoalState::executing, goal.its_state());
  }
  void end(GoalState state) {
    EXPECT_TRUE(drive.decide.write(decision(state), this->host().now_ns()));
    GoalCarrier(drive).take();
  }

  ActionServer<Walk>& drive{this->architecture.template add_resource<ActionServer<Walk>>("drive", 2)};
  WritePort<ActionGoal> decide{"decide"};
  std::uint8_t asked{0};
};
TYPED_TEST_SUITE(RulesOfGoals, EveryHost, HostNames);

TYPED_TEST(RulesOfGoals, AGoalIsOverdueUntilItEnds) {
  this->watch({{"is", "overdue"}, {"longer_than_s", 0.05}});
  this->ask();
  this->live(ms_to_ns(70));
  EXPECT_EQ("t/Core", this->present()) << "no component has accepted the goal";
  const time_ns_t accepted_ns = this->host().now_ns();
  this->drive.decide.write(decision(GoalState::accepted), accepted_ns);
  this->see("done");
  EXPECT_EQ("t/Counting", this->present());
  EXPECT_GT(this->last(Decided::do_).decision.stamp_ns, accepted_ns + ms_to_ns(50));
  EXPECT_GT(this->last(Decided::do_).decision.measured, 0.05);
  this->end(GoalState::succeeded);
  this->see("done");
  EXPECT_EQ("t/Core", this->present());
}

TYPED_TEST(RulesOfGoals, EachGoalHasItsOwnTime) {
  this->watch({{"is", "overdue"}, {"longer_than_s", 1.0}});
  for (int i = 0; i < 4; ++i) {
    this->ask();
    this->accept();
    this->live(ms_to_ns(300));
    this->end(GoalState::succeeded);
  }
  EXPECT_EQ(0, std::count(this->words.begin(), this->words.end(), "do"));
}

TYPED_TEST(RulesOfGoals, AnAbortedGoalIsAFailureUntilTheNextIsAccepted) {
  this->watch({{"is", "aborted"}});
  this->ask();
  this->accept();
  this->end(GoalState::aborted);
  this->see("done");
  EXPECT_EQ("t/Counting", this->present());
  this->ask();
  this->live(ms_to_ns(20));
  EXPECT_EQ("t/Counting", this->present());
  this->accept();
  this->see("done");
  EXPECT_EQ("t/Core", this->present());
}

TYPED_TEST(RulesOfGoals, AGoalThatTheKernelRejectsIsAFailure) {
  this->watch({{"is", "aborted"}});
  this->ask();
  this->drive.poll(this->host().now_ns() + kDefaultAnswerTime);
  this->see("done");
  EXPECT_EQ("t/Counting", this->present());
}

TYPED_TEST(RulesOfGoals, BeginWithTheGoalThatExecutes) {
  this->add_rule(leaf("action", {{"resource", "drive"}, {"is", "overdue"}, {"longer_than_s", 0.05}}));
  this->deploy();
  this->ask();
  this->accept();
  this->way.run_for(ms_to_ns(70));
  this->begin();
  this->see_once("done");
  EXPECT_EQ("t/Counting", this->present());
}

TYPED_TEST(RulesOfGoals, AGoalEndsWithItsResource) {
  auto& dock = this->architecture.template add_resource<ActionClient<Walk>>("dock");
  this->add_rule(leaf("action", {{"resource", "dock"}, {"is", "overdue"}, {"longer_than_s", 0.05}}));
  this->deploy();
  this->begin();
  dock.goal.write({1}, this->host().now_ns());
  dock.answer(1, true, this->host().now_ns());
  dock.set_state(1, GoalState::executing, this->host().now_ns());
  this->see("done");
  EXPECT_EQ("t/Counting", this->present());
  this->commit_by("test", {{.kind = "remove_resource", .target = "dock"}});
  this->see("done");
  EXPECT_EQ("t/Core", this->present());
}

// ---- what is refused

TYPED_TEST(RuleRunnerTest, RefusesWhatAnExecutorCannotHear) {
  const std::vector<std::pair<When, std::string>> cases{
      {leaf("peer", {{"executor", "other"}}), "in: supervisor"},
      {leaf("diagnostic", {{"status", "x"}}), "in: supervisor"},
      {leaf("silence", {{"topic", "unbound"}, {"longer_than_s", 1.0}}), "topic unbound"},
      {leaf("silence", {{"resource", "nothing"}, {"longer_than_s", 1.0}}), "nothing"},
      {leaf("fault", {{"component", "nobody"}}), "nobody"},
      {leaf("value", {{"resource", "beat"}, {"field", "colour"}, {"above", 1.0}}), "colour"},
      {leaf("action", {{"resource", "beat"}, {"is", "aborted"}}), "has no goals"},
      {leaf("action", {{"resource", "nothing"}, {"is", "aborted"}}), "nothing"}};
  this->deploy();
  for (const auto& [when, word] : cases) {
    this->rules.clear();
    this->actions.clear();
    this->add_rule(when);
    const Error error = this->refusal([&] { this->make(); });
    EXPECT_THAT(error.what(), HasSubstr(word));
  }
}

TYPED_TEST(RuleRunnerTest, RefusesStepsThatThereAreNot) {
  this->add_rule(silent(), {}, {{.kind = "explode", .target = "c"}});
  this->deploy();
  EXPECT_THAT(this->refusal([&] { this->make(); }).what(), HasSubstr("explode"));
}

TYPED_TEST(RuleRunnerTest, OnlyOneListensToAComponent) {
  this->add_rule(leaf("fault", {{"component", "w"}}));
  this->deploy();
  this->begin();
  const std::unique_ptr<RuleRunner> first = std::move(this->runner);
  EXPECT_THAT(this->refusal([&] { this->make(); }).what(), HasSubstr("listen"));
  first->stop();
}

}  // namespace
}  // namespace mauve::rules::test_rule_runner
