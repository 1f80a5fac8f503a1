// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/rules/rule_runner.hpp"

#include <algorithm>
#include <utility>

#include "mauve_rt/base/contract.hpp"
#include "mauve_rt/base/error.hpp"
#include "mauve_rt/base/seam/futex.hpp"
#include "mauve_rt/base/seam/mutex.hpp"
#include "mauve_rt/base/trace.hpp"

namespace mauve::rules {

namespace {

constexpr int kPriority = 97;                 // above components, below who conducts changes and who watches
constexpr time_ns_t kPreparing = s_to_ns(1);  // a preparation that lasts longer is told
constexpr time_ns_t kNextTry =
    ms_to_ns(100);  // of a preparation that another one hindered, or a person called off
constexpr std::size_t kStackBytes = std::size_t{256} * 1024;

// What the follower found of a rule.
constexpr std::uint64_t kPresent = 1;  // all that it is about is there and runs
constexpr std::uint64_t kKnown = 2;    // from here on one for each act: whether it is known ...
constexpr std::uint64_t kInPlace = 8;  // ... that nothing is left to be done by it
constexpr unsigned kEndsAt = 5;

constexpr std::array kPrepared{Act::do_, Act::undo};

/// So many decisions may wait for who reports them. Outcomes of actions come on top: each is reported.
constexpr std::size_t kMostTold = 1000;

/// What a rule wants while it is active, and leaves at its end.
OverlaySpec overlay_of(const mauve::rules::Rule& rule, const RuleActions& actions) {
  return {.rule = rule.name,
          .source = {},
          .priority = rule.priority,
          .safety = rule.safety,
          .whole = actions.whole,
          .latch = rule.latch,
          .assigns = assigned(actions.do_steps),
          .leaves = assigned(rule.undoes ? actions.undo_steps : actions.do_steps),
          .leaves_over_persons = !rule.undoes || actions.takes_over};
}

/// Of rules that are at work and not among these: they end at once.
void add_released(const Overlays& overlays, std::vector<mauve::rules::Rule>& rules,
                  std::vector<RuleActions>& actions) {
  for (const auto& overlay : overlays.at_work({})) {
    const OverlaySpec& spec = overlay->spec();
    if (std::any_of(rules.begin(), rules.end(), [&](const auto& rule) { return rule.name == spec.rule; }))
      continue;
    mauve::rules::Rule rule{.name = spec.rule, .undoes = true, .priority = spec.priority};
    rule.safety = spec.safety;
    rule.is_released = true;
    for (const Assigned& one : spec.assigns) rule.about.push_back(one.step.target);
    rules.push_back(std::move(rule));
    actions.push_back({.do_steps = steps_of(spec.assigns),
                       .undo_steps = steps_of(spec.leaves),
                       .takes_over = spec.leaves_over_persons,
                       .whole = spec.whole});
  }
}

bool is_outcome(const Decision& decision) noexcept {
  return decision.decided == Decided::done || decision.decided == Decided::failed;
}

}  // namespace

RuleRunner::RuleRunner(Host& host, std::vector<mauve::rules::Rule> rules, std::vector<RuleActions> actions,
                       std::map<std::string, std::string> topics, RuleRunner* before, Inputs inputs)
    : host_(host),
      clock_(host.clock()),
      feeds_(before != nullptr ? before->feeds_
                               : std::make_shared<Feeds>(
                                     FeedPlace{.architecture = host.architecture(), .clock = host.clock()})),
      inputs_(inputs),
      trace_number_(host.architecture().trace_number("(rules)")) {
  MAUVE_EXPECTS(before == nullptr || (!before->runs_ && &before->host_ == &host));
  if (actions.size() != rules.size())
    throw Error(ErrorCode::invalid_argument, "every rule of the engine has its actions, and only these");
  add_released(overlays(), rules, actions);
  engine_ = std::make_unique<Engine>(std::move(rules), before != nullptr ? before->engine_.get() : nullptr);
  for (const RuleActions& each : actions) {
    const mauve::rules::Rule& rule = engine_->rule(rules_.size());
    overlay_of(rule, each);  // the kinds of its steps are checked here
    rules_.push_back(std::make_unique<Rule>(each, rule));
    rules_.back()->applied = UINT64_MAX;
    rules_.back()->name = TraceNames::intern(rule.name);
  }
  std::vector<std::optional<std::size_t>> same(rules_.size());  // the numbers in `before`
  for (std::size_t i = 0; before != nullptr && i < rules_.size(); ++i) same[i] = before->find(*this, i);
  feeds_->set_topics(std::move(topics));
  if (inputs_ == Inputs::architecture) open_feeds(same);
  if (before != nullptr) go_on_from(*before, same);
}

/// Of the rules that do not go on: all, or none where one cannot be.
void RuleRunner::open_feeds(const std::vector<std::optional<std::size_t>>& same) {
  try {
    for (const auto& heard : engine_->signals()) {
      if (!same[heard.rule]) feeds_->open(heard.spec, *heard.signal);
    }
  } catch (...) {
    for (const auto& heard : engine_->signals()) feeds_->close(*heard.signal);
    throw;
  }
}

void RuleRunner::go_on_from(RuleRunner& before, const std::vector<std::optional<std::size_t>>& same) {
  const bool is_same_deployment = before.epoch_ns_ == host_.epoch_ns();  // else its components stood still
  for (std::size_t i = 0; i < rules_.size(); ++i) {
    if (same[i]) engine_->go_on(i, *before.engine_, *same[i], is_same_deployment);
  }
  for (const auto& heard : before.engine_->signals()) feeds_->close(*heard.signal);
  before.feeds_ = std::make_shared<Feeds>(FeedPlace{.architecture = host_.architecture(), .clock = clock_});
}

/// The number here of a rule of the other one that is the same, with the same steps.
std::optional<std::size_t> RuleRunner::find(const RuleRunner& other, std::size_t rule) const {
  const std::optional<std::size_t> found = engine_->find(other.engine_->rule(rule));
  if (!found) return std::nullopt;
  const RuleActions& own = rules_[*found]->actions;
  const RuleActions& theirs = other.rules_[rule]->actions;
  const bool is_same = own.do_steps == theirs.do_steps && own.undo_steps == theirs.undo_steps;
  return is_same ? found : std::nullopt;
}

RuleRunner::~RuleRunner() { stop(); }

/// What was at work before goes on.
void RuleRunner::load_overlays() {
  std::vector<OverlaySpec> specs;
  for (std::size_t i = 0; i < rules_.size(); ++i)
    specs.push_back(overlay_of(engine_->rule(i), rules_[i]->actions));
  const auto loaded = overlays().load({}, std::move(specs));
  const time_ns_t now_ns = clock_.now_ns();
  for (std::size_t i = 0; i < rules_.size(); ++i) {
    Rule& rule = *rules_[i];
    rule.overlay = loaded[i];
    rule.shares.clear();
    for (std::size_t j = 0; j < rules_.size(); ++j) {
      if (j != i && loaded[i]->shares_with(*loaded[j])) rule.shares.push_back(j);
    }
    if ((loaded[i]->is_active() || loaded[i]->is_engaged()) && !engine_->status(i).is_at_work)
      engine_->adopt(i, loaded[i]->is_active(), now_ns);
    rule.in_effect.store(engine_->status(i).in_effect, std::memory_order_relaxed);
  }
}

void RuleRunner::start() {
  if (runs_) return;
  epoch_ns_ = host_.epoch_ns();
  load_overlays();
  if (host_.is_simulated()) return;
  ending_.store(0, std::memory_order_relaxed);  // the threads' creation publishes it
  host_.architecture().changes().set_listener(&work_);
  look_around();
  for (std::size_t i = 0; i < rules_.size(); ++i) prepare(i);
  const auto following = [](void* self) -> void* {
    static_cast<RuleRunner*>(self)->run_follower();
    return nullptr;
  };
  const auto deciding = [](void* self) -> void* {
    static_cast<RuleRunner*>(self)->run_decisions();
    return nullptr;
  };
  const ThreadSettings decisions{.name = "rules", .priority = kPriority, .stack_bytes = kStackBytes};
  bool has_follower = false;
  try {
    start_workers();
    start_thread(follower_, {.name = "rules follower"}, following);
    has_follower = true;
    start_thread(decision_thread_, decisions, deciding);
  } catch (...) {
    end();
    if (has_follower) follower_.join();
    join_workers();
    throw;
  }
  decision_thread_.prefault_stack();
  runs_ = true;
}

void RuleRunner::start_thread(Thread& thread, const ThreadSettings& settings, void* (*entry)(void*)) {
  if (thread.start(settings, entry, this) != 0)
    throw Error(ErrorCode::internal, "the system refuses a thread of the rules", {.element = settings.name});
}

void RuleRunner::start_workers() {
  for (std::size_t i = 0; i < rules_.size(); ++i) {
    Rule& rule = *rules_[i];
    const std::string& name = engine_->rule(i).name;
    rule.prepares.start({.name = "prepare " + name}, [this, i] {
      prepare(i);
      const auto& acts = rules_[i]->acts;
      const bool may_pass = acts[0].may_pass() || acts[1].may_pass();
      return may_pass ? later_by(monotonic_now_ns(), kNextTry) : kForever;
    });
    rule.commits.start({.name = "commit " + name, .priority = kPriority, .stack_bytes = kStackBytes},
                       [this, i] {
                         commit(i);
                         return kForever;
                       });
    if (!rule.reserve.exists()) continue;
    rule.reserves.start({.name = "reserve " + name, .priority = kPriority, .stack_bytes = kStackBytes},
                        [this, i] {
                          reserve(i);
                          return kForever;
                        });
  }
}

void RuleRunner::end() noexcept {
  ending_.store(1, std::memory_order_release);
  futex_wake_all(ending_);
  host_.architecture().changes().set_listener(nullptr);
  engine_->wake();
  work_.bump();
}

void RuleRunner::join_workers() noexcept {
  for (const auto& rule : rules_) {
    for (Worker* each : {&rule->commits, &rule->reserves, &rule->prepares}) each->end();
  }
  for (const auto& rule : rules_) {
    for (Worker* each : {&rule->commits, &rule->reserves, &rule->prepares}) each->join();
  }
}

void RuleRunner::stop() noexcept {
  if (!std::exchange(runs_, false)) return;
  end();
  decision_thread_.join();
  for (const auto& rule : rules_) {
    for (Action& action : rule->acts) {
      if (action.is_unsettled()) action.call_off();
    }
  }
  join_workers();
  follower_.join();
  // What the threads have left, on this one.
  hear_ends(clock_.now_ns());
  for (std::size_t i = 0; i < rules_.size(); ++i) {
    for (Action& action : rules_[i]->acts) action.settle(host_);
    report(i);
  }
  show_activity();
  tell();
}

std::vector<SignalSpec> RuleRunner::signals() const {
  std::vector<SignalSpec> all;
  for (const auto& heard : engine_->signals()) all.push_back(heard.spec);
  return all;
}

bool RuleRunner::tell(std::size_t signal, time_ns_t time_ns, double value) {
  const auto all = engine_->signals();
  if (inputs_ != Inputs::told || !host_.is_simulated() || signal >= all.size()) {
    throw Error(ErrorCode::invalid_argument, "the rules cannot be told that",
                {.element = "signal " + std::to_string(signal),
                 .expected = "a signal of rules that are told, in virtual time"});
  }
  const std::uint32_t word =
      engine_->word().load(std::memory_order_relaxed);  // relaxed: no other thread is at work
  all[signal].signal->tell(time_ns, value);
  return engine_->word().load(std::memory_order_relaxed) != word;  // relaxed: the same
}

void RuleRunner::adopt(std::size_t rule) {
  MAUVE_EXPECTS(inputs_ == Inputs::told && host_.is_simulated() && rule < rules_.size());
  engine_->adopt(rule, true, clock_.now_ns());
}

time_ns_t RuleRunner::advance() {
  if (std::any_of(rules_.begin(), rules_.end(), [](const auto& rule) { return rule->overlay == nullptr; }))
    load_overlays();
  beat();
  for (;;) {
    look_around();
    for (std::size_t i = 0; i < rules_.size(); ++i) prepare(i);
    const time_ns_t next_ns = step();
    bool changed = false;
    for (std::size_t i = 0; i < rules_.size(); ++i) {
      changed = commit(i) || changed;
      changed = reserve(i) || changed;
      changed = prepare(i) || changed;
    }
    if (!look_around() && !changed) {
      tell();
      return next_ns;
    }
  }
}

// ---- the decision thread

void RuleRunner::run_decisions() noexcept {
  for (;;) {
    const std::uint32_t word = engine_->word().load(std::memory_order_acquire);  // before each look
    if (ending_.load(std::memory_order_acquire) != 0) return;
    const time_ns_t next_ns = step();
    futex_wait_until(engine_->word(), word, next_ns);
  }
}

time_ns_t RuleRunner::step() noexcept {
  const time_ns_t now_ns = clock_.now_ns();
  hear_ends(now_ns);
  if (!host_.is_deployed()) return kForever;  // its components stop: what is heard of that is no cause to act
  reset_asked(now_ns);
  for (std::size_t i = 0; i < rules_.size(); ++i) {
    apply_found(i, now_ns);
    for (const Act act : kPrepared) engine_->set_ready(i, act, is_ready(i, act));
  }
  time_ns_t next_ns = engine_->step(now_ns);
  show_activity();
  while (const std::optional<PendingAction> pending = engine_->pending()) {
    begin(*pending, now_ns);
    next_ns = engine_->step(now_ns);
    show_activity();
  }
  for (std::size_t i = 0; i < rules_.size(); ++i) {
    if (const std::optional<Act> act = engine_->gives_way(i)) rules_[i]->action(*act).call_off();
  }
  show_status();
  work_.bump();
  return next_ns;
}

bool RuleRunner::is_ready(std::size_t index, Act act) const noexcept {
  Rule& rule = *rules_[index];
  return rule.action(act).is_ready(rule.overlay->outdated(act == Act::do_));
}

/// Before anything is begun: who makes a change, or follows one, sees by this what is wanted.
void RuleRunner::show_activity() noexcept {
  for (std::size_t i = 0; i < rules_.size(); ++i) {
    Rule& rule = *rules_[i];
    const RuleStatus status = engine_->status(i);
    const bool is_other = rule.overlay->is_active() != status.active;
    rule.overlay->set_engaged(status.is_at_work || rule.is_unsettled());
    rule.overlay->set_active(status.active);
    if (!is_other) continue;
    rule.ends.fetch_add(1, std::memory_order_release);  // what was found before is of yesterday
    for (const std::size_t other : rule.shares) {
      Overlay& overlay = *rules_[other]->overlay;
      rules_[other]->ends.fetch_add(1, std::memory_order_release);
      if (rule.overlay->ranks_above(overlay)) overlay.outdate(true);
      overlay.outdate(false);
      rules_[other]->prepares.ask();
    }
  }
}

void RuleRunner::reset_asked(time_ns_t now_ns) noexcept {
  for (std::size_t i = 0; i < rules_.size(); ++i) {
    Atomic<std::uint32_t>& word = rules_[i]->reset;
    if (word.load(std::memory_order_acquire) != kResetAsked) continue;
    word.store(engine_->reset(i, now_ns) ? kIsReset : kResetRefused, std::memory_order_release);
    futex_wake_all(word);
  }
}

/// Posts it; its end wakes the engine.
void RuleRunner::begin(const PendingAction& pending, time_ns_t now_ns) noexcept {
  MAUVE_EXPECTS(pending.rule < rules_.size());
  Rule& rule = *rules_[pending.rule];
  if (pending.act == Act::otherwise) {
    engine_->begun(now_ns);
    rule.reserve.begin();
    rule.reserves.ask();
  } else if (Action& action = rule.action(pending.act);
             is_ready(pending.rule, pending.act) && action.begin()) {
    engine_->begun(now_ns);
    (action.is_preparable() ? rule.commits : rule.prepares).ask();
  } else {
    engine_->set_ready(pending.rule, pending.act, false);  // it was a moment ago
  }
}

void RuleRunner::hear_ends(time_ns_t now_ns) noexcept {
  for (std::size_t i = 0; i < rules_.size(); ++i) {
    for (const Act act : kPrepared) {
      if (const std::optional<Ended> how = rules_[i]->action(act).ended()) ended(i, act, *how, now_ns);
    }
    if (const std::optional<Ended> how = rules_[i]->reserve.ended()) ended(i, Act::otherwise, *how, now_ns);
  }
}

void RuleRunner::ended(std::size_t index, Act act, Ended how, time_ns_t now_ns) noexcept {
  engine_->ended(index, act, how, now_ns);
  for (std::size_t i = 0; i < rules_.size(); ++i) {
    if (i == index || engine_->contend(i, index)) rules_[i]->ends.fetch_add(1, std::memory_order_release);
  }
  rules_[index]->has_ended = true;
}

/// What was found while an action about the same is under way, or before it ended, is of yesterday.
void RuleRunner::apply_found(std::size_t index, time_ns_t now_ns) noexcept {
  Rule& rule = *rules_[index];
  const std::uint64_t found = rule.found.load(std::memory_order_acquire);
  const bool is_current = found >> kEndsAt == rule.ends.load(std::memory_order_relaxed) + 1;  // its own
  if (!is_current || found == rule.applied || is_unsettled(index)) return;
  rule.applied = found;
  const bool is_present = (found & kPresent) != 0;
  engine_->set_present(index, is_present, now_ns);
  if (!is_present) return;
  const auto in_place = [&](Act act) {
    const bool is_known = (found & (kKnown << index_of(act))) != 0;
    const bool is_so = (found & (kInPlace << index_of(act))) != 0;
    return is_known ? std::optional(is_so) : std::nullopt;
  };
  for (const Act act : kPrepared) {
    if (const std::optional<bool> is_so = in_place(act)) engine_->set_in_place(index, act, *is_so);
  }
}

/// Whether the architecture is about to change, or its description to follow, by an action of this rule or of one that
/// contends with it.
bool RuleRunner::is_unsettled(std::size_t index) const noexcept {
  for (std::size_t i = 0; i < rules_.size(); ++i) {
    if (i != index && !engine_->contend(i, index)) continue;
    if (rules_[i]->is_unsettled()) return true;
  }
  return false;
}

void RuleRunner::show_status() noexcept {
  ++shown_;
  for (std::size_t i = 0; i < rules_.size(); ++i) {
    Rule& rule = *rules_[i];
    const RuleStatus status = engine_->status(i);
    rule.status.store(status, 0, shown_);
    // relaxed: the thread that reads them is asked after it
    const bool is_other =
        rule.in_effect.exchange(status.in_effect, std::memory_order_relaxed) != status.in_effect;
    const bool may_prepare = engine_->may_prepare(i);
    const bool could_prepare = rule.may_prepare.exchange(may_prepare, std::memory_order_relaxed);
    if (std::exchange(rule.has_ended, false) || is_other || (may_prepare && !could_prepare))
      rule.prepares.ask();
  }
}

// ---- the commit thread and the reserve thread of a rule

/// Whether there was something to commit.
bool RuleRunner::commit(std::size_t index) noexcept {
  bool was_begun = false;
  for (Action& action : rules_[index]->acts) was_begun = action.commit() || was_begun;
  if (was_begun) engine_->wake();
  return was_begun;
}

bool RuleRunner::reserve(std::size_t index) noexcept {
  Rule& rule = *rules_[index];
  if (!rule.reserve.is_begun()) return false;
  deliver(rule, Act::otherwise, {.steps = {}, .report = {}, .failure = rule.reserve.carry_out(host_)});
  rule.reserve.end();
  engine_->wake();
  return true;
}

// ---- the preparation thread of a rule

/// Whether the decision thread or the follower has something to look at.
bool RuleRunner::prepare(std::size_t index) {
  Rule& rule = *rules_[index];
  bool changed = false;
  for (Action& action : rule.acts) changed = action.settle(host_) || changed;
  report(index);
  if (changed) {
    work_.bump();
    engine_->wake();
  }
  rule.preparing_since_ns.store(clock_.now_ns(), std::memory_order_relaxed);
  const bool is_other = make_ready(rule, changed);
  rule.preparing_since_ns.store(0, std::memory_order_relaxed);
  keep(rule);
  if (is_other) engine_->wake();
  return changed || is_other;
}

/// What is in effect can be undone, what is not can be done; would it be possible to undo that? That is tried only where somebody
/// else has changed the components, or the structure.
bool RuleRunner::make_ready(Rule& rule, bool after_own) {
  if (!rule.may_prepare.load(std::memory_order_relaxed)) return false;
  const std::uint64_t revision = host_.architecture().revision();
  const bool in_effect = rule.in_effect.load(std::memory_order_relaxed);
  Action& other = rule.action(in_effect ? Act::do_ : Act::undo);
  const bool was_ready = other.put_away();
  const bool is_anew = make_ready(rule, in_effect ? Act::undo : Act::do_, revision);
  const std::uint32_t structure = host_.architecture().commit_gate().structure();
  const bool is_restructured = std::exchange(rule.structure, structure) != structure;
  if (other.exists() && ((is_anew && !after_own) || is_restructured)) {
    const ArchitectureDescription description = host_.describe();
    other.try_after(overlays().steps_if(*rule.overlay, !in_effect, &description),
                    overlays().steps_if(*rule.overlay, in_effect, nullptr), host_);
  }
  return was_ready || is_anew;
}

bool RuleRunner::make_ready(Rule& rule, Act act, std::uint64_t revision) {
  Action& action = rule.action(act);
  const bool is_active = act == Act::do_;
  const std::uint32_t based_on = rule.overlay->outdated(is_active);  // before the steps are found
  if (!action.exists() || !action.is_wanting(revision, based_on)) return false;
  const ArchitectureDescription description = host_.describe();
  return action.prepare(host_, revision, overlays().steps_if(*rule.overlay, is_active, &description),
                        based_on);
}

/// For facts().
void RuleRunner::keep(Rule& rule) {
  Kept kept;
  for (const Action& action : rule.acts) {
    if (kept.problem.empty()) kept.problem = action.problem();
    kept.memory_bytes += action.memory_bytes();
  }
  for (const Act act : kPrepared) kept.has_no_steps[index_of(act)] = rule.action(act).has_no_steps();
  const LockGuard lock(told_mutex_);
  if (rule.kept == kept) return;
  rule.kept = std::move(kept);
  told_changed_.notify_all();
}

/// Waits for the releases that follow an action.
void RuleRunner::report(std::size_t index) {
  Rule& rule = *rules_[index];
  for (const Act act : kPrepared) {
    if (auto report = rule.action(act).report()) deliver(rule, act, std::move(*report));
  }
}

void RuleRunner::deliver(Rule& rule, Act act, ActionReport report) {
  {
    const LockGuard lock(told_mutex_);
    rule.failure = report.failure;
    rule.reports[index_of(act)].push_back(std::move(report));
  }
  work_.bump();
}

// ---- the follower

void RuleRunner::run_follower() noexcept {
  for (;;) {
    const std::uint32_t seen = work_.word.load(std::memory_order_acquire);  // before each look
    if (ending_.load(std::memory_order_acquire) != 0) return;
    if (look_around()) engine_->wake();
    tell();
    futex_wait_until(work_.word, seen, kForever);
  }
}

/// Whether the decision thread has something to look at.
bool RuleRunner::look_around() {
  const std::string unobservable = follow();
  {
    const LockGuard lock(told_mutex_);
    if (unobservable_ != unobservable) {
      unobservable_ = unobservable;
      told_changed_.notify_all();
    }
  }
  // Before the description: what ends later, or has ended and is not completed, is not in it.
  std::vector<std::optional<std::uint64_t>> ends(rules_.size());
  for (std::size_t i = 0; i < rules_.size(); ++i) {
    const std::uint64_t found_after = rules_[i]->ends.load(std::memory_order_acquire);
    if (!is_unsettled(i)) ends[i] = found_after;
  }
  const std::uint64_t revision = host_.architecture().revision();
  overlays().settle_ended();
  const Overlays::Look look = overlays().look();
  const ArchitectureDescription description = host_.describe();
  host_.architecture().follow(look, description);
  bool changed = false;
  for (std::size_t i = 0; i < rules_.size(); ++i) {
    if (!ends[i]) continue;
    Rule& rule = *rules_[i];
    std::uint64_t found = (*ends[i] + 1) << kEndsAt;  // 0: never looked
    if (hinder(rule, hindrance(rule.actions.do_steps, description))) found |= kPresent;
    for (const Act act : kPrepared) {
      const std::optional<bool> is_so = overlays().is_so(*rule.overlay, act == Act::do_, description);
      if (is_so) found |= kKnown << index_of(act);
      if (is_so == true) found |= kInPlace << index_of(act);
    }
    changed = rule.found.exchange(found, std::memory_order_acq_rel) != found || changed;
  }
  const std::uint64_t outdated = revision + overlays().changes();
  if (std::exchange(followed_, outdated) != outdated) {
    for (const auto& rule : rules_) rule->prepares.ask();
  }
  return changed;
}

/// For facts(); whether nothing hinders it.
bool RuleRunner::hinder(Rule& rule, std::string hindrance) {
  const bool is_free = hindrance.empty();
  const LockGuard lock(told_mutex_);
  if (rule.hindrance != hindrance) {
    rule.hindrance = std::move(hindrance);
    told_changed_.notify_all();
  }
  return is_free;
}

/// Why something cannot be heard.
std::string RuleRunner::follow() {
  try {
    feeds_->follow();
    return {};
  } catch (const std::exception& failure) {
    return failure.what();
  }
}

/// Takes the engine's decisions; how many were left out, because those of their rule wait for a report.
std::uint64_t RuleRunner::collect() {
  std::uint64_t left_out = 0;
  while (const std::optional<Decision> decision = engine_->take()) {
    Rule& rule = *rules_[static_cast<std::size_t>(decision->rule)];
    if (rule.held.size() < kMostTold || is_outcome(*decision)) {
      rule.held.push_back({.decision = *decision, .action = {}, .number = made_++});
    } else {
      ++left_out;
    }
    host_.architecture().record({.sequence = 0,
                                 .time_ns = decision->stamp_ns,
                                 .a = trace_code(*decision),
                                 .b = decision->cause_ns,
                                 .c = static_cast<std::int64_t>(decision->why),
                                 .name = rule.name,
                                 .kind = static_cast<std::uint16_t>(TraceKind::decision),
                                 .component = trace_number_});
  }
  return left_out;
}

void RuleRunner::tell() {
  const std::uint64_t left_out = collect();
  const LockGuard lock(told_mutex_);
  left_out_ += left_out;
  std::vector<Told> all;
  for (const auto& rule : rules_) {
    while (!rule->held.empty()) {
      Told& told = rule->held.front();
      if (is_outcome(told.decision)) {
        auto& reports = rule->reports[index_of(told.decision.act)];
        if (reports.empty()) break;
        told.action = std::move(reports.front());
        reports.pop_front();
      }
      all.push_back(std::move(told));
      rule->held.pop_front();
    }
  }
  if (all.empty()) return;
  std::sort(all.begin(), all.end(),
            [](const Told& one, const Told& other) { return one.number < other.number; });
  for (Told& each : all) {
    if (told_.size() >= kMostTold && !is_outcome(each.decision)) {
      ++left_out_;
    } else {
      told_.push_back(std::move(each));
    }
  }
  told_changed_.notify_all();
}

// ---- anyone

std::string RuleRunner::reset(const std::string& rule) {
  constexpr time_ns_t kPatience = s_to_ns(2);
  std::size_t index = 0;
  while (index < rules_.size() && engine_->rule(index).name != rule) ++index;
  if (index == rules_.size()) return "there is no rule " + rule;
  if (!engine_->rule(index).latch) return "rule " + rule + " is not latched: it ends by itself";
  Atomic<std::uint32_t>& word = rules_[index]->reset;
  word.store(kResetAsked, std::memory_order_release);
  engine_->wake();
  if (host_.is_simulated()) {
    reset_asked(clock_.now_ns());
  } else {
    const time_ns_t until_ns = later_by(monotonic_now_ns(), kPatience);
    while (word.load(std::memory_order_acquire) == kResetAsked) {
      if (!futex_wait_until(word, kResetAsked, until_ns)) break;
    }
  }
  const std::uint32_t answer = word.exchange(kNoReset, std::memory_order_acq_rel);
  if (answer == kIsReset) return {};
  if (answer == kResetAsked) return "the rules are not at work";
  return "rule " + rule +
         " is not active, or its condition is not known to be false: the cause must be gone first";
}

std::vector<Told> RuleRunner::wait_told(time_ns_t timeout_ns) {
  const LockGuard lock(told_mutex_);
  const time_ns_t until_ns = later_by(monotonic_now_ns(), timeout_ns);
  while (!woken_ && told_.empty() && told_changed_.wait_until(told_mutex_, until_ns)) {
  }
  std::vector<Told> taken(std::make_move_iterator(told_.begin()), std::make_move_iterator(told_.end()));
  told_.clear();
  return taken;
}

void RuleRunner::wake() {
  const LockGuard lock(told_mutex_);
  woken_ = true;
  told_changed_.notify_all();
}

std::uint64_t RuleRunner::lost() const {
  const LockGuard lock(told_mutex_);
  return engine_->lost() + left_out_;
}

/// The first of what keeps the rule from acting.
std::string RuleRunner::problem_of(const Rule& rule, const RuleStatus& status) const {
  if (!unobservable_.empty()) return unobservable_;
  if (!rule.hindrance.empty()) return rule.hindrance;
  if (!rule.kept.problem.empty()) return rule.kept.problem;
  if (status.failed) {
    const std::string why = rule.failure.empty() ? std::string(words_of(status.why)) : rule.failure;
    return std::string(name_of(*status.failed)) + " failed: " + why;
  }
  const time_ns_t since_ns = rule.preparing_since_ns.load(std::memory_order_relaxed);
  if (since_ns != 0 && clock_.now_ns() - since_ns > kPreparing) return "its action is still being prepared";
  return {};
}

std::vector<RuleFacts> RuleRunner::facts() const {
  std::vector<RuleFacts> all;
  const LockGuard told(told_mutex_);
  for (std::size_t i = 0; i < rules_.size(); ++i) {
    Rule& rule = *rules_[i];
    const RuleStatus status = rule.shown_status();
    const Act next = status.in_effect ? Act::undo : Act::do_;
    all.push_back({.name = engine_->rule(i).name,
                   .status = status,
                   .ready = rule.kept.has_no_steps[index_of(next)] || (rule.overlay && is_ready(i, next)),
                   .problem = problem_of(rule, status),
                   .memory_bytes = rule.kept.memory_bytes});
  }
  return all;
}

}  // namespace mauve::rules
