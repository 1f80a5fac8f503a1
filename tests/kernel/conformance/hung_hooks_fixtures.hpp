// SPDX-License-Identifier: LGPL-3.0-or-later
// A component one of whose hooks hangs, or fails in virtual time, next to a component that is well.
#pragma once

#include <array>
#include <utility>

#include "mauve_rt/base/seam/condition_variable.hpp"
#include "mauve_rt/base/seam/mutex.hpp"
#include "mauve_rt/base/seam/ordinary_thread.hpp"

#include "hosts.hpp"

namespace mauve::testing::hung_hooks {

/// Where user code of the component `b` hangs.
enum class Hook : std::uint8_t {
  configure,                // of a new core
  configure_added,          // of the core of a component that is added
  cleanup,                  // of a core that a change has replaced
  cleanup_beside_fallback,  // the same, of a component that has a fallback core
  fallback,                 // the configure of the fallback core, which is made ready for a new fsm
  adopt,                    // of a new core
  take,                     // of a new core
  state,                    // of the fsm
  guard,                    // of a transition of the fsm
  call,                     // of a service that a resource offers, in a state
  shadow,                   // a state of the candidate in the shadow
  shadow_cleanup,           // of the candidate of a shadow that ends
  promote,                  // asked for while a state of the candidate hangs
  probation,                // a state of a core on probation
};
inline constexpr std::array<const char*, 14> kHookNames{"Configure",
                                                        "ConfigureOfAnAddedOne",
                                                        "Cleanup",
                                                        "CleanupBesideAFallback",
                                                        "FallbackConfigure",
                                                        "Adopt",
                                                        "Take",
                                                        "State",
                                                        "Guard",
                                                        "Call",
                                                        "ShadowState",
                                                        "ShadowCleanup",
                                                        "Promote",
                                                        "Probation"};
inline std::string name_of(const ::testing::TestParamInfo<Hook>& hook) {
  return kHookNames.at(static_cast<std::size_t>(hook.param));
}
inline std::vector<Hook> all_hooks() {
  std::vector<Hook> all;
  for (std::size_t i = 0; i < kHookNames.size(); ++i) all.push_back(static_cast<Hook>(i));
  return all;
}

/// A place of a core at which the test lets it hang, or fail.
enum class Point : std::uint8_t { none, configure, cleanup, adopt, take, state, guard, call };

struct Trap {
  /// Once. A core calls it at each of its points; its thread may do so after the test.
  void pass(Point point) {
    Point expected = point;
    if (!armed.compare_exchange_strong(expected, Point::none)) return;
    if (!is_virtual) return doors->pass();
    doors->entered = true;
    throw std::runtime_error("the hook fails");
  }

  Trap(bool in_virtual_time, std::shared_ptr<Doors> shared)
      : is_virtual(in_virtual_time), doors(std::move(shared)) {}
  const bool is_virtual;
  const std::shared_ptr<Doors> doors;
  std::atomic<Point> armed{Point::none};
};

/// Writes 7 in each of its states.
struct TrapCore : TestCore {
  explicit TrapCore(std::shared_ptr<Trap> shared = nullptr) : trap(std::move(shared)) {}
  void act() override {
    TestCore::act();
    exposed_shell().output.write({7.0});
    pass(Point::state);
    if (trap != nullptr && trap->armed == Point::call) call();
  }
  bool configure_hook() override {
    pass(Point::configure);
    return true;
  }
  void cleanup_hook() override { pass(Point::cleanup); }
  bool adopt(const CoreBase& /*old*/) override {
    pass(Point::adopt);
    return true;
  }
  void take(CoreBase& /*old*/) MAUVE_RT override {
    if (trap == nullptr) return;
    if (!trap->is_virtual) return MAUVE_RT_TRUSTED(trap->pass(Point::take));
    if (trap->armed.exchange(Point::none) == Point::take) MAUVE_RT_TRUSTED(lasting());
  }
  time_ns_t budget_ns() const MAUVE_RT override { return budget; }
  bool is_held() const {
    if (trap != nullptr) trap->pass(Point::guard);
    return false;
  }
  void pass(Point point) {
    if (trap != nullptr) trap->pass(point);
  }

  std::shared_ptr<Trap> trap;
  std::function<void()> call = [] {};
  std::function<void()> lasting = [] {};
  time_ns_t budget{0};
};

struct TrapFsm : Fsm<TestShell, TrapCore> {
  void define() override {
    State& run = execution("Run", "act", &TestCore::act);
    State& pause = wait("Pause", ms_to_ns(shell().period_ms.value()));
    set_initial(run);
    next(run, pause);
    transition(pause, "is_held", &TrapCore::is_held, pause);
    next(pause, run);
  }
};

/// Offers a service whose call hangs.
class Server final : public Resource {
 public:
  explicit Server(std::shared_ptr<Trap> trap) : Resource("test/Server", ""), serve_(std::move(trap)) {
    offer(serve_);
  }

