// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/rules/engine.hpp"

#include <algorithm>
#include <tuple>
#include <utility>

#include "mauve_rt/base/contract.hpp"
#include "mauve_rt/base/error.hpp"
#include "mauve_rt/base/seam/futex.hpp"

namespace mauve::rules {

namespace {

constexpr time_ns_t kFirstRetry = ms_to_ns(500);
constexpr time_ns_t kMakingReady = ms_to_ns(100);  // what takes no longer to be made ready is no news
constexpr time_ns_t kLongestRetry = s_to_ns(30);
constexpr time_ns_t kFirstAfterChange =
    ms_to_ns(10);  // somebody else changed the architecture: look again soon
constexpr int kMostDoublings = 12;

Why why_of(Ended how) noexcept {
  switch (how) {
    case Ended::stale:
      return Why::stale;
    case Ended::withdrawn:
      return Why::withdrawn;
    case Ended::timed_out:
      return Why::timed_out;
    case Ended::done:
    case Ended::refused:
      break;
  }
  return Why::refused;
}

Decided decided_of(Truth truth) noexcept {
  if (truth == Truth::unknown) return Decided::condition_unknown;
  return truth == Truth::yes ? Decided::condition_true : Decided::condition_false;
}

/// Of a rule that is released: it only ends.
class Never final : public Condition {
 public:
  void arm(time_ns_t now_ns) noexcept override { armed_ns_ = now_ns; }
  Look look(time_ns_t /*now_ns*/) noexcept override { return {.since_ns = armed_ns_}; }

 private:
  time_ns_t armed_ns_{0};
};

}  // namespace

/// One rule at work.
struct Engine::Life {
  std::size_t index{0};
  std::size_t rank{0};          // 0: the highest
  std::size_t first_signal{0};  // of heard_; it has so many:
  std::size_t signals{0};
  Rule rule;
  std::unique_ptr<Condition> condition;
  std::vector<bool> contends;  // with the rule of that number: both are about one component
  Look last{};
  Truth told{Truth::no};  // what was said of the condition last
  bool goes_on{false};    // its condition was armed by the engine before
  bool armed{false};
  bool active{false};              // what it does is wanted
  bool in_effect{false};           // and done, not undone yet
  bool undone{false};              // that is to be confirmed: meanwhile another rule may have ended, too
  bool is_looked_up{false};        // who hosts the engine finds out whether it is undone
  std::optional<Act> under_way{};  // do or undo
  Look turned{};                   // the condition, as it became active, or no longer
  Look begun{};                    // the same of the last action
  time_ns_t held_ns{0};            // for so long its cooldown held that back
  bool gives_way{false};           // what is under way is to be called off
  bool otherwise_begun{false};     // since it is active
  std::optional<time_ns_t> waits_since_ns{};          // since when `do` may be done and is not in effect
  std::array<std::optional<bool>, kActs> in_place{};  // by Act; empty: nobody knows
  std::array<bool, kActs> ready{true, true, true};
  time_ns_t cooled_ns{INT64_MIN};  // its cooldown is over
  time_ns_t retry_ns{INT64_MIN};   // what failed is tried again
  int failures{0};
  std::pair<Act, Why> failed{};                  // the last one
  std::optional<std::pair<Act, Why>> excused{};  // the last reason given, so that it is given once
  std::optional<time_ns_t> unready_since_ns{};   // what it wants is not ready

