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
constexpr std::size_t kStackBytes = std::size_t{256} * 1024;

// What the follower found of a rule.
constexpr std::uint64_t kPresent = 1;   // all that it is about is there and runs
constexpr std::uint64_t kKnown = 2;     // from here on one for each act: whether it is known ...
constexpr std::uint64_t kInPlace = 8;   // ... that what it asks for is so
constexpr std::uint64_t kByRules = 32;  // what its `do` asks for is so by rules
constexpr unsigned kEndsAt = 6;

constexpr std::array kPrepared{Act::do_, Act::undo};

/// So many decisions may wait for who reports them. Outcomes of actions come on top: each is reported.
constexpr std::size_t kMostTold = 1000;

bool is_outcome(const Decision& decision) noexcept {
  return decision.decided == Decided::done || decision.decided == Decided::failed;
}

}  // namespace

RuleRunner::RuleRunner(Host& host, std::vector<mauve::rules::Rule> rules,
                       const std::vector<RuleActions>& actions, std::map<std::string, std::string> topics,
                       RuleRunner* before)
    : host_(host),
      clock_(host.clock()),
      engine_(
          std::make_unique<Engine>(std::move(rules), before != nullptr ? before->engine_.get() : nullptr)),
      feeds_(before != nullptr ? before->feeds_
                               : std::make_shared<Feeds>(
                                     FeedPlace{.architecture = host.architecture(), .clock = host.clock()})),
      trace_number_(host.architecture().trace_number("(rules)")) {
  MAUVE_EXPECTS(before == nullptr || (!before->runs_ && &before->host_ == &host));
  if (actions.size() != engine_->size())
    throw Error(ErrorCode::invalid_argument, "every rule of the engine has its actions, and only these");
  for (const RuleActions& each : actions) {
    make_transaction(each.do_steps);  // its kinds are checked here
    make_transaction(each.undo_steps);
    const mauve::rules::Rule& rule = engine_->rule(rules_.size());
    rules_.push_back(std::make_unique<Rule>(
        each, rule.name, rule.otherwise_after_ns ? rule.about : std::vector<std::string>()));
    rules_.back()->applied = UINT64_MAX;
    rules_.back()->name = TraceNames::intern(rule.name);
  }
  std::vector<std::optional<std::size_t>> same(rules_.size());  // the numbers in `before`
  for (std::size_t i = 0; before != nullptr && i < rules_.size(); ++i) same[i] = before->find(*this, i);
  feeds_->set_topics(std::move(topics));
  open_feeds(same);
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
  for (const Act act : kPrepared) {
    if (rules_[*found]->action(act).steps() != other.rules_[rule]->action(act).steps()) return std::nullopt;
  }
  return found;
}

RuleRunner::~RuleRunner() { stop(); }

void RuleRunner::start() {
  epoch_ns_ = host_.epoch_ns();
  if (runs_ || host_.is_simulated()) return;
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
    rule.prepares.start({.name = "prepare " + name}, [this, i] { prepare(i); });
    rule.commits.start({.name = "commit " + name, .priority = kPriority, .stack_bytes = kStackBytes},
                       [this, i] { commit(i); });
    if (!rule.reserve.exists()) continue;
    rule.reserves.start({.name = "reserve " + name, .priority = kPriority, .stack_bytes = kStackBytes},
                        [this, i] { reserve(i); });
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
  tell();
}

time_ns_t RuleRunner::advance() {
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
  for (std::size_t i = 0; i < rules_.size(); ++i) {
    apply_found(i, now_ns);
    for (const Act act : kPrepared) engine_->set_ready(i, act, rules_[i]->action(act).is_ready());
  }
  time_ns_t next_ns = engine_->step(now_ns);
  while (const std::optional<PendingAction> pending = engine_->pending()) {
    begin(*pending, now_ns);
    next_ns = engine_->step(now_ns);
  }
  for (std::size_t i = 0; i < rules_.size(); ++i) {
    if (const std::optional<Act> act = engine_->gives_way(i)) rules_[i]->action(*act).call_off();
  }
  show_status();
  work_.bump();
  return next_ns;
}

