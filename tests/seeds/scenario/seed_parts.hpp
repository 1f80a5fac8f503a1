// SPDX-License-Identifier: LGPL-3.0-or-later
// The parts of a scenario's components: they note what is done with them, and behave badly where the seed wants it.
#pragma once

#include <array>
#include <cstring>
#include <map>
#include <memory>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "mauve_rt/base/seam/sleep.hpp"
#include "mauve_rt/mauve_rt.hpp"

#include "../forked_run.hpp"
#include "dice.hpp"
#include "fixtures.hpp"

namespace mauve::testing {

inline constexpr int kNone = -1;
/// What the input of a component reads where it is not connected, or nothing was written yet.
inline constexpr double kUnconnected = 7.0;
/// What a component writes.
constexpr double written_by(int component) { return 10.0 + component; }

/// One execution of a core in its component, or in a shadow.
struct Execution {
  int component;
  time_ns_t clock_ns;
  time_ns_t at_ns;
  int core;
  double gain;
  double input;        // what the component reads
  std::int64_t count;  // executions that the core's state knows of
  bool is_in_shadow;
  int interventions;     // requests before it
  time_ns_t excuses_ns;  // stalls and slowness before it
};

/// A core that does not return from a hook or a state.
struct Hang {
  int component;
  time_ns_t clock_ns;  // of the release
  time_ns_t from_ns;
  bool is_in_state;
  bool is_in_cleanup;
  time_ns_t until_ns{kForever};
};

/// An adopt or a take on the thread of a component.
struct Visit {
  int component;
  time_ns_t from_ns, to_ns;
};

/// What all parts of a run share. One thread runs at a time: nothing needs a lock.
struct Shared {
  explicit Shared(seeds::Findings& all) : findings(all) {}
  seeds::Findings& findings;
  std::vector<Execution> executions{};
  std::map<int, std::vector<time_ns_t>> writes{};  // by component: when a write to its output had ended
  bool may_hang{true};
  bool hung_may_go_on{false};  // all, from now on
  int let_go{0};               // how often those that hung were let go on
  time_ns_t slow_ns{0};        // what slow hooks and held locks took
  bool is_shut_down{false};    // or about to be
  bool has_shut_down{false};
  int interventions{0};     // requests that start, stop or change components
  std::set<int> stopped{};  // components that a stop has ended, and that no request has started since
  std::map<int, std::string> cores{};  // alive
  std::map<int, int> took_from{};      // whose state each core took over
  std::set<int>
      copied{};  // candidates that begin, and are promoted, with copies of the state of the live core
  std::map<int, std::int64_t> took_count{};  // what was taken over from one of them
  std::map<int, Hang> hung_cores{};          // also those that have returned
  std::multiset<int> hanging_components{};   // once for each core of theirs that hangs
  std::set<int> hung_components{};           // also those whose cores have returned
  std::set<int> bad_guards{};                // components whose guard misbehaved
  int hanging{0};                            // cores
  time_ns_t returned_ns{0};                  // when the last core returned
  time_ns_t returned_excuses_ns{0};          // stalls and slowness before that
  std::vector<Visit> visits{};
  std::multiset<int> configured{};  // components whose hooks a client calls
};

struct BoundedStates {
  static constexpr time_ns_t kLongest = ms_to_ns(2);
};

/// Where a core behaves badly.
enum class Hook : std::uint8_t { state, guard, configure, cleanup, adopt, take };
inline constexpr std::array kHookNames{"state", "guard", "configure", "cleanup", "adopt", "take"};
/// And how.
enum class Deed : std::uint8_t { nothing, slow, throws, hangs, refuses };
inline constexpr std::array kDeedNames{"good", "slow", "throwing", "hanging", "refusing"};

struct Manner {
  Hook hook{Hook::state};
  Deed deed{Deed::nothing};
  bool is_good() const noexcept { return deed == Deed::nothing; }
  std::string name() const {
    const std::string what = kDeedNames[static_cast<std::size_t>(deed)];
    return is_good() ? what : what + " " + kHookNames[static_cast<std::size_t>(hook)];
  }
  static Manner any(Dice& dice) {
    if (dice.once_in(2)) return {};
    return {.hook = dice.once_in(4) ? Hook::state : static_cast<Hook>(dice.below(kHookNames.size())),
            .deed = static_cast<Deed>(1 + dice.below(kDeedNames.size() - 1))};
  }
};

/// Notes each of its executions, and behaves badly after some.
class SeedCore : public Core<TestShell> {
 public:
  SeedCore(std::shared_ptr<Shared> shared, int component, int number, Manner manner, std::uint64_t seed)
      : shared_(std::move(shared)), component_(component), number_(number), manner_(manner), dice_(seed) {
    shared_->cores[number] =
        description() + " of component " + std::to_string(component) + ", " + manner.name();
    set_implementation("seeds/Core" + std::to_string(number));
  }
  ~SeedCore() override {
    shared_->cores.erase(number_);
    expect(!is_ready_, "is destroyed before it is cleaned up");
  }

