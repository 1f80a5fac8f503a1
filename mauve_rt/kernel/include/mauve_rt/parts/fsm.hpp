// SPDX-License-Identifier: LGPL-3.0-or-later
// Clock-based state machines: execution states that run a core's methods, wait states that advance the clock.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <typeinfo>
#include <vector>

#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/base/statistics.hpp"
#include "mauve_rt/parts/component_part.hpp"
#include "mauve_rt/parts/core.hpp"
#include "mauve_rt/parts/declared_state.hpp"
#include "mauve_rt/parts/duration.hpp"
#include "mauve_rt/parts/event_input.hpp"

namespace mauve {

/// A core as one fsm sees it: resolved before the core is put in, so that putting it in is a pointer swap.
struct CoreBinding {
  void* object{nullptr};                // of the fsm's core type, when it is a C++ core
  DynamicCore* dynamic{nullptr};        // otherwise
  std::vector<int> method_slots;        // of dynamic, by method number
  const CoreBase* core{nullptr};        // the same, given by the component
  std::vector<time_ns_t> budgets_ns{};  // of CPU time, by state, 0: none; empty: nothing enforces worst cases

  /// Whether the fsm can run the core. [rt]
  bool is_bound() const MAUVE_RT { return object != nullptr || dynamic != nullptr; }
  /// Whether the core is configured too: a component may start with it. [non-rt]
  bool is_ready() const noexcept { return is_bound() && core != nullptr && core->is_configured(); }
  /// Of a state by its index; 0: none. [rt]
  time_ns_t budget_ns(std::size_t state) const MAUVE_RT { return budgets_ns.empty() ? 0 : budgets_ns[state]; }
};

/// A method of the core, by name and by pointer, whichever the core at hand needs.
class Method {
 public:
  /// [setup]
  template <typename C, typename R>
  static Method action(std::string name, int number, R (C::*method)()) {
    return Method(std::move(name), number, method, [](const Storage& storage, void* object) -> bool {
      (static_cast<C*>(object)->*std::bit_cast<R (C::*)()>(storage))();
      return true;
    });
  }
  /// [setup]
  template <typename C, typename Pointer>
  static Method guard(std::string name, int number, Pointer method) {
    return Method(std::move(name), number, method, [](const Storage& storage, void* object) -> bool {
      return (static_cast<C*>(object)->*std::bit_cast<Pointer>(storage))();
    });
  }

  /// [rt]
  const std::string& name() const MAUVE_RT { return name_; }
  /// Runs the action on whichever core is bound. [rt] as far as the core is.
  void run(const CoreBinding& core) const {
    if (core.dynamic != nullptr) {
      core.dynamic->run(core.method_slots[number_]);
    } else {
      call_(storage_, core.object);
    }
  }
  /// Evaluates the guard. [rt] as far as the core is.
  bool test(const CoreBinding& core) const {
    return core.dynamic != nullptr ? core.dynamic->test(core.method_slots[number_])
                                   : call_(storage_, core.object);
  }

 private:
  using Storage = std::array<std::byte, 2 * sizeof(void*)>;
  using Call = bool (*)(const Storage&, void*);

  template <typename Pointer>
  Method(std::string name, int number, Pointer method, Call call)
      : name_(std::move(name)),
        number_(static_cast<std::size_t>(number)),
        storage_(std::bit_cast<Storage>(method)),
        call_(call) {}

  std::string name_;
  std::size_t number_;
  Storage storage_;
  Call call_;
};

struct State;

/// How long an execution state of a machine took.
struct StateTime {
  std::string state;
  ExecutionTime time{};
};
using StateTimes = std::deque<StateTime>;  // elements stay where they are

struct Transition {
  std::size_t guard;  // index of the fsm's methods
  State* to;
};

/// A node of the machine. Filled by Fsm during configure, constant afterwards but for what it counts.
struct State {
  static constexpr std::size_t kNone = SIZE_MAX;

