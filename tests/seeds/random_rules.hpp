// SPDX-License-Identifier: LGPL-3.0-or-later
// A scenario of the seeds: rules act on components, while values change, parts behave badly and a client makes changes.
#pragma once

#include <algorithm>
#include <iterator>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "mauve_rt/base/seam/ordinary_thread.hpp"
#include "mauve_rt/base/seam/sleep.hpp"

#include "scenario/rule_history.hpp"
#include "scenario/rule_parts.hpp"

namespace mauve::testing {

class RandomRules {
 public:
  RandomRules(std::uint64_t seed, seeds::Findings& findings)
      : dice_(seed),
        findings_(findings),
        interferes_(dice_.once_in(2)),
        contends_(dice_.once_in(2)),
        behaves_badly_(dice_.once_in(2)) {}

  void run() {
    {
      PluginRegistry registry;
      register_rule_parts(registry);
      Architecture architecture(&registry);
      architecture_ = &architecture;
      declare();
      Deployer deployer(architecture);
      deployer_ = &deployer;
      deployer.deploy();
      sleep_for(dice_.between(ms_to_ns(10), ms_to_ns(30)));
      for (int loads = 1 + dice_.below(2); loads > 0; --loads) run_rules(loads == 1);
      deployer.shutdown();
    }
    seeds::expect_threads_end(findings_, s_to_ns(1));
  }

 private:
  static constexpr double kMost = 10.0;

  void expect(bool is_true, const std::string& otherwise) { findings_.expect(is_true, otherwise); }
  int any_component() { return dice_.below(components_); }
  static std::string component(int index) { return "c" + std::to_string(index); }

  void declare() {
    components_ = 2 + dice_.below(3);
    for (int i = 0; i < 3; ++i) architecture_->add_resource<SharedData<Number>>("beat" + std::to_string(i));
    for (int i = 0; i < components_; ++i) {
      Component& added = architecture_->add_component(component(i), "r/Shell", "r/First", "r/Fsm",
                                                      {.priority = 10 + 10 * dice_.below(4)});
      added.allow({kRuleCores.begin() + 1, kRuleCores.end()}, true);
      added.set_property("period_ms", std::int64_t{2 + dice_.below(8)});
    }
    architecture_->configure();
  }

  // ---- the rules

  KnownRule any_rule(int number) {
    KnownRule known;
    known.beat = "beat" + std::to_string(dice_.below(3));
    known.above = 1.0 + dice_.below(8);
    known.is_negated = dice_.once_in(4);
    rules::When value{
        .kind = "value",
        .parameters = {{"resource", known.beat}, {"field", std::string("value")}, {"above", known.above}}};
    const std::string about = component(contends_ ? any_component() : number);
    known.rule = {.name = "rule" + std::to_string(number),
                  .when = known.is_negated ? rules::When{.kind = "not", .parts = {value}} : value,
                  .for_ns = dice_.once_in(2) ? 0 : dice_.between(ms_to_ns(1), ms_to_ns(15)),
                  .undoes = !dice_.once_in(4),
                  .undo_for_ns = dice_.once_in(2) ? 0 : dice_.between(ms_to_ns(1), ms_to_ns(15)),
                  .cooldown_ns = dice_.once_in(2) ? 0 : ms_to_ns(5),
                  .priority = dice_.below(3),
                  .about = {about}};
    if (dice_.once_in(3)) known.rule.otherwise_after_ns = dice_.between(ms_to_ns(5), ms_to_ns(60));
    enter_actions(known, about);
    return known;
  }
  void enter_actions(KnownRule& known, const std::string& about) {
    rules::RuleActions& actions = known.actions;
    RuleDeed deed = static_cast<RuleDeed>(1 + dice_.below(2));
    if (behaves_badly_ && dice_.once_in(2)) deed = static_cast<RuleDeed>(3 + dice_.below(5));
    known.is_good = !testing::is_bad(deed);
    switch (dice_.below(5)) {
      case 0:
        actions.do_steps = {
            {.kind = "set_property", .target = about, .name = "gain", .value = 3.0 + dice_.below(3)}};
        actions.undo_steps = {{.kind = "set_property", .target = about, .name = "gain", .value = 1.0}};
        known.is_good = true;
        break;
      case 1:
        actions.do_steps = {{.kind = "stop", .target = about}};
        actions.undo_steps = {{.kind = "start", .target = about}};
        known.is_good = false;  // it disarms itself
        break;
      default:
        actions.do_steps = {{.kind = "replace_core", .target = about, .name = name_of(deed)}};
        actions.undo_steps = {{.kind = "replace_core", .target = about, .name = "r/First"}};
    }
    if (!known.rule.undoes) actions.undo_steps.clear();
    const TransactionOptions options{
        .timeouts = {.commit_ns = ms_to_ns(dice_.once_in(2) ? 30 : 200), .phase_ns = 0}};
    actions.do_options = actions.undo_options = options;
    actions.reserve = dice_.once_in(2) ? rules::ReserveKind::stop : rules::ReserveKind::safe_outputs;
  }