  // ---- the methods of the fsm

  void act() {
    const bool is_in_shadow = std::strcmp(seeds::running(), "shadow") == 0;
    expect(is_ready_, "executes and is not configured");
    expect(!has_refused_, "executes although its adopt has refused");
    expect(!is_out_ || was_on_call_, "executes after another core took over from it");
    expect(is_in_shadow || !shared_->has_shut_down, "executes after the shutdown");
    expect(is_in_shadow || !shared_->stopped.contains(component_), "executes after a stop");
    is_out_ = false;
    note_copy();
    shared_->executions.push_back({.component = component_,
                                   .clock_ns = clock_ns(),
                                   .at_ns = seeds::now_ns(),
                                   .core = number_,
                                   .gain = shell().gain.value(),
                                   .input = shell().input.read().value.value,
                                   .count = ++count_,
                                   .is_in_shadow = is_in_shadow,
                                   .interventions = shared_->interventions,
                                   .excuses_ns = seeds::outcome().stalled_ns + shared_->slow_ns});
    ++copied_;
    expect(copied_ == count_, "has other state fields than take() moved over: " + std::to_string(copied_) +
                                  " and " + std::to_string(count_));
    shell().output.write(Number{written_by(component_)});
    if (!is_in_shadow) shared_->writes[component_].push_back(seeds::now_ns());
    if (count_ > 3 && dice_.once_in(4)) behave(Hook::state);
    compute(us_to_ns(60));
  }
  bool is_odd() {
    if (dice_.once_in(8)) behave(Hook::guard);
    return dice_.once_in(2);
  }

  // ---- the hooks

  bool configure_hook() override {
    expect(!is_ready_, "is configured twice");
    const bool agrees = behave(Hook::configure);
    is_ready_ = agrees;
    is_out_ = false;  // an old core may be the next fallback
    return agrees;
  }
  void cleanup_hook() override {
    expect(is_ready_, "is cleaned up and is not configured");
    is_ready_ = false;
    behave(Hook::cleanup);
  }
  bool adopt(const CoreBase& old) override {
    adopted_ = static_cast<const SeedCore&>(old).number_;
    expect(is_ready_, "adopts and is not configured");
    const VisitNote note(*this);
    compute(us_to_ns(20));
    has_refused_ = !behave(Hook::adopt);
    return !has_refused_;
  }
  void take(CoreBase& old) noexcept override {
    const VisitNote note(*this);
    auto& before = static_cast<SeedCore&>(old);
    expect(before.component_ == component_, "takes the state of a core of another component");
    expect(!shared_->took_from.contains(number_), "takes over twice");
    expect(before.number_ == adopted_, "takes over from core " + std::to_string(before.number_) +
                                           ", and has adopted core " + std::to_string(adopted_));
    before.note_copy();
    count_ = before.count_;
    shared_->took_from[number_] = before.number_;
    if (shared_->copied.contains(before.number_)) shared_->took_count[number_] = count_;
    before.is_out_ = true;
    before.was_on_call_ = is_on_probation_;
    behave(Hook::take);
    compute(us_to_ns(20));
  }
  void set_on_probation() noexcept { is_on_probation_ = true; }
  std::string description() const override { return "core " + std::to_string(number_); }

 private:
  class VisitNote {
   public:
    explicit VisitNote(SeedCore& core) : core_(core), from_ns_(seeds::now_ns()) {}
    ~VisitNote() {
      if (std::strcmp(seeds::running(), "shadow") != 0)
        core_.shared_->visits.push_back(
            {.component = core_.component_, .from_ns = from_ns_, .to_ns = seeds::now_ns()});
    }
    VisitNote(const VisitNote&) = delete;
    VisitNote& operator=(const VisitNote&) = delete;

   private:
    SeedCore& core_;
    time_ns_t from_ns_;
  };

  void expect(bool is_true, const char* what) const {
    if (!is_true)
      shared_->findings.expect(false,
                               description() + " of component " + std::to_string(component_) + " " + what);
  }
  void expect(bool is_true, const std::string& what) const { expect(is_true, what.c_str()); }

  void compute(time_ns_t most_ns) noexcept { seeds::compute(dice_.between(0, most_ns)); }
  /// The kernel copies the state of a candidate without a call of its hooks.
  void note_copy() noexcept {
    if (shared_->copied.contains(number_)) count_ = copied_;
  }