 private:
  class Serve final : public CallService<void()> {
   public:
    explicit Serve(std::shared_ptr<Trap> trap) : CallService("serve", "test/Serve"), trap_(std::move(trap)) {}
    void call() override { trap_->pass(Point::call); }

   private:
    std::shared_ptr<Trap> trap_;
  };
  Serve serve_;
};
struct CallingShell : TestShell {
  CallPort<void()>& serve = call_port<void()>("serve", "test/Serve");
};

/// Opens the doors when a case lasts for so long that a call cannot have been answered: the case fails then, and ends.
class Watch {
 public:
  explicit Watch(Doors& doors) : thread_([this, &doors] { run(doors); }) {}
  ~Watch() {
    {
      const LockGuard lock(mutex_);
      is_over_ = true;
    }
    changed_.notify_all();
    thread_.join();
  }
  Watch(const Watch&) = delete;
  Watch& operator=(const Watch&) = delete;

 private:
  void run(Doors& doors) {
    const time_ns_t until_ns = monotonic_now_ns() + s_to_ns(30);
    const LockGuard lock(mutex_);
    while (!is_over_ && changed_.wait_until(mutex_, until_ns)) {
    }
    if (!is_over_) doors.open = true;
  }

  Mutex mutex_;
  ConditionVariable changed_;
  bool is_over_{false};
  OrdinaryThread thread_;
};

/// The answer of a request, which another thread makes where time does not stand still.
class Answer {
 public:
  Answer() = default;
  ~Answer() { wait(); }
  Answer(const Answer&) = delete;
  Answer& operator=(const Answer&) = delete;

  template <typename Request>
  void ask(Request request, bool here) {
    is_asked_ = true;
    if (here) {
      code_ = request();
    } else {
      thread_ = OrdinaryThread([this, request = std::move(request)]() mutable { code_ = request(); });
    }
  }
  bool is_asked() const { return is_asked_; }
  void wait() {
    if (thread_.joinable()) thread_.join();
  }
  ErrorCode take() {
    wait();
    is_asked_ = false;
    return code_;
  }

 private:
  bool is_asked_{false};
  ErrorCode code_{};
  OrdinaryThread thread_;
};

inline constexpr time_ns_t kLong = s_to_ns(60);
inline constexpr time_ns_t kShort = ms_to_ns(20);
inline constexpr time_ns_t kOverdue = ms_to_ns(500);

/// Components `b`, whose hook misbehaves, and `p`, which is well. Both write 7 to a resource of their own.
template <typename Way>
class HookCase : public Hosted<Way>, public ::testing::WithParamInterface<Hook> {
 protected:
  static constexpr bool is_virtual = Hosted<Way>::is_virtual;

  void add_parts() {
    Component& b = add_trap("b", trap);
    Component& p = this->add("p");
    TestCore& well = this->core(p);
    well.work = [&well] { well.exposed_shell().output.write({7.0}); };
    for (const char* name : {"b", "p"}) {
      const std::string out = std::string(name) + "_out";
      this->architecture.template add_resource<LatestValue<Number>>(out);
      this->architecture.connect(name, "output", out, "write");
    }
    if (has_fallback()) {
      auto spare = std::make_unique<TrapCore>(fallback_trap);
      spare->set_implementation("t/Fallback");
      b.set_fallback(std::move(spare));
    }
    if (hook() != Hook::call) return;
    this->architecture.template add_resource<Server>("server", trap);
    this->architecture.connect("b", "serve", "server", "serve");
    auto& own = b.core_as<TrapCore>();
    own.call = [port = &b.shell_as<CallingShell>().serve] { (*port)(); };
  }
  Component& add_trap(const std::string& name, const std::shared_ptr<Trap>& its_trap) {
    TaskSettings settings;
    settings.cpus = {kComponentsCpu};
    settings.hung_after_ns = s_to_ns(600);
    Component& added = this->architecture.add_component(
        name, make_shell(), std::make_unique<TrapCore>(its_trap), new_part<FsmBase, TrapFsm>(), settings);
    added.set_property("period_ms", std::int64_t{2});
    return added;
  }
  std::unique_ptr<Shell> make_shell() const {
    if (hook() == Hook::call) return std::make_unique<CallingShell>();
    return std::make_unique<TestShell>();
  }
  /// Both run, and their values are seen.
  void begin() {
    this->deploy();
    this->way.until([&] { return value_of("b") == 7.0 && value_of("p") == 7.0; }, "both to run");
  }
  void finish() {
    if constexpr (!is_virtual) {
      EXPECT_FALSE(doors->open) << "each call was answered while the hook hung";
      doors->open = true;
    }
    for (const auto& each : {trap, trial_trap, fallback_trap}) each->armed = Point::none;
    change.wait();
    this->way.shutdown();
  }