  /// When the condition will have been as it is for long enough.
  time_ns_t due_ns() const noexcept {
    if (rule.is_released) return INT64_MIN;
    return later_by(last.since_ns, last.holds() ? rule.for_ns : rule.undo_for_ns);
  }
  /// Whether the condition asks for a change of what is wanted, once it has been so for long enough.
  bool is_to_turn() const noexcept {
    if (active) return rule.is_released || (last.truth == Truth::no && !rule.latch);
    return last.holds() && !rule.is_released;
  }
  /// What is left to be done.
  std::optional<Act> owed() const noexcept {
    if (active && !in_effect && !otherwise_begun) return Act::do_;
    if (!active && in_effect) return Act::undo;
    return std::nullopt;
  }
};

Engine::Engine(std::vector<Rule> rules, const Engine* before)
    : word_(before != nullptr ? before->word_ : std::make_shared<EngineWord>()) {
  for (Rule& rule : rules) {
    auto life = std::make_unique<Life>();
    life->index = lives_.size();
    life->first_signal = heard_.size();
    const GiveSignal give = [this](const SignalSpec& spec) -> Signal& {
      signals_.push_back(std::make_unique<Signal>(word_));
      heard_.push_back({.spec = spec, .signal = signals_.back().get(), .rule = lives_.size()});
      return *signals_.back();
    };
    try {
      life->condition = rule.is_released ? std::make_unique<Never>() : make_condition(rule.when, give);
    } catch (const Error& failure) {
      ErrorDetail detail = failure.detail();
      detail.component = "rule " + rule.name;
      throw Error(failure.code(), failure.statement(), detail);
    }
    life->signals = heard_.size() - life->first_signal;
    life->rule = std::move(rule);
    lives_.push_back(std::move(life));
  }
  for (const auto& life : lives_) {
    by_rank_.push_back(life.get());
    for (const auto& other : lives_) {
      const auto& theirs = other->rule.about;
      life->contends.push_back(other != life && std::any_of(life->rule.about.begin(), life->rule.about.end(),
                                                            [&](const auto& name) {
                                                              return std::find(theirs.begin(), theirs.end(),
                                                                               name) != theirs.end();
                                                            }));
    }
  }
  std::sort(by_rank_.begin(), by_rank_.end(), [](const Life* a, const Life* b) {
    return std::tuple(b->rule.safety, b->rule.priority, a->index) <
           std::tuple(a->rule.safety, a->rule.priority, b->index);
  });
  for (std::size_t rank = 0; rank < by_rank_.size(); ++rank) by_rank_[rank]->rank = rank;
  MAUVE_ENSURES(by_rank_.size() == lives_.size());
}

Engine::~Engine() = default;

void Engine::wake() noexcept { word_->bump(); }

// ---- one engine after another

std::optional<std::size_t> Engine::find(const Rule& rule) const noexcept {
  for (const auto& life : lives_) {
    if (life->rule == rule) return life->index;
  }
  return std::nullopt;
}

void Engine::go_on(std::size_t rule, Engine& before, std::size_t rule_before, bool stays_armed) noexcept {
  Life& life = *lives_[rule];
  Life& old = *before.lives_[rule_before];
  MAUVE_EXPECTS(word_ == before.word_ && life.rule == old.rule);
  std::swap(life.condition, old.condition);
  for (std::size_t i = 0; i < life.signals; ++i) {
    std::swap(signals_[life.first_signal + i], before.signals_[old.first_signal + i]);
    std::swap(heard_[life.first_signal + i].signal, before.heard_[old.first_signal + i].signal);
  }
  life.last = old.last;
  life.told = old.told;
  life.active = old.active;
  life.turned = old.turned;
  life.in_effect = old.in_effect;
  life.undone = old.undone;
  life.otherwise_begun = old.otherwise_begun;
  life.cooled_ns = old.cooled_ns;
  life.goes_on = stays_armed && old.armed;
}

// ---- what is found of the architecture

void Engine::set_present(std::size_t rule, bool present, time_ns_t now_ns) noexcept {
  MAUVE_EXPECTS(rule < lives_.size());
  Life& life = *lives_[rule];
  const bool goes_on = std::exchange(life.goes_on, false) && present;
  if (life.armed == present) return;
  life.armed = present;
  if (goes_on) return tell(life, {.stamp_ns = now_ns, .decided = Decided::armed});
  life.last = {.truth = Truth::unknown, .since_ns = now_ns};
  life.told = Truth::no;
  life.excused.reset();
  life.waits_since_ns.reset();
  life.otherwise_begun = false;
  if (present) {
    life.condition->arm(now_ns);
    if (life.active) life.condition->assume();
  }
  tell(life, {.stamp_ns = now_ns, .decided = present ? Decided::armed : Decided::disarmed});
}

void Engine::arm(time_ns_t now_ns) noexcept {
  for (const auto& life : lives_) set_present(life->index, true, now_ns);
}

void Engine::set_in_place(std::size_t rule, Act act, bool in_place) noexcept {
  Life& life = *lives_[rule];
  life.in_place[index_of(act)] = in_place;
  // What is wanted, or what is there, is another: it is done once more.
  if (act == Act::do_ && !in_place && life.active && !life.under_way) life.in_effect = false;
  if (act != Act::undo) return;
  life.is_looked_up = true;
  if (!life.active && std::exchange(life.undone, false) && !in_place) life.in_effect = true;
}

void Engine::set_ready(std::size_t rule, Act act, bool ready) noexcept {
  lives_[rule]->ready[index_of(act)] = ready;
}

void Engine::adopt(std::size_t rule, bool is_active, time_ns_t now_ns) noexcept {
  Life& life = *lives_[rule];
  if (life.active == is_active && life.in_effect) return;
  life.active = is_active;
  life.in_effect = true;
  life.in_place = {};
  life.condition->assume();
  tell(life, {.stamp_ns = now_ns, .decided = Decided::adopted});
}

bool Engine::reset(std::size_t rule, time_ns_t now_ns) noexcept {
  Life& life = *lives_[rule];
  if (!life.active || life.last.truth != Truth::no) return false;
  turn(life, now_ns);
  return true;
}

void Engine::forget() noexcept {
  for (const auto& life : lives_) forget(life->index);
}

void Engine::forget(std::size_t rule) noexcept {
  if (pending_ && pending_->rule == rule) pending_.reset();
  Life& life = *lives_[rule];
  life.armed = life.active = life.in_effect = life.undone = life.gives_way = life.otherwise_begun = false;
  life.under_way.reset();
  life.in_place = {};
  life.ready = {true, true, true};
  life.cooled_ns = INT64_MIN;
  life.failures = 0;
  life.excused.reset();
  life.unready_since_ns.reset();
  life.waits_since_ns.reset();
}

// ---- deciding

time_ns_t Engine::step(time_ns_t now_ns) noexcept {
  pending_.reset();
  for (Life* life : by_rank_) {
    if (!life->armed) continue;
    look(*life, now_ns);
    if (life->is_to_turn() && now_ns >= life->due_ns()) turn_after_cooldown(*life, now_ns);
  }
  for (Life* life : by_rank_) {
    if (!life->armed) continue;
    const auto act = life->owed();
    if (act != Act::do_) life->waits_since_ns.reset();
    if (act) consider(*life, *act, now_ns);
  }
  time_ns_t next_ns = kForever;
  for (const auto& life : lives_) {
    if (life->armed) next_ns = std::min(next_ns, next_look(*life, now_ns));
  }
  return next_ns;
}

void Engine::look(Life& life, time_ns_t now_ns) noexcept {
  life.last = life.condition->look(now_ns);
  const Truth truth = life.last.truth;
  // That nothing is known yet is no news, but where something is wanted.
  if (truth == life.told || (truth == Truth::unknown && life.told == Truth::no && !life.active)) return;
  life.told = truth;
  tell(life, {.stamp_ns = now_ns, .decided = decided_of(truth)});
}

void Engine::turn_after_cooldown(Life& life, time_ns_t now_ns) noexcept {
  const Act act = life.active ? Act::undo : Act::do_;
  if (!life.rule.is_released && now_ns < life.cooled_ns) {
    if (!life.active || life.in_effect)
      suppress(life, act, Why::cooldown, now_ns, nullptr, life.cooled_ns - now_ns);
    return;
  }
  const bool was_held = !life.rule.is_released && life.cooled_ns > life.due_ns();
  life.held_ns = was_held ? life.cooled_ns - life.due_ns() : 0;
  turn(life, now_ns);
}

/// What was found of rules about the same is of yesterday.
void Engine::forget_found_beside(const Life& life) noexcept {
  for (const auto& other : lives_) {
    if (life.contends[other->index]) other->in_place = {};
  }
}

/// From now on what the rule does is wanted, or no longer is.
void Engine::turn(Life& life, time_ns_t now_ns) noexcept {
  life.active = !life.active;
  forget_found_beside(life);
  // What others did that it was above may be there still.
  if (!life.active && !life.in_effect && !life.under_way) life.undone = life.is_looked_up && life.rule.undoes;
  life.turned = life.last;
  life.failures = 0;
  life.excused.reset();
  life.unready_since_ns.reset();
  life.waits_since_ns.reset();
  life.otherwise_begun = false;
  if (life.active && !life.under_way && !life.in_place[index_of(Act::do_)].value_or(true))
    life.in_effect = false;
  if (life.active || !life.in_effect || life.rule.undoes) return;
  life.in_effect = false;  // what it did stays
  life.cooled_ns = later_by(now_ns, life.rule.cooldown_ns);
}

time_ns_t Engine::next_look(const Life& life, time_ns_t now_ns) const noexcept {
  time_ns_t next_ns = std::min(life.last.next_ns, life.last.look_ns);
  const auto look_at = [&](time_ns_t instant_ns) {
    if (instant_ns > now_ns) next_ns = std::min(next_ns, instant_ns);
  };
  if (life.is_to_turn()) {
    look_at(life.due_ns());
    look_at(life.cooled_ns);
  }
  if (!life.owed()) return next_ns;
  if (life.waits_since_ns) look_at(later_by(*life.waits_since_ns, *life.rule.otherwise_after_ns));
  if (life.unready_since_ns) look_at(later_by(*life.unready_since_ns, kMakingReady));
  if (life.failures > 0) look_at(life.retry_ns);
  return next_ns;
}

void Engine::consider(Life& life, Act act, time_ns_t now_ns) noexcept {
  if (life.ready[index_of(act)]) life.unready_since_ns.reset();
  if (life.under_way) {
    if (act == Act::do_) want_otherwise(life, now_ns);
    return;
  }
  if (life.in_place[index_of(act)].value_or(false)) {
    const Life* higher = outranking(life);
    suppress(life, act, higher != nullptr ? Why::outranked : Why::already, now_ns, higher);
    return settle(life, act, now_ns);
  }
  if (act == Act::do_ && want_otherwise(life, now_ns)) return;
  const bool is_late_enough = life.failures == 0 || now_ns >= life.retry_ns;
  if (!is_late_enough || pending_) return;  // in the next step, after what is pending
  if (const Life* other = in_the_way(life)) return suppress(life, act, Why::in_flight, now_ns, other);
  if (!life.ready[index_of(act)]) {
    if (!life.unready_since_ns) life.unready_since_ns = now_ns;
    if (now_ns >= later_by(*life.unready_since_ns, kMakingReady)) suppress(life, act, Why::not_ready, now_ns);
    return;
  }
  pending_ = {
      .rule = life.index, .act = act, .cause_ns = life.turned.since_ns, .measured = life.turned.measured};
}

/// Whether it is time for the reserve action, which waits for nothing.
bool Engine::want_otherwise(Life& life, time_ns_t now_ns) noexcept {
  if (!life.rule.otherwise_after_ns) return false;
  if (!life.waits_since_ns) life.waits_since_ns = now_ns;
  if (now_ns < later_by(*life.waits_since_ns, *life.rule.otherwise_after_ns)) return false;
  if (!pending_) {
    pending_ = {.rule = life.index,
                .act = Act::otherwise,
                .cause_ns = life.turned.since_ns,
                .measured = life.turned.measured};
  }
  return true;
}

/// Another rule whose action is under way and is about one of the same components; nullptr: none. Those of lower rank are to
/// give way.
const Engine::Life* Engine::in_the_way(const Life& life) noexcept {
  const Life* found = nullptr;
  for (const auto& other : lives_) {
    if (!other->under_way || !life.contends[other->index]) continue;
    found = other.get();
    if (other->rank > life.rank) other->gives_way = true;
  }
  return found;
}

/// The highest active rule of higher rank that is about one of the same components.
const Engine::Life* Engine::outranking(const Life& life) const noexcept {
  for (const Life* other : by_rank_) {
    if (other == &life) return nullptr;
    if (other->active && life.contends[other->index]) return other;
  }
  return nullptr;
}

void Engine::begun(time_ns_t now_ns) noexcept {
  if (!pending_) return;
  const PendingAction action = *pending_;
  pending_.reset();
  Life& life = *lives_[action.rule];
  life.begun = life.turned;
  Decided decided = Decided::otherwise;
  if (action.act == Act::otherwise) {
    life.otherwise_begun = true;
    life.waits_since_ns.reset();
    life.gives_way = life.under_way.has_value();
    in_the_way(life);
  } else {
    MAUVE_EXPECTS(!life.under_way);
    life.under_way = action.act;
    decided = action.act == Act::do_ ? Decided::do_ : Decided::undo;
  }
  tell(life, {.stamp_ns = now_ns, .decided = decided, .act = action.act});
}

void Engine::ended(std::size_t rule, Act act, Ended how, time_ns_t now_ns) noexcept {
  MAUVE_EXPECTS(rule < lives_.size());
  Life& life = *lives_[rule];
  if (act == Act::otherwise) return otherwise_ended(life, how, now_ns);
  if (life.under_way != act) return;  // forgotten meanwhile
  life.under_way.reset();
  life.gives_way = false;
  if (how == Ended::done) {
    tell(life, {.stamp_ns = now_ns, .decided = Decided::done, .act = act});
    life.undone = act == Act::undo && life.is_looked_up;
    life.in_place = {};
    forget_found_beside(life);
    return settle(life, act, now_ns);
  }
  const bool is_changed = how == Ended::stale || how == Ended::withdrawn;
  const time_ns_t first_ns = is_changed ? kFirstAfterChange : std::max(life.rule.cooldown_ns, kFirstRetry);
  const time_ns_t longest_ns = std::max(kLongestRetry, life.rule.cooldown_ns);
  const time_ns_t wait_ns = first_ns > (longest_ns >> life.failures) ? longest_ns : first_ns << life.failures;
  MAUVE_AUDIT(wait_ns > 0);
  life.failures = std::min(life.failures + 1, kMostDoublings);
  life.failed = {act, why_of(how)};
  life.excused.reset();
  life.retry_ns = later_by(now_ns, wait_ns);
  life.cooled_ns = later_by(now_ns, life.rule.cooldown_ns);
  tell(life,
       {.stamp_ns = now_ns, .decided = Decided::failed, .act = act, .why = why_of(how), .wait_ns = wait_ns});
}

/// Its components do not run any more, so that it will be disarmed.
void Engine::otherwise_ended(Life& life, Ended how, time_ns_t now_ns) noexcept {
  if (how == Ended::done)
    return tell(life, {.stamp_ns = now_ns, .decided = Decided::done, .act = Act::otherwise});
  life.otherwise_begun = false;
  tell(life, {.stamp_ns = now_ns,
              .decided = Decided::failed,
              .act = Act::otherwise,
              .why = why_of(how),
              .wait_ns = *life.rule.otherwise_after_ns});
}

std::optional<Act> Engine::gives_way(std::size_t rule) const noexcept {
  const Life& life = *lives_[rule];
  return life.gives_way ? life.under_way : std::nullopt;
}

bool Engine::may_prepare(std::size_t rule) const noexcept {
  return std::none_of(lives_.begin(), lives_.end(),
                      [&](const auto& other) { return other->contends[rule] && other->under_way; });
}

bool Engine::contend(std::size_t one, std::size_t other) const noexcept {
  return lives_[one]->contends[other];
}

/// An action is in effect, whoever did it.
void Engine::settle(Life& life, Act act, time_ns_t now_ns) noexcept {
  life.in_effect = act == Act::do_ && (life.active || life.rule.undoes);
  life.undone = life.undone && !life.in_effect;
  life.waits_since_ns.reset();
  life.failures = 0;
  if (life.excused && life.excused->second != Why::outranked) life.excused.reset();
  life.cooled_ns = later_by(now_ns, life.rule.cooldown_ns);
  if (const Life* higher = life.in_effect ? outranking(life) : nullptr)
    suppress(life, Act::do_, Why::outranked, now_ns, higher);
  for (const auto& other : lives_) {
    if (!life.contends[other->index]) continue;
    if (life.in_effect && other->active && other->in_effect && other->rank > life.rank)
      suppress(*other, Act::do_, Why::outranked, now_ns, &life);
  }
}

// ---- telling

void Engine::suppress(Life& life, Act act, Why why, time_ns_t now_ns, const Life* other,
                      time_ns_t wait_ns) noexcept {
  const std::pair reason(act, why);
  if (life.excused == reason) return;
  life.excused = reason;
  tell(life, {.stamp_ns = now_ns,
              .decided = Decided::suppressed,
              .act = act,
              .why = why,
              .other = other != nullptr ? static_cast<std::int32_t>(other->index) : -1,
              .wait_ns = wait_ns});
}

void Engine::tell(const Life& life, Decision decision) noexcept {
  const std::uint64_t told = told_.load(std::memory_order_relaxed);  // relaxed: nobody else writes it
  if (told - taken_.load(std::memory_order_acquire) >= kRing) {
    lost_.fetch_add(1, std::memory_order_relaxed);
    return;
  }
  decision.rule = static_cast<std::int32_t>(life.index);
  const bool is_outcome = decision.decided == Decided::done || decision.decided == Decided::failed;
  const bool is_begin = decision.decided == Decided::do_ || decision.decided == Decided::undo ||
                        decision.decided == Decided::otherwise;
  const Look& look = is_outcome || is_begin ? life.begun : life.last;
  decision.cause_ns = look.since_ns;
  decision.sample_ns = look.cause_ns();
  decision.measured = look.measured;
  if (is_outcome) decision.held_ns = life.held_ns;
  ring_[told % kRing] = decision;
  told_.store(told + 1, std::memory_order_release);
}

std::optional<Decision> Engine::take() noexcept {
  const std::uint64_t taken = taken_.load(std::memory_order_relaxed);  // relaxed: nobody else writes it
  if (taken == told_.load(std::memory_order_acquire)) return std::nullopt;
  const Decision decision = ring_[taken % kRing];
  taken_.store(taken + 1, std::memory_order_release);
  return decision;
}

RuleStatus Engine::status(std::size_t rule) const noexcept {
  const Life& life = *lives_[rule];
  RuleStatus status{.armed = life.armed,
                    .truth = life.last.truth,
                    .active = life.active,
                    .in_effect = life.in_effect,
                    .is_at_work = life.active || life.in_effect || life.undone || life.under_way.has_value(),
                    .since_ns = life.last.since_ns,
                    .measured = life.last.measured};
  if (life.failures > 0) {
    status.failed = life.failed.first;
    status.why = life.failed.second;
  }
  if (!life.armed) return status;
  if (const auto act = life.owed()) {
    status.next = act;
    status.next_ns = life.failures > 0 ? life.retry_ns : INT64_MIN;
  } else if (life.is_to_turn() && (!life.active || life.rule.undoes)) {
    status.next = life.active ? Act::undo : Act::do_;
    status.next_ns = std::max(life.due_ns(), life.cooled_ns);
  } else if (!life.active && life.last.next_ns != kForever) {
    status.next = Act::do_;  // if nothing is told until then
    status.next_ns = std::max(later_by(life.last.next_ns, life.rule.for_ns), life.cooled_ns);
  }
  return status;
}

bool Engine::is_active(std::size_t rule) const noexcept { return lives_[rule]->active; }

const Rule& Engine::rule(std::size_t rule) const noexcept { return lives_[rule]->rule; }

}  // namespace mauve::rules