  std::string name;
  std::size_t index{0};  // in the order of declaration
  bool is_wait{false};
  time_ns_t duration_ns{0};             // of a wait; of an event wait its timeout; kForever: it has none
  std::string duration_text;            // Duration::text of it
  std::unique_ptr<EventInput> event;    // of an event wait
  time_ns_t min_interarrival_ns{0};     // of an event wait: the least time from one release to the next
  std::string min_interarrival_text;    // Duration::text of it
  std::size_t action{kNone};            // of an execution state
  time_ns_t max_execution_ns{0};        // declared bound of an execution state; 0: none
  time_ns_t simulated_execution_ns{0};  // what it takes in virtual time
  time_ns_t wcet_ns{
      0};  // its worst case, of a wait that of its guards, for the timing analysis; 0: not declared
  std::vector<Transition> transitions;  // the first whose guard holds is taken; of a wait, when it has ended
  State* next{nullptr};                 // otherwise this one
  std::uint32_t trace_id{0};
  ExecutionTime* execution_time{nullptr};  // recorded by the thread that runs it
};

/// A state as who analyses or draws a machine sees it.
struct DescribedState {
  std::string name{};
  bool is_initial{false};
  bool is_wait{false};
  bool is_event_wait{false};
  time_ns_t duration_ns{0};             // of a wait; of an event wait its timeout; kForever: it has none
  time_ns_t min_interarrival_ns{0};     // of an event wait
  time_ns_t max_execution_ns{0};        // of an execution state: its bound; 0: none
  time_ns_t simulated_execution_ns{0};  // what it takes in virtual time
  std::vector<std::string>
      successors{};      // in the order in which guards are asked; last the one without a guard
  time_ns_t wcet_ns{0};  // its worst case; of a wait that of its guards; 0: not declared
  // The expressions of the two times above: `5 * unit_ms`; empty: a plain number of ns.
  std::string duration_text{};
  std::string min_interarrival_text{};
  std::string action{};               // of an execution state: the core's method that it runs
  std::vector<std::string> guards{};  // the core's methods, one for each successor but the last
  std::string event_port{};           // of an event wait
  std::string wcet_core{};  // the core that declares wcet_ns; empty: the architecture file or the fsm does
  std::vector<std::string> methods_without_wcet{};  // of a core that declares times of others: wcet_ns is 0
  bool wcet_enforced{false};  // an execution that uses more CPU time than wcet_ns faults its component
};

/// Gives each state without a worst case the core's: the times of its action, which a wait lacks, and of the guards that are
/// asked after it. Where the core declares none of one of these methods, the state keeps none. `core`: its name. [non-rt]
void add_core_times(std::vector<DescribedState>& states, const std::string& core, const CoreTimes& times);

/// An fsm seen without its types.
class FsmBase : public ComponentPart<FsmBase> {
 public:
  /// Binds to a shell; false when it is not of the fsm's type. [setup]
  virtual bool bind_shell(Shell& shell) noexcept = 0;
  /// Resolves a core against this machine. [non-rt] Throws Error (type_mismatch) when it does not suit.
  virtual CoreBinding bind_core(CoreBase& core) const = 0;

  /// [rt]
  const State& initial() const MAUVE_RT { return *initial_; }
  const std::vector<std::unique_ptr<State>>& states() const MAUVE_RT { return states_; }
  const std::vector<Method>& methods() const MAUVE_RT { return methods_; }
  /// The execution states' times; who holds them may read them when the machine is gone. [non-rt]
  std::shared_ptr<const StateTimes> times() const noexcept { return times_; }
  /// g: the greatest common divisor of the lengths of all cycles; 0 when sporadic. Valid once configured. [rt]
  time_ns_t period_ns() const MAUVE_RT { return period_ns_; }
  /// Whether it waits for events: phase and missed releases do not apply to it then. Valid once configured. [rt]
  bool is_sporadic() const MAUVE_RT { return sporadic_; }
  /// The least time from the release before to one that enters the initial state: the smallest min_interarrival of the
  /// event waits that lead there, or of all where none does. 0: the initial state is a wait, or it is not sporadic. Valid
  /// once configured. [rt]
  time_ns_t initial_interarrival_ns() const MAUVE_RT { return initial_interarrival_ns_; }
  /// The smallest max_execution of all states; 0: none declares one. Valid once configured. [rt]
  time_ns_t smallest_bound_ns() const MAUVE_RT { return smallest_bound_ns_; }

  /// Empty before it is configured. [non-rt]
  std::vector<DescribedState> describe_states() const;
  /// Times of execution states that stand in the place of its own, as far as it has states of these names. Before configure.
  /// [setup]
  void declare_states(std::vector<DeclaredState> states) { declared_states_ = std::move(states); }
  std::string description() const override { return "fsm " + implementation(); }

 protected:
  /// Throws Error (type_mismatch): fsm and core are of two builds. [non-rt]
  void require_same_generation(const CoreBase& core) const;
  /// Declare states and transitions here; shell properties are set by then. [setup]
  virtual void define() = 0;

