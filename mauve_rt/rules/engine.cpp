// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/rules/engine.hpp"

#include <algorithm>
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

constexpr Act opposite(Act act) noexcept { return act == Act::do_ ? Act::undo : Act::do_; }

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
  bool is_due{false};   // `do` is: the condition has held for long enough, and is not known to be false since
  bool goes_on{false};  // its condition was armed by the engine before
  bool armed{false};
  bool in_effect{false};
  bool changed_by_another{false};
  bool is_own{true};                          // what its `do` would do is there by a rule, if it is there
  std::optional<Act> under_way{};             // do or undo
  Look begun{};                               // the condition, as the last action began
  time_ns_t begun_held_ns{0};                 // for so long after its dwell time it owed nothing
  bool is_held{false};                        // outranked, or in cooldown: it owes nothing
  time_ns_t free_since_ns{INT64_MIN};         // it is no longer held
  bool gives_way{false};                      // that is to be called off
  bool acts_soon{false};                      // `do` is due, and what keeps it from it passes
  bool otherwise_begun{false};                // since the condition has held
  std::optional<time_ns_t> waits_since_ns{};  // since when `do` may be done and is not in effect
  std::array<std::optional<bool>, kActs> in_place{};  // by Act; empty: nobody knows
  std::array<bool, kActs> ready{true, true, true};
  time_ns_t not_before_ns{INT64_MIN};
  int failures{0};
  std::pair<Act, Why> failed{};                  // the last one
  std::optional<std::pair<Act, Why>> excused{};  // the last reason given, so that it is given once
  std::optional<time_ns_t> unready_since_ns{};   // what it wants is not ready

  /// When the condition will have been as it is for long enough.
  time_ns_t due_ns() const noexcept {
    return later_by(last.since_ns, last.holds() ? rule.for_ns : (rule.undoes ? rule.undo_for_ns : 0));
  }
  /// Whether there is something that it could do.
  bool may_do() const noexcept { return !in_effect && !changed_by_another && !otherwise_begun; }
  /// Whether what is in effect already is its own to undo.
  bool is_undone_by_it() const noexcept { return is_own || rule.takes_over; }
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
      life->condition = make_condition(rule.when, give);
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
    return std::pair(b->rule.priority, a->index) < std::pair(a->rule.priority, b->index);
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
  life.is_due = old.is_due;
  life.in_effect = old.in_effect;
  life.changed_by_another = old.changed_by_another;
  life.otherwise_begun = old.otherwise_begun;
  life.not_before_ns = old.not_before_ns;
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
  life.is_due = false;
  life.excused.reset();
  life.waits_since_ns.reset();
  life.otherwise_begun = false;
  if (present) {
    life.condition->arm(now_ns);
    if (life.in_effect) life.condition->assume();
  }
  tell(life, {.stamp_ns = now_ns, .decided = present ? Decided::armed : Decided::disarmed});
}

void Engine::arm(time_ns_t now_ns) noexcept {
  for (const auto& life : lives_) set_present(life->index, true, now_ns);
}

void Engine::set_in_place(std::size_t rule, Act act, bool in_place, time_ns_t now_ns) noexcept {
  Life& life = *lives_[rule];
  life.in_place[index_of(act)] = in_place;
  const bool is_undone = act == Act::do_ && !in_place && life.in_effect && !life.under_way;
  if (!is_undone) return;
  life.in_effect = false;
  life.changed_by_another = true;
  suppress(life, Act::do_, Why::changed_by_another, now_ns);
}

void Engine::set_own(std::size_t rule, bool is_own) noexcept { lives_[rule]->is_own = is_own; }

void Engine::set_ready(std::size_t rule, Act act, bool ready) noexcept {
  lives_[rule]->ready[index_of(act)] = ready;
}

void Engine::adopt(std::size_t rule, time_ns_t now_ns) noexcept {
  Life& life = *lives_[rule];
  if (life.in_effect || !life.is_undone_by_it()) return;
  life.in_effect = true;
  life.in_place = {true, false};
  life.condition->assume();
  tell(life, {.stamp_ns = now_ns, .decided = Decided::adopted});
}

void Engine::forget() noexcept {
  for (const auto& life : lives_) forget(life->index);
}

void Engine::forget(std::size_t rule) noexcept {
  if (pending_ && pending_->rule == rule) pending_.reset();
  Life& life = *lives_[rule];
  life.armed = life.in_effect = life.changed_by_another = life.gives_way = life.acts_soon = false;
  life.otherwise_begun = false;
  life.under_way.reset();
  life.in_place = {};
  life.is_own = true;
  life.ready = {true, true, true};
  life.not_before_ns = INT64_MIN;
  life.failures = 0;
  life.excused.reset();
  life.unready_since_ns.reset();
  life.waits_since_ns.reset();
}