  /// One set of rules, from its loading to its end.
  void run_rules(bool is_last) {
    ++sets_;
    known_.clear();
    const int count = contends_ ? 2 + dice_.below(4) : components_;
    std::vector<rules::Rule> rules;
    std::vector<rules::RuleActions> actions;
    for (int i = 0; i < count; ++i) {
      known_.push_back(any_rule(i));
      rules.push_back(known_.back().rule);
      actions.push_back(known_.back().actions);
    }
    has_interfered_ = false;
    rest_ns_ = kForever;
    std::unique_ptr<rules::RuleRunner> runner;
    for (int loads = 1 + dice_.below(3); loads > 0; --loads) {  // the same ones go on
      auto next = std::make_unique<rules::RuleRunner>(*deployer_, rules, actions,
                                                      std::map<std::string, std::string>(), runner.get());
      runner = std::move(next);
      run(*runner, is_last && loads == 1);
    }
    RuleParts::hung_may_go_on = is_last;
  }
  void run(rules::RuleRunner& runner, bool is_last) {
    runner_ = &runner;
    RuleHistory history(known_, beats_, rest_ns_, findings_);
    history_ = &history;
    runner.start();
    hung_before_ = RuleParts::hung_hooks;
    RuleParts::may_hang = true;
    is_over_ = false;
    OrdinaryThread taker([this] {
      while (!is_over_) history_->add(runner_->wait_told(ms_to_ns(20)));
    });
    for (int requests = 3 + dice_.below(12); requests > 0; --requests) {
      sleep_for(dice_.between(0, ms_to_ns(dice_.once_in(4) ? 40 : 8)));
      request();
    }
    const bool is_cut = dice_.once_in(3);
    if (!is_cut) expect_settled();
    RuleParts::hung_may_go_on = true;
    if (is_last && dice_.once_in(3)) deployer_->shutdown();
    rest_ns_ = seeds::now_ns();
    runner.stop();
    is_over_ = true;
    runner.wake();
    taker.join();
    history.add(runner.wait_told(0));
    history.check(runner.lost(), rest_ns_);
    expect_still();
    RuleParts::may_hang = false;
  }

  // ---- the client

  void request() {
    if (interferes_ && dice_.once_in(3)) return interfere();
    if (dice_.once_in(8)) return expect_seen();
    const std::string name = "beat" + std::to_string(dice_.below(3));
    beat(name, kMost * dice_.below(11) / 10.0);
    if (dice_.once_in(4)) beat(name, kMost * dice_.below(11) / 10.0);  // at once again
  }
  void beat(const std::string& name, double value) {
    beats_[name].push_back({.value = value, .began_ns = seeds::now_ns()});
    findings_.note(name + " = " + std::to_string(value));
    static_cast<SharedData<Number>&>(architecture_->resource(name)).write.write({value}, monotonic_now_ns());
  }
  void interfere() {
    has_interfered_ = true;
    const std::string name = component(any_component());
    const int what = dice_.below(5);
    findings_.note("interferes with " + name + ": " + std::to_string(what));
    try {
      switch (what) {
        case 0:
          deployer_->stop(name, {.timeout_ns = dice_.between(0, ms_to_ns(30)), .force = dice_.once_in(2)});
          break;
        case 1:
          deployer_->start(name);
          break;
        case 2:
          deployer_->set_property(name, "gain", 1.0 + dice_.below(4),
                                  {.commit_ns = ms_to_ns(50), .phase_ns = 0});
          break;
        case 3:
          deployer_->abandon(name);
          break;
        default:
          deployer_->replace_core(name, name_of(static_cast<RuleDeed>(dice_.below(3))),
                                  {.commit_ns = ms_to_ns(50), .phase_ns = 0});
      }
    } catch (const Error& error) {
      expect(error.code() != ErrorCode::internal, std::string("internal error: ") + error.what());
    }
  }