  /// A state that advances the clock by > 0 ns and sleeps until then. kForever: until the component is stopped; such a
  /// state leads nowhere, and needs no next(). `mauve::times(5, shell().unit_ms)` keeps its expression for descriptions. [setup]
  State& wait(std::string name, const Duration& duration);
  /// Waits for a write to the resource that a read port is connected to. The clock goes on to the event's time, but
  /// by min_interarrival at least; or by the timeout when no event comes (kForever: an event alone ends it). Both > 0 ns.
  /// [setup]
  State& wait_event(std::string name, PortBase& port, const Duration& timeout,
                    const Duration& min_interarrival);
  void set_initial(State& state) noexcept { initial_ = &state; }
  /// Where a state goes when no transition's guard holds. Every state needs one.
  void next(State& from, State& to) noexcept { from.next = &to; }
  State& add_state(std::string name);
  State& add_execution(std::string name);
  std::size_t add_method(Method method);
  /// Makes g a divisor of this too, for machines that declare a period of their own. In define(). [setup]
  void declare_divisor(time_ns_t divisor_ns) noexcept { divisor_ns_ = divisor_ns; }
  int method_count() const noexcept { return static_cast<int>(methods_.size()); }
  CoreBinding bind_dynamic(DynamicCore& core) const;

  bool configure_hook() override;
  void cleanup_hook() override;

 private:
  void take_declared_times();

  std::vector<std::unique_ptr<State>> states_;
  std::vector<Method> methods_;
  std::shared_ptr<StateTimes> times_{std::make_shared<StateTimes>()};
  State* initial_{nullptr};
  time_ns_t period_ns_{0};
  bool sporadic_{false};
  time_ns_t initial_interarrival_ns_{0};
  time_ns_t smallest_bound_ns_{0};
  time_ns_t divisor_ns_{0};  // 0: none
  std::vector<DeclaredState> declared_states_;
};

/// Derive from this with the shell and core types, and declare the machine in define().
template <typename ShellType, typename CoreType>
class Fsm : public FsmBase {
 public:
  using shell_type = ShellType;
  using core_type = CoreType;

  bool bind_shell(Shell& shell) noexcept override {
    shell_ = shell_as<ShellType>(shell);
    return shell_ != nullptr;
  }
  CoreBinding bind_core(CoreBase& core) const override {
    // Its methods, compiled into the fsm, are those of its own build; virtual ones of a base class are the core's. Where they
    // stand in the core's table the fsm knows by its own build of the base class, which has to be the core's.
    if (typeid(core) == typeid(CoreType)) require_same_generation(core);
    require_same_builds(*this, core);
    if (auto* typed = dynamic_cast<CoreType*>(&core))
      return {.object = typed, .dynamic = nullptr, .method_slots = {}};
    if (auto* dynamic = dynamic_cast<DynamicCore*>(&core)) return bind_dynamic(*dynamic);
    return {};
  }

 protected:
  ShellType& shell() const noexcept { return *shell_; }

  /// A state that runs a method of the core; the method's name serves cores that are not C++.
  State& execution(std::string name, std::string method_name, void (CoreType::*method)(),
                   time_ns_t max_execution_ns = 0) {
    State& state = add_execution(std::move(name));
    state.action = add_method(Method::action(std::move(method_name), method_count(), method));
    state.max_execution_ns = max_execution_ns;
    return state;
  }
  /// Goes to `to` when the guard holds after the state, of a wait state when the wait has ended; guards are asked on the
  /// component's thread, in the order of declaration.
  void transition(State& from, std::string guard_name, bool (CoreType::*guard)(), State& to) {
    from.transitions.push_back(
        {add_method(Method::guard<CoreType>(std::move(guard_name), method_count(), guard)), &to});
  }
  void transition(State& from, std::string guard_name, bool (CoreType::*guard)() const, State& to) {
    from.transitions.push_back(
        {add_method(Method::guard<CoreType>(std::move(guard_name), method_count(), guard)), &to});
  }

 private:
  ShellType* shell_{nullptr};
};

/// The greatest common divisor of the cycle lengths of what is reachable from a state. [non-rt]
/// One depth-first search gives the strongly connected components (Tarjan 1972) and the potentials; every
/// edge inside a component then contributes |potential(u) + length(u) - potential(v)|. Throws Error:
/// loop_without_wait naming the loop.
time_ns_t cycle_gcd_ns(const State& initial);
/// For each wait that lies in a cycle with the initial state: the waits from that state's entry to its own end, which differ by
/// multiples of the period from path to path. [non-rt]
std::map<const State*, time_ns_t> wait_ends_ns(const State& initial);

}  // namespace mauve