  /// Others that preempt it make it slower.
  template <typename Pass>
  void pass_slowly(time_ns_t length_ns, const Pass& pass) noexcept {
    shared_->slow_ns += length_ns;
    const time_ns_t until_ns = seeds::now_ns() + length_ns;
    const time_ns_t stalled_ns = seeds::outcome().stalled_ns;
    pass(length_ns);
    const time_ns_t later_ns = seeds::now_ns() - until_ns - (seeds::outcome().stalled_ns - stalled_ns);
    shared_->slow_ns += std::max<time_ns_t>(0, later_ns);
  }
  /// False: it refuses. Does nothing in other hooks than its own.
  bool behave(Hook hook) {
    if (hook != manner_.hook || manner_.is_good()) return true;
    if (hook == Hook::guard) shared_->bad_guards.insert(component_);
    const bool is_noexcept = hook == Hook::take;
    const bool is_of_caller = (shared_->is_shut_down || shared_->configured.contains(component_)) &&
                              hook != Hook::state && hook != Hook::guard;
    switch (manner_.deed) {
      case Deed::nothing:
        return true;
      case Deed::throws:
        if (is_noexcept) return true;
        shared_->findings.count(manner_.name());
        throw std::runtime_error("as the seed wants");
      case Deed::hangs:
        if (!is_of_caller) hang();  // else the hook is called by the thread that made the request
        return true;
      case Deed::refuses:
        return false;
      case Deed::slow:
        shared_->findings.count(manner_.name());
        if (hook == Hook::state || hook == Hook::guard) {
          if (dice_.once_in(2)) {
            compute(us_to_ns(900));
          } else {  // about as long as the bound of some states
            const time_ns_t length_ns =
                dice_.between(BoundedStates::kLongest - us_to_ns(60), BoundedStates::kLongest + us_to_ns(60));
            pass_slowly(length_ns, seeds::compute);
          }
        } else {
          pass_slowly(dice_.between(us_to_ns(100), ms_to_ns(8)), sleep_for);
        }
    }
    return true;
  }
  /// Once.
  void hang() noexcept {
    if (!shared_->may_hang || shared_->hung_cores.contains(number_)) return;
    shared_->findings.count(manner_.name());
    Hang& here = shared_->hung_cores
                     .emplace(number_, Hang{.component = component_,
                                            .clock_ns = clock_ns(),
                                            .from_ns = seeds::now_ns(),
                                            .is_in_state = manner_.hook == Hook::state,
                                            .is_in_cleanup = manner_.hook == Hook::cleanup})
                     .first->second;
    const auto hanging = shared_->hanging_components.insert(component_);
    shared_->hung_components.insert(component_);
    const int let_go = shared_->let_go;
    const time_ns_t until_ns =
        dice_.once_in(2) ? kForever : seeds::now_ns() + dice_.between(ms_to_ns(1), ms_to_ns(300));
    ++shared_->hanging;
    while (!shared_->hung_may_go_on && shared_->let_go == let_go && seeds::now_ns() < until_ns)
      sleep_for(ms_to_ns(1));
    --shared_->hanging;
    shared_->returned_ns = here.until_ns = seeds::now_ns();
    shared_->returned_excuses_ns = seeds::outcome().stalled_ns + shared_->slow_ns;
    shared_->hanging_components.erase(hanging);
  }

  std::shared_ptr<Shared> shared_;
  int component_;
  int number_;
  Manner manner_;
  Dice dice_;
  std::int64_t count_{0};   // take() moves it over
  std::int64_t copied_{0};  // the kernel copies it
  int adopted_{kNone};      // the core whose successor it is to be
  bool is_ready_{false};
  bool has_refused_{false};
  bool is_on_probation_{false};
  bool is_out_{false};       // another core has taken over
  bool was_on_call_{false};  // on probation: it may come back

  MAUVE_STATE(copied_)
};

/// act -> wait(period_ms) -> act, or another state that acts, as the guard says.
struct SeedFsm : Fsm<TestShell, SeedCore> {
  void define() override {
    State& run = execution("Run", "act", &SeedCore::act);
    State& odd = execution("Odd", "act", &SeedCore::act);
    State& pause = wait("Pause", ms_to_ns(shell().period_ms.value()));
    set_initial(run);
    next(run, pause);
    transition(pause, "is_odd", &SeedCore::is_odd, odd);
    next(odd, pause);
    next(pause, run);
  }
};

/// The same with a bound, which a slow core exceeds.
struct BoundedFsm : Fsm<TestShell, SeedCore> {
  void define() override {
    State& run = execution("Run", "act", &SeedCore::act, BoundedStates::kLongest);
    State& pause = wait("Pause", ms_to_ns(shell().period_ms.value()));
    set_initial(run);
    next(run, pause);
    next(pause, run);
  }
};

/// act -> wait for a write to what `input` reads -> act
struct EventFsm : Fsm<TestShell, SeedCore> {
  static constexpr time_ns_t kTimeout = ms_to_ns(90);
  static constexpr time_ns_t kApart = us_to_ns(700);
  void define() override {
    State& run = execution("Run", "act", &SeedCore::act);
    State& pause = wait_event("Pause", shell().input, kTimeout, kApart);
    set_initial(run);
    next(run, pause);
    next(pause, run);
  }
};

}  // namespace mauve::testing