  // ---- what must hold

  /// What was written a while ago, each rule that watches knows.
  void expect_seen() {
    if (!pause(RuleHistory::kSeen)) return;
    const std::vector<rules::RuleFacts> facts = runner_->facts();
    for (std::size_t i = 0; i < known_.size(); ++i) {
      const KnownRule& known = known_[i];
      const std::vector<Beat>& beats = beats_[known.beat];
      if (!facts[i].status.armed) continue;
      findings_.count("conditions seen");
      const rules::Truth expected =
          beats.empty() ? rules::Truth::unknown : rules::truth_of(known.holds(beats.back().value));
      expect(facts[i].status.truth == expected, known.rule.name + " does not know that " + known.beat +
                                                    " is " +
                                                    std::to_string(beats.empty() ? 0.0 : beats.back().value));
    }
  }
  /// What a rule may do, with what it gives back of the rule of its name in the set before.
  std::vector<Assignment> steps_of(const Overlay& overlay) const {
    const Overlays& overlays = architecture_->overlays();
    std::vector<Assignment> steps = overlays.steps_if(overlay, true, nullptr);
    std::ranges::move(overlays.steps_if(overlay, false, nullptr), std::back_inserter(steps));
    return steps;
  }
  std::vector<Assignment> steps_of(const KnownRule& known) const {
    return steps_of(*architecture_->overlays().find(known.rule.name));
  }
  /// Whether a preparation hangs that holds the components which its rule gives back of a set before.
  bool may_be_held() const { return sets_ > 1 && RuleParts::hung_hooks > hung_before_; }
  /// Whether a rule of a set before, which is gone, gives back a part of the component that behaves badly.
  bool gives_back_bad(const std::string& component) const {
    return std::ranges::any_of(architecture_->overlays().at_work({}), [&](const auto& overlay) {
      return std::ranges::any_of(steps_of(*overlay), [&](const Assignment& step) {
        return step.target == component && is_bad(step);
      });
    });
  }
  static bool is_bad(const Assignment& step) {
    const auto core = std::ranges::find(kRuleCores, step.name);
    return core != kRuleCores.end() && testing::is_bad(static_cast<RuleDeed>(core - kRuleCores.begin()));
  }
  /// Whether no part of the rule behaves badly, nor one that it gives back.
  bool is_good(const KnownRule& known) const {
    return known.is_good &&
           std::ranges::none_of(steps_of(known), [](const Assignment& step) { return is_bad(step); });
  }
  bool is_about(const KnownRule& known, const std::string& component) const {
    return known.rule.about.front() == component ||
           std::ranges::any_of(steps_of(known),
                               [&](const Assignment& step) { return step.target == component; });
  }
  /// Of the first set: where each rule about a component undoes, and none is active, it is as it was declared.
  void expect_back(const std::vector<rules::RuleFacts>& facts) {
    for (int component = 0; component < components_ && sets_ == 1; ++component) {
      const std::string name = "c" + std::to_string(component);
      bool is_expected = !has_interfered_ && RuleParts::hung_states == 0;
      for (std::size_t i = 0; i < known_.size(); ++i) {
        if (known_[i].rule.about.front() != name) continue;
        is_expected = is_expected && is_good(known_[i]) && known_[i].rule.undoes && facts[i].status.armed &&
                      !facts[i].status.active;
      }
      if (!is_expected) continue;
      findings_.count("components back");
      const std::string core = architecture_->component(name).shown().core;
      expect(core == "r/First", name + " runs " + core + ", and no rule wants it");
    }
  }
  /// False: the computer stands still all the time.
  static bool pause(time_ns_t length_ns) {
    for (int tries = 0; tries < 20; ++tries) {
      const time_ns_t stalled_ns = seeds::outcome().stalled_ns;
      sleep_for(length_ns);
      if (seeds::outcome().stalled_ns <= stalled_ns + ms_to_ns(1)) return true;
    }
    return false;
  }