/// Posts it; its end wakes the engine.
void RuleRunner::begin(const PendingAction& pending, time_ns_t now_ns) noexcept {
  MAUVE_EXPECTS(pending.rule < rules_.size());
  Rule& rule = *rules_[pending.rule];
  if (pending.act == Act::otherwise) {
    engine_->begun(now_ns);
    rule.reserve.begin();
    rule.reserves.ask();
  } else if (Action& action = rule.action(pending.act); action.begin()) {
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
  engine_->set_own(index, (found & kByRules) != 0);
  const bool is_first = !std::exchange(rule.was_present, true);
  if (is_first && engine_->rule(index).undoes && in_place(Act::do_) == true && in_place(Act::undo) == false)
    engine_->adopt(index, now_ns);
  for (const Act act : kPrepared) {
    if (const std::optional<bool> is_so = in_place(act)) engine_->set_in_place(index, act, *is_so, now_ns);
  }
}

/// Whether the architecture is about to change, or its description to follow, by an action of this rule or of one that
/// contends with it.
bool RuleRunner::is_unsettled(std::size_t index) const noexcept {
  for (std::size_t i = 0; i < rules_.size(); ++i) {
    if (i != index && !engine_->contend(i, index)) continue;
    for (const Action& action : rules_[i]->acts) {
      if (action.is_unsettled()) return true;
    }
  }
  return false;
}

void RuleRunner::show_status() noexcept {
  const bool is_locked = status_mutex_.try_lock();
  for (std::size_t i = 0; i < rules_.size(); ++i) {
    Rule& rule = *rules_[i];
    const RuleStatus status = engine_->status(i);
    if (is_locked) rule.status = status;
    // relaxed: the thread that reads them is asked after it
    const bool is_other =
        rule.in_effect.exchange(status.in_effect, std::memory_order_relaxed) != status.in_effect;
    const bool may_prepare = engine_->may_prepare(i);
    const bool could_prepare = rule.may_prepare.exchange(may_prepare, std::memory_order_relaxed);
    if (std::exchange(rule.has_ended, false) || is_other || (may_prepare && !could_prepare))
      rule.prepares.ask();
  }
  if (is_locked) status_mutex_.unlock();
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
  deliver(rule, Act::otherwise, {.failure = rule.reserve.carry_out(host_)});
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

/// What is in effect can be undone, what is not can be done; would it be possible to undo that? To find out is a
/// preparation, and keeps requests for the components waiting: so that is tried only where somebody else has changed them, or the
/// structure.
bool RuleRunner::make_ready(Rule& rule, bool after_own) {
  if (!rule.may_prepare.load(std::memory_order_relaxed)) return false;
  const std::uint64_t revision = host_.architecture().revision();
  const bool in_effect = rule.in_effect.load(std::memory_order_relaxed);
  Action& next = rule.action(in_effect ? Act::undo : Act::do_);
  Action& other = rule.action(in_effect ? Act::do_ : Act::undo);
  const bool was_ready = other.put_away();
  const bool is_anew = next.exists() && next.prepare(host_, revision);
  const std::uint32_t structure = host_.architecture().commit_gate().structure();
  const bool is_restructured = std::exchange(rule.structure, structure) != structure;
  if (other.exists() && ((is_anew && !after_own) || is_restructured)) other.try_after(next.steps(), host_);
  return was_ready || is_anew;
}

/// For facts().
void RuleRunner::keep(Rule& rule) {
  Kept kept;
  for (const Action& action : rule.acts) {
    if (kept.problem.empty()) kept.problem = action.problem();
    kept.memory_bytes += action.memory_bytes();
  }
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
  const ArchitectureDescription description = host_.describe();
  const std::vector<Authored> authors = host_.architecture().authors();
  bool changed = false;
  for (std::size_t i = 0; i < rules_.size(); ++i) {
    if (!ends[i]) continue;
    Rule& rule = *rules_[i];
    std::uint64_t found = (*ends[i] + 1) << kEndsAt;  // 0: never looked
    if (hinder(rule, hindrance(rule.action(Act::do_).steps(), description))) found |= kPresent;
    for (const Act act : kPrepared) {
      const std::optional<bool> is_so = is_in_place(rule.action(act).steps(), description);
      if (is_so) found |= kKnown << index_of(act);
      if (is_so == true) found |= kInPlace << index_of(act);
    }
    if (is_by_rules(rule.action(Act::do_).steps(), authors)) found |= kByRules;
    changed = rule.found.exchange(found, std::memory_order_acq_rel) != found || changed;
  }
  if (std::exchange(followed_, revision) != revision) {
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

/// The first of what keeps the rule from acting; both mutexes are held.
std::string RuleRunner::problem_of(const Rule& rule) const {
  if (!unobservable_.empty()) return unobservable_;
  if (!rule.hindrance.empty()) return rule.hindrance;
  if (!rule.kept.problem.empty()) return rule.kept.problem;
  if (rule.status.failed) {
    const std::string why = rule.failure.empty() ? std::string(words_of(rule.status.why)) : rule.failure;
    return std::string(name_of(*rule.status.failed)) + " failed: " + why;
  }
  const time_ns_t since_ns = rule.preparing_since_ns.load(std::memory_order_relaxed);
  if (since_ns != 0 && clock_.now_ns() - since_ns > kPreparing) return "its action is still being prepared";
  return {};
}

std::vector<RuleFacts> RuleRunner::facts() const {
  std::vector<RuleFacts> all;
  const LockGuard told(told_mutex_);
  const LockGuard status(status_mutex_);
  for (std::size_t i = 0; i < rules_.size(); ++i) {
    Rule& rule = *rules_[i];
    all.push_back({.name = engine_->rule(i).name,
                   .status = rule.status,
                   .ready = rule.action(rule.status.in_effect ? Act::undo : Act::do_).is_ready(),
                   .problem = problem_of(rule),
                   .memory_bytes = rule.kept.memory_bytes});
  }
  return all;
}

}  // namespace mauve::rules
