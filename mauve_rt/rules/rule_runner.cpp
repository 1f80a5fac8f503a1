// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/rules/rule_runner.hpp"

#include <chrono>
#include <mutex>
#include <utility>

#include "mauve_rt/base/error.hpp"
#include "mauve_rt/base/futex.hpp"
#include "mauve_rt/base/trace.hpp"

namespace mauve::rules {

namespace {

constexpr int kPriority = 97;  // above components, below who conducts changes and who watches
constexpr std::size_t kStackBytes = std::size_t{256} * 1024;
// A machine or a process that stood still finds its timers due and its messages waiting alike: those come first.
constexpr time_ns_t kStoodStill = ms_to_ns(50);
constexpr time_ns_t kCatchUp = ms_to_ns(20);

// What the preparation thread found of a rule.
constexpr std::uint64_t kPresent = 1;  // all that it is about is there and runs
constexpr std::uint64_t kKnown = 2;    // from here on one for each act: whether it is known ...
constexpr std::uint64_t kInPlace = 8;  // ... that what it asks for is so
constexpr unsigned kEndsAt = 5;

constexpr std::array kActs{Act::do_, Act::undo};

/// So many decisions may wait for who reports them. Outcomes of actions come on top: each is reported.
constexpr std::size_t kMostTold = 1000;

bool is_outcome(const Decision& decision) noexcept {
  return decision.decided == Decided::done || decision.decided == Decided::failed;
}

}  // namespace

RuleRunner::RuleRunner(Host& host, std::unique_ptr<Engine> engine, const std::vector<RuleActions>& actions,
                       std::map<std::string, std::string> topics)
    : host_(host),
      engine_(std::move(engine)),
      feeds_({.architecture = host.architecture(), .clock = host.clock(), .topics = std::move(topics)}),
      kept_(actions.size()),
      trace_number_(host.architecture().trace_number("(rules)")) {
  if (actions.size() != engine_->size())
    throw Error(ErrorCode::invalid_argument, "every rule of the engine has its actions, and only these");
  for (const RuleActions& each : actions) {
    make_transaction(each.do_steps);  // its kinds are checked here
    make_transaction(each.undo_steps);
    rules_.push_back(std::make_unique<Rule>(each));
    rules_.back()->applied = UINT64_MAX;
    rules_.back()->name = TraceNames::intern(engine_->rule(rules_.size() - 1).name);
  }
  for (const auto& heard : engine_->signals()) feeds_.open(heard.spec, *heard.signal);
}

RuleRunner::~RuleRunner() { stop(); }

void RuleRunner::start() {
  if (runs_ || host_.is_simulated()) return;
  ending_.store(0, std::memory_order_relaxed);  // the threads' creation publishes it
  host_.architecture().changes().set_listener(&work_);
  tend();
  const auto tending = [](void* self) -> void* {
    static_cast<RuleRunner*>(self)->run_preparation();
    return nullptr;
  };
  const auto stepping = [](void* self) -> void* {
    static_cast<RuleRunner*>(self)->run_decisions();
    return nullptr;
  };
  if (preparation_thread_.start({.name = "rules prepare"}, tending, this) != 0) {
    end();
    throw Error(ErrorCode::internal, "the system refuses the thread that prepares what rules do");
  }
  if (decision_thread_.start({.name = "runner", .priority = kPriority, .stack_bytes = kStackBytes}, stepping,
                             this) != 0) {
    end();
    preparation_thread_.join();
    throw Error(ErrorCode::internal, "the system refuses the thread that rules act on");
  }
  decision_thread_.prefault_stack();
  runs_ = true;
}

void RuleRunner::end() noexcept {
  ending_.store(1, std::memory_order_release);
  futex_wake_all(ending_);
  host_.architecture().changes().set_listener(nullptr);
  engine_->wake();
  work_.bump();
}

void RuleRunner::stop() noexcept {
  if (!std::exchange(runs_, false)) return;
  end();
  decision_thread_.join();
  preparation_thread_.join();
  tell();
}

time_ns_t RuleRunner::advance() {
  beat();
  for (;;) {
    tend();
    const time_ns_t next_ns = step();
    if (!tend()) {
      tell();
      return next_ns;
    }
  }
}

// ---- the decision thread

void RuleRunner::run_decisions() noexcept {
  while (ending_.load(std::memory_order_acquire) == 0) {
    const std::uint32_t word = engine_->word().load(std::memory_order_acquire);  // before the look
    const time_ns_t next_ns = step();
    if (futex_wait_until(engine_->word(), word, next_ns)) continue;
    if (host_.clock().now_ns() > later_by(next_ns, kStoodStill))
      futex_wait_until(ending_, 0, host_.clock().now_ns() + kCatchUp);
  }
}

time_ns_t RuleRunner::step() noexcept {
  const time_ns_t now_ns = host_.clock().now_ns();
  hear_ends(now_ns);
  if (!host_.is_deployed()) return kForever;  // its components stop: what is heard of that is no cause to act
  for (std::size_t i = 0; i < rules_.size(); ++i) {
    apply_found(i, now_ns);
    for (const Act act : kActs) engine_->set_ready(i, act, rules_[i]->action(act).is_ready());
  }
  const time_ns_t next_ns = engine_->step(now_ns);
  if (const std::optional<PendingAction> pending = engine_->pending()) {
    Action& action = rules_[pending->rule]->action(pending->act);
    engine_->begun(now_ns);
    if (MAUVE_RT_TRUSTED(action.begin())) {  // as far as the components' own adopt and take are
      under_way_ = &action;
      hear_ends(host_.clock().now_ns());
    } else {
      engine_->ended(Ended::stale, now_ns);  // it was ready a moment ago
    }
    if (under_way_ == nullptr) engine_->wake();  // what to do next is looked at anew
  }
  show_status();
  work_.bump();
  return next_ns;
}

void RuleRunner::hear_ends(time_ns_t now_ns) noexcept {
  if (under_way_ == nullptr) return;
  const std::optional<Ended> how = under_way_->ended();
  if (!how) return;
  under_way_ = nullptr;
  engine_->ended(*how, now_ns);
  ends_.fetch_add(1, std::memory_order_release);
}

/// What was found before the last action ended, or while one is under way, is of yesterday.
void RuleRunner::apply_found(std::size_t index, time_ns_t now_ns) noexcept {
  Rule& rule = *rules_[index];
  const std::uint64_t found = rule.found.load(std::memory_order_acquire);
  const bool is_current = found >> kEndsAt == ends_.load(std::memory_order_relaxed) + 1;  // its own
  if (under_way_ != nullptr || !is_current || found == rule.applied) return;
  rule.applied = found;
  const bool is_present = (found & kPresent) != 0;
  engine_->set_present(index, is_present, now_ns);
  if (!is_present) return;
  const auto in_place = [&](Act act) {
    const bool is_known = (found & (kKnown << index_of(act))) != 0;
    const bool is_so = (found & (kInPlace << index_of(act))) != 0;
    return is_known ? std::optional(is_so) : std::nullopt;
  };
  const bool is_first = !std::exchange(rule.was_present, true);
  if (is_first && engine_->rule(index).undoes && in_place(Act::do_) == true && in_place(Act::undo) == false)
    engine_->adopt(index, now_ns);
  for (const Act act : kActs) {
    if (const std::optional<bool> is_so = in_place(act)) engine_->set_in_place(index, act, *is_so, now_ns);
  }
}

void RuleRunner::show_status() noexcept {
  const std::unique_lock lock(status_mutex_, std::try_to_lock);
  for (std::size_t i = 0; i < rules_.size(); ++i) {
    const RuleStatus status = engine_->status(i);
    rules_[i]->in_effect.store(status.in_effect, std::memory_order_relaxed);
    if (lock) rules_[i]->status = status;
  }
}

// ---- the preparation thread

void RuleRunner::run_preparation() noexcept {
  while (ending_.load(std::memory_order_acquire) == 0) {
    const std::uint32_t seen = work_.word.load(std::memory_order_acquire);
    if (tend()) engine_->wake();
    tell();
    futex_wait_until(work_.word, seen, kForever);
  }
}

/// Whether the decision thread has something to look at.
bool RuleRunner::tend() {
  // Before all: what has ended by now is completed below, and then found in force.
  const std::uint64_t ends = ends_.load(std::memory_order_acquire);
  bool changed = false;
  for (const auto& rule : rules_) {
    for (Action& action : rule->acts) changed = action.settle(host_) || changed;
  }
  return changed || look_around(ends);  // what was carried out the decision thread has to know first
}

bool RuleRunner::look_around(std::uint64_t ends) {
  const std::uint64_t revision = host_.architecture().revision();
  const std::string unobservable = follow();
  const ArchitectureDescription description = host_.describe();
  bool changed = false;
  for (std::size_t i = 0; i < rules_.size(); ++i) {
    Rule& rule = *rules_[i];
    std::uint64_t found = (ends + 1) << kEndsAt;  // 0: never looked
    if (can_begin(rule.action(Act::do_).steps(), description)) found |= kPresent;
    for (const Act act : kActs) {
      const std::optional<bool> is_so = is_in_place(rule.action(act).steps(), description);
      if (is_so) found |= kKnown << index_of(act);
      if (is_so == true) found |= kInPlace << index_of(act);
    }
    changed = make_ready(rule, revision) || changed;
    changed = rule.found.exchange(found, std::memory_order_acq_rel) != found || changed;
    keep(i, rule, unobservable);
  }
  return changed;
}

/// For facts().
void RuleRunner::keep(std::size_t index, const Rule& rule, const std::string& unobservable) {
  Kept kept{.problem = unobservable};
  for (const Action& action : rule.acts) {
    if (kept.problem.empty()) kept.problem = action.problem();
    kept.memory_bytes += action.memory_bytes();
  }
  const std::lock_guard lock(told_mutex_);
  if (kept_[index] == kept) return;
  kept_[index] = std::move(kept);
  told_changed_.notify_all();
}

/// What is in effect can be undone, what is not can be done; would it be possible to undo that?
bool RuleRunner::make_ready(Rule& rule, std::uint64_t revision) {
  const bool in_effect = rule.in_effect.load(std::memory_order_relaxed);
  Action& next = rule.action(in_effect ? Act::undo : Act::do_);
  Action& other = rule.action(in_effect ? Act::do_ : Act::undo);
  bool changed = other.put_away();
  if (next.exists()) changed = next.tend(host_, revision) || changed;
  if (other.exists()) other.try_after(next.steps(), host_, revision);
  return changed;
}

/// Why something cannot be heard.
std::string RuleRunner::follow() {
  try {
    feeds_.follow();
    return {};
  } catch (const std::exception& failure) {
    return failure.what();
  }
}

void RuleRunner::tell() {
  std::vector<Told> all;
  while (const std::optional<Decision> decision = engine_->take()) {
    all.push_back({.decision = *decision});
    Rule& rule = *rules_[static_cast<std::size_t>(decision->rule)];
    host_.architecture().record({.sequence = 0,
                                 .time_ns = decision->stamp_ns,
                                 .a = trace_code(*decision),
                                 .b = decision->cause_ns,
                                 .c = static_cast<std::int64_t>(decision->why),
                                 .name = rule.name,
                                 .kind = static_cast<std::uint16_t>(TraceKind::decision),
                                 .component = trace_number_});
    if (!is_outcome(*decision)) continue;
    if (auto report = rule.action(decision->act).report()) all.back().action = std::move(*report);
  }
  if (all.empty()) return;
  const std::lock_guard lock(told_mutex_);
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
  std::unique_lock lock(told_mutex_);
  told_changed_.wait_for(lock, std::chrono::nanoseconds(timeout_ns),
                         [&] { return woken_ || !told_.empty(); });
  std::vector<Told> taken(std::make_move_iterator(told_.begin()), std::make_move_iterator(told_.end()));
  told_.clear();
  return taken;
}

void RuleRunner::wake() {
  const std::lock_guard lock(told_mutex_);
  woken_ = true;
  told_changed_.notify_all();
}

std::uint64_t RuleRunner::lost() const {
  const std::lock_guard lock(told_mutex_);
  return engine_->lost() + left_out_;
}

std::vector<RuleFacts> RuleRunner::facts() const {
  std::vector<RuleFacts> all;
  const std::scoped_lock lock(told_mutex_, status_mutex_);
  for (std::size_t i = 0; i < rules_.size(); ++i) {
    Rule& rule = *rules_[i];
    all.push_back({.name = engine_->rule(i).name,
                   .status = rule.status,
                   .ready = rule.action(rule.status.in_effect ? Act::undo : Act::do_).is_ready(),
                   .problem = kept_[i].problem,
                   .memory_bytes = kept_[i].memory_bytes});
  }
  return all;
}

}  // namespace mauve::rules