  /// Once nothing else happens, what the rules want is in force.
  void expect_settled() {
    expect_seen();
    if (!pause(ms_to_ns(700))) return;  // the first retry is after 500 ms
    const std::vector<rules::RuleFacts> facts = runner_->facts();
    for (std::size_t i = 0; i < known_.size(); ++i) {
      const KnownRule& known = known_[i];
      const rules::RuleStatus& status = facts[i].status;
      const auto task_state = architecture_->component(known.rule.about.front()).task().state();
      if (!status.armed) continue;
      const bool is_alone = std::ranges::count_if(known_, [&](const KnownRule& other) {
                              return is_about(other, known.rule.about.front());
                            }) == 1;
      const std::string what = known.rule.name + ", problem '" + facts[i].problem + "', component in state " +
                               std::to_string(static_cast<int>(task_state)) + ": ";
      if (!is_alone || !is_good(known) || gives_back_bad(known.rule.about.front()) || may_be_held() ||
          RuleParts::hung_states > 0)
        continue;
      findings_.count("rules settled");
      if (status.holds()) expect(status.in_effect, what + "its condition holds, and it is not in effect");
      if (status.truth == rules::Truth::no)
        expect(!status.in_effect || !known.rule.undoes, what + "it is not undone");
      if (status.in_effect) expect_in_place(known, what);
    }
    expect_wanted(facts);
    expect_back(facts);
  }
  /// Each element is as the highest active rule wants it, also where several want something else.
  void expect_wanted(const std::vector<rules::RuleFacts>& facts) {
    const ArchitectureDescription description = architecture_->describe();
    for (const HeldElement& held : architecture_->overlays().table()) {
      const std::shared_ptr<Component> component = architecture_->find_component(held.element.target);
      bool is_expected =
          !has_interfered_ && RuleParts::hung_states == 0 && !may_be_held() &&
          !gives_back_bad(held.element.target) && held.wanted.step.has_value() &&
          component != nullptr &&  // of one that does not run, a rule that is gone undoes nothing yet
          component->task().state() == ComponentState::running;
      for (std::size_t i = 0; i < known_.size(); ++i)
        is_expected = is_expected && (!is_about(known_[i], held.element.target) ||
                                      (is_good(known_[i]) && facts[i].status.armed));
      if (!is_expected) continue;
      findings_.count("elements wanted");
      const auto now = present(description, held.element);
      expect(now && is_same_effect(*now, *held.wanted.step),
             held.element.target + " " + held.element.name + " is not as " + held.wanted.rule + " wants it");
    }
  }
  void expect_in_place(const KnownRule& known, const std::string& what) {
    const auto overlay = architecture_->overlays().find(known.rule.name);
    const auto is_so = architecture_->overlays().is_so(*overlay, true, architecture_->describe());
    expect(is_so.value_or(true), what + "it is in effect, and what it does is not there");
  }
  /// The runner has ended: nothing changes any more.
  void expect_still() {
    const std::uint64_t revision = architecture_->revision();
    sleep_for(ms_to_ns(30));
    const bool is_hung = RuleParts::hung_states > 0 || RuleParts::hung_hooks > 0;
    expect(is_hung || architecture_->revision() == revision,
           "the architecture changes after the end of the rules");
  }

  Dice dice_;
  seeds::Findings& findings_;
  bool interferes_;     // the client with what rules do
  bool contends_;       // rules with each other
  bool behaves_badly_;  // parts of rules
  Architecture* architecture_{nullptr};
  Deployer* deployer_{nullptr};
  rules::RuleRunner* runner_{nullptr};
  RuleHistory* history_{nullptr};
  int components_{0};
  time_ns_t rest_ns_{kForever};  // when the runner before ended
  int sets_{0};                  // of rules, that were at work so far
  std::vector<KnownRule> known_;
  std::map<std::string, std::vector<Beat>> beats_;
  int hung_before_{0};  // hooks, before the runner that is at work
  bool has_interfered_{false};
  bool is_over_{false};
};

inline void random_rules(std::uint64_t seed, seeds::Findings& findings) { RandomRules(seed, findings).run(); }

}  // namespace mauve::testing