  Hook hook() const { return GetParam(); }
  bool has_fallback() const { return hook() == Hook::cleanup_beside_fallback || hook() == Hook::fallback; }
  /// Whether the hook runs on the thread of b.
  bool is_occupied() const {
    switch (hook()) {
      case Hook::adopt:
      case Hook::take:
      case Hook::state:
      case Hook::guard:
      case Hook::call:
      case Hook::probation:
        return true;
      default:
        return false;
    }
  }
  /// Whether a change that hangs in its preparation has run into it.
  bool is_preparing() const {
    return hook() == Hook::configure || hook() == Hook::configure_added || hook() == Hook::promote;
  }
  double value_of(const std::string& component) {
    auto& found = static_cast<LatestValue<Number>&>(this->architecture.resource(component + "_out"));
    Number value{.value = -9};
    time_ns_t time_ns = 0;
    ReaderState reader;
    found.read.read(value, time_ns, reader);
    return value.value;
  }
  TransactionReport commit(Transaction& transaction, time_ns_t commit_ns = kLong) {
    return this->host().commit(std::move(transaction), {.timeouts = {.commit_ns = commit_ns, .phase_ns = 0}});
  }

  // ---- the hook is brought to hang, or to fail

  void misbehave() {
    switch (hook()) {
      case Hook::configure:
        return replace_core(Point::configure);
      case Hook::configure_added:
        trial_trap->armed = Point::configure;
        return request(
            std::move(Transaction().add_component("new", {.shell = make_shell(),
                                                          .core = std::make_unique<TrapCore>(trial_trap),
                                                          .fsm = std::make_unique<TrapFsm>()})));
      case Hook::adopt:
        return replace_core(Point::adopt);
      case Hook::take:
        return replace_core(Point::take);
      case Hook::cleanup:
      case Hook::cleanup_beside_fallback:
        trap->armed = Point::cleanup;
        return request(std::move(Transaction().replace_core("b", std::make_unique<TrapCore>())));
      case Hook::fallback:
        fallback_trap->armed = Point::configure;
        return request(std::move(Transaction().replace_fsm("b", std::make_unique<TrapFsm>())));
      case Hook::state:
        return arm(Point::state);
      case Hook::guard:
        return arm(Point::guard);
      case Hook::call:
        return arm(Point::call);
      case Hook::probation:
        commit(Transaction().replace_core("b", std::make_unique<TrapCore>(trial_trap),
                                          ProbationOptions{.duration_ns = s_to_ns(600)}));
        trial_trap->armed = Point::state;
        return await();
      case Hook::shadow:
        begin_shadow();
        trial_trap->armed = Point::state;
        return await();
      case Hook::shadow_cleanup:
        begin_shadow();
        trial_trap->armed = Point::cleanup;
        return request(std::move(Transaction().end_shadow("b")));
      case Hook::promote:
        begin_shadow();
        trial_trap->armed = Point::state;
        await();
        return request(std::move(Transaction().promote("b")));
    }
  }
  void replace_core(Point point) {
    auto fresh = std::make_unique<TrapCore>(trial_trap);
    if (is_virtual && point == Point::take) {
      fresh->budget = us_to_ns(100);
      fresh->lasting = [&task = this->architecture.component("b").task()] {
        task.clock().spend(ms_to_ns(1));
      };
    }
    trial_trap->armed = point;
    request(std::move(Transaction().replace_core("b", std::move(fresh))));
  }
  void begin_shadow() {
    Transaction shadowed;
    shadowed.shadow("b", std::make_unique<TrapCore>(trial_trap), {.budget_ns = s_to_ns(1)},
                    std::make_unique<TestShell>());
    commit(shadowed);
  }
  void arm(Point point) {
    trap->armed = point;
    await();
  }
  void await() {
    this->way.until([&] { return doors->entered.load(); }, "the hook");
  }
  /// Another thread asks for a change that waits for the state of b.
  void request_property() { ask(std::move(Transaction().set_property("b", "gain", 2.0))); }
  /// Another thread asks for a change in which the hook hangs; its answer is in `change`.
  void request(Transaction transaction) {
    ask(std::move(transaction));
    if constexpr (!is_virtual) {
      this->way.until(
          [&] { return doors->entered && (hook() != Hook::promote || !this->host().open_changes().empty()); },
          "the hook");
    }
  }
  void ask(Transaction transaction) {
    const auto answer = [this](Transaction& asked) {
      try {
        this->host().commit(std::move(asked),
                            {.timeouts = {.commit_ns = kLong, .phase_ns = 0, .prepare_ns = kOverdue}});
      } catch (const Error& error) {
        return error.code();
      }
      return ErrorCode::internal;  // none
    };
    change.ask([answer, asked = std::move(transaction)]() mutable { return answer(asked); }, is_virtual);
  }

  const std::shared_ptr<Doors> doors{std::make_shared<Doors>()};
  const std::shared_ptr<Trap> trap{
      std::make_shared<Trap>(is_virtual, doors)};  // of the core that b begins with
  const std::shared_ptr<Trap> trial_trap{
      std::make_shared<Trap>(is_virtual, doors)};  // of a core that comes later
  const std::shared_ptr<Trap> fallback_trap{
      std::make_shared<Trap>(is_virtual, doors)};  // of the fallback core
  Answer change;
};

}  // namespace mauve::testing::hung_hooks