// ---- deciding

time_ns_t Engine::step(time_ns_t now_ns) noexcept {
  pending_.reset();
  for (const auto& life : lives_) {
    life->acts_soon = false;
    if (life->armed) look(*life, now_ns);
  }
  for (Life* life : by_rank_) {
    if (!life->armed) continue;
    const auto act = wanted(*life, now_ns);
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
  const bool held = life.last.holds();
  life.last = life.condition->look(now_ns);
  const Truth truth = life.last.truth;
  if (life.last.holds() != held) {
    life.failures = 0;
    life.excused.reset();
    life.unready_since_ns.reset();
    life.otherwise_begun = false;
    life.is_held = false;
    life.free_since_ns = INT64_MIN;
  }
  // That nothing is known yet is no news, but where something is in effect.
  if (truth == life.told || (truth == Truth::unknown && life.told == Truth::no && !life.in_effect)) return;
  life.told = truth;
  tell(life, {.stamp_ns = now_ns, .decided = decided_of(truth)});
}

/// What the dwell times ask for, whether it may be done or not.
std::optional<Act> Engine::wanted(Life& life, time_ns_t now_ns) noexcept {
  const bool is_long_enough = now_ns >= life.due_ns();
  if (life.last.truth == Truth::no) {
    life.is_due = false;
    if (!is_long_enough) return std::nullopt;
    life.changed_by_another = false;
    if (life.in_effect && !life.rule.undoes) life.in_effect = false;
    return life.in_effect ? std::optional(Act::undo) : std::nullopt;
  }
  life.is_due |= life.last.holds() && is_long_enough;
  return life.is_due && life.may_do() ? std::optional(Act::do_) : std::nullopt;
}

time_ns_t Engine::next_look(const Life& life, time_ns_t now_ns) const noexcept {
  time_ns_t next_ns = std::min(life.last.next_ns, life.last.look_ns);
  const auto look_at = [&](time_ns_t instant_ns) {
    if (instant_ns > now_ns) next_ns = std::min(next_ns, instant_ns);
  };
  const bool is_false = life.last.truth == Truth::no;
  const bool may_want = is_false ? life.in_effect || life.changed_by_another
                                 : (life.last.holds() || life.is_due) && life.may_do();
  if (!may_want) return next_ns;
  if (life.waits_since_ns) look_at(later_by(*life.waits_since_ns, *life.rule.otherwise_after_ns));
  if (!life.is_due && life.due_ns() > now_ns) {
    look_at(life.due_ns());
  } else {
    if (life.unready_since_ns) look_at(later_by(*life.unready_since_ns, kMakingReady));
    look_at(life.not_before_ns);
  }
  return next_ns;
}

void Engine::consider(Life& life, Act act, time_ns_t now_ns) noexcept {
  if (life.ready[index_of(act)]) life.unready_since_ns.reset();
  if (life.under_way) {
    if (act == Act::do_) want_otherwise(life, now_ns);
    return;
  }
  if (const Life* other = act == Act::do_ ? outranking(life) : nullptr) {
    life.waits_since_ns.reset();
    life.is_held = true;
    suppress(life, act, Why::outranked, now_ns, other);
    return;
  }
  if (life.in_place[index_of(act)].value_or(false)) {
    suppress(life, act, Why::already, now_ns);
    if (act == Act::do_ && !life.is_undone_by_it()) {
      life.changed_by_another = true;
      life.waits_since_ns.reset();
    } else {
      settle(life, act, now_ns);
    }
    return;
  }
  const bool is_late_enough = now_ns >= life.not_before_ns;
  if (!is_late_enough && life.failures == 0) {
    life.is_held = true;
    suppress(life, act, Why::cooldown, now_ns, nullptr, life.not_before_ns - now_ns);
    return;
  }
  if (std::exchange(life.is_held, false)) life.free_since_ns = now_ns;
  if (act == Act::do_ && want_otherwise(life, now_ns)) return;
  if (!is_late_enough || pending_) {  // in the next step, after what is pending
    life.acts_soon = act == Act::do_ && life.not_before_ns <= later_by(now_ns, kMakingReady);
    return;
  }
  if (const Life* other = in_the_way(life)) {
    suppress(life, act, Why::in_flight, now_ns, other);
    life.acts_soon = act == Act::do_;
    return;
  }
  if (!life.ready[index_of(act)]) {
    if (!life.unready_since_ns) life.unready_since_ns = now_ns;
    const bool is_late = now_ns >= later_by(*life.unready_since_ns, kMakingReady);
    if (is_late) suppress(life, act, Why::not_ready, now_ns);
    life.acts_soon = act == Act::do_ && !is_late;
    return;
  }
  pending_ = {.rule = life.index, .act = act, .cause_ns = life.last.since_ns, .measured = life.last.measured};
}

/// Whether it is time for the reserve action, which waits for nothing.
bool Engine::want_otherwise(Life& life, time_ns_t now_ns) noexcept {
  if (!life.rule.otherwise_after_ns) return false;
  if (!life.waits_since_ns) life.waits_since_ns = now_ns;
  if (now_ns < later_by(*life.waits_since_ns, *life.rule.otherwise_after_ns)) return false;
  if (!pending_) {
    pending_ = {.rule = life.index,
                .act = Act::otherwise,
                .cause_ns = life.last.since_ns,
                .measured = life.last.measured};
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

/// A rule of higher rank that is about one of the same components, and has done or is about to do what it does. One that
/// cannot for longer than a moment leaves the way free: something else than nothing.
const Engine::Life* Engine::outranking(const Life& life) const noexcept {
  for (const Life* other : by_rank_) {
    if (other == &life) return nullptr;
    if (!other->armed || !life.contends[other->index]) continue;
    const bool begins = other->under_way == Act::do_;
    const bool is_next = pending_ && pending_->rule == other->index && pending_->act == Act::do_;
    if (other->in_effect || begins || is_next || other->acts_soon) return other;
  }
  return nullptr;
}

void Engine::begun(time_ns_t now_ns) noexcept {
  if (!pending_) return;
  const PendingAction action = *pending_;
  pending_.reset();
  Life& life = *lives_[action.rule];
  life.begun = life.last;
  life.begun_held_ns = life.free_since_ns > life.due_ns() ? life.free_since_ns - life.due_ns() : 0;
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
    settle(life, act, now_ns);
    life.in_place[index_of(act)] = true;
    life.in_place[index_of(opposite(act))] = false;
    return;
  }
  const bool is_changed = how == Ended::stale || how == Ended::withdrawn;
  const time_ns_t first_ns = is_changed ? kFirstAfterChange : std::max(life.rule.cooldown_ns, kFirstRetry);
  const time_ns_t longest_ns = std::max(kLongestRetry, life.rule.cooldown_ns);
  const time_ns_t wait_ns = first_ns > (longest_ns >> life.failures) ? longest_ns : first_ns << life.failures;
  MAUVE_AUDIT(wait_ns > 0);
  life.failures = std::min(life.failures + 1, kMostDoublings);
  life.failed = {act, why_of(how)};
  life.excused.reset();
  life.not_before_ns = later_by(now_ns, wait_ns);
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
  return std::none_of(lives_.begin(), lives_.end(), [&](const auto& other) {
    return other->contends[rule] && (other->under_way || other->acts_soon);
  });
}

bool Engine::contend(std::size_t one, std::size_t other) const noexcept {
  return lives_[one]->contends[other];
}

/// An action is in effect, whoever did it.
void Engine::settle(Life& life, Act act, time_ns_t now_ns) noexcept {
  life.in_effect = act == Act::do_;
  life.waits_since_ns.reset();
  life.failures = 0;
  life.excused.reset();
  life.not_before_ns = later_by(now_ns, life.rule.cooldown_ns);
  for (const auto& other : lives_) {
    if (!life.contends[other->index]) continue;
    other->in_place = {};
    if (!life.in_effect || !std::exchange(other->in_effect, false)) continue;
    suppress(*other, Act::do_, Why::outranked, now_ns, &life);  // what it did is gone
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
  const Look& look = is_outcome ? life.begun : life.last;
  decision.cause_ns = look.since_ns;
  decision.sample_ns = look.cause_ns();
  decision.measured = look.measured;
  if (is_outcome) decision.held_ns = life.begun_held_ns;
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
                    .in_effect = life.in_effect,
                    .changed_by_another = life.changed_by_another,
                    .since_ns = life.last.since_ns,
                    .measured = life.last.measured};
  if (life.failures > 0) {
    status.failed = life.failed.first;
    status.why = life.failed.second;
  }
  if (!life.armed) return status;
  if ((life.last.holds() || life.is_due) && !life.in_effect && !life.changed_by_another) {
    status.next = Act::do_;
    status.next_ns = std::max(life.is_due ? INT64_MIN : life.due_ns(), life.not_before_ns);
  } else if (life.last.truth == Truth::no && life.in_effect && life.rule.undoes) {
    status.next = Act::undo;
    status.next_ns = std::max(life.due_ns(), life.not_before_ns);
  } else if (!life.last.holds() && !life.in_effect && life.last.next_ns != kForever) {
    status.next = Act::do_;  // if nothing is told until then
    status.next_ns = std::max(later_by(life.last.next_ns, life.rule.for_ns), life.not_before_ns);
  }
  return status;
}

const Rule& Engine::rule(std::size_t rule) const noexcept { return lives_[rule]->rule; }

}  // namespace mauve::rules
