// SPDX-License-Identifier: LGPL-3.0-or-later
// Architecture: components and resources, connected.
#pragma once

#include <algorithm>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "mauve_rt/architecture/authors.hpp"
#include "mauve_rt/architecture/description.hpp"
#include "mauve_rt/architecture/keeper.hpp"
#include "mauve_rt/architecture/open_change.hpp"
#include "mauve_rt/architecture/overlays.hpp"
#include "mauve_rt/base/contract.hpp"
#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/base/seam/atomic.hpp"
#include "mauve_rt/base/seam/mutex.hpp"
#include "mauve_rt/base/seam/shared_mutex.hpp"
#include "mauve_rt/change/transaction.hpp"
#include "mauve_rt/data/resource.hpp"
#include "mauve_rt/run/change_lock.hpp"
#include "mauve_rt/run/commit_gate.hpp"
#include "mauve_rt/run/component.hpp"

namespace mauve {

class Runner;
class PluginRegistry;
class TransactionCommit;

/// What drain_trace() yields; indices are component numbers, removed components included.
struct TraceDrain {
  std::vector<TraceRecord> records;
  std::vector<std::uint64_t> written;
  std::vector<std::uint64_t> dropped;
  time_ns_t monotonic_ns{0};
  time_ns_t realtime_ns{0};
};

/// Delay from the moment when all threads are ready to the epoch (rule 5).
inline constexpr time_ns_t kDeploymentLead = ms_to_ns(20);

/// What an architecture consists of.
struct Lists {
  std::vector<std::shared_ptr<Resource>> resources{};
  std::vector<std::shared_ptr<Component>> components{};  // last: ports go before what they connect to
};

/// A component, and where its ports lead to as far as it is decided.
struct Wiring {
  std::shared_ptr<Component> component;
  std::shared_ptr<const Wires> wires;
};

/// What a change finds of those before it.
enum class EarlierChange : std::uint8_t {
  none,       // nothing that it would have to wait for
  under_way,  // another change is being prepared or made
  late,       // one is made, and a component has not taken it yet
};

/// The architecture, for work that may outlive it: while the mutex is held it stays as it is, alive or gone.
///
/// | member       | written by       | read by | under                                     |
/// | ------------ | ---------------- | ------- | ----------------------------------------- |
/// | architecture | its end          | anyone  | mutex, shared by readers: no user code    |
/// | renewals     | who renews       | its end | acq_rel: what a renewal did before it ended |
struct ArchitecturePresence {
  SharedMutex mutex;
  Architecture* architecture;
  Atomic<int> renewals{0};  // of fallback cores, that are not over
};

/// Each is claimed by one change at a time.
struct ArchitectureClaims {
  bool structure{false};  // to add or remove something, to wire ports, or to give all components a new epoch
  bool revision{false};  // to be the only change since the revision that it expects, of those that expect one
};

/// Components and resources by name. All functions [non-rt] unless told. Every change is a transaction of one step or more, carried out
/// by the host that runs the architecture, or by itself while no host does. Changes of different components of a deployed
/// architecture are prepared and made in parallel, unless both add or remove something or wire ports.
///
/// | member                          | written by            | read by | under                          |
/// | ------------------------------- | --------------------- | ------- | ------------------------------ |
/// | lists_                          | changes, as they are made | anyone | the gate's mutex            |
/// | names_                          | who changes it        | anyone  | list_mutex_                    |
/// | numbered_                       | who changes it        | changes | list_mutex_                    |
/// | leaving_, retiring_             | who changes it        | anyone  | list_mutex_                    |
/// | prepared_                       | changes               | changes | change_lock_                   |
/// | claims_                         | changes, and who calls one off | changes | the gate's mutex      |
/// | open_                           | changes               | anyone  | change_lock_ and open_mutex_ to write, one of them to read |
/// | has_open_                       | changes               | anyone  | relaxed: a hint                |
/// | host_                           | hosts                 | anyone  | host_mutex_                    |
/// | retired_, finals_               | who removes, drains, records | same | trace_mutex_             |
/// | deployment_epoch_ns_            | who deploys           | anyone  | relaxed: a lone fact           |
class Architecture final : public Configurable {
 public:
  /// With a registry, parts can be named as well as given by type.
  explicit Architecture(PluginRegistry* registry = nullptr);
  ~Architecture() override;

  std::string description() const override { return "architecture"; }

  /// Configures resources, then components; does nothing when that was done. [non-rt]
  void configure() override;
  /// Cleans up all, in reverse order. [non-rt] Throws Error (already_running) when a component is not parked.
  void cleanup() override;

  /// Carries out a transaction. Waits for those under way that are about the same components. [non-rt]
  /// Throws Error naming the step (ErrorDetail::step); nothing was changed then.
  TransactionReport commit(Transaction transaction, const TransactionOptions& options = {});
  /// The same up to the commit: what the releases that follow tell can be asked for later, with report(). [non-rt]
  std::unique_ptr<TransactionCommit> make(Transaction transaction, const TransactionOptions& options = {});
  /// The same of a transaction of one step, whose errors tell no number. [non-rt]
  StepReport commit_one(Transaction transaction, const CommitTimeouts& timeouts = {});
  std::unique_ptr<TransactionCommit> make_one(Transaction transaction, const CommitTimeouts& timeouts = {});

  /// Adds a component made of the given types. Once the architecture is configured so is the component, and once it is
  /// deployed it arrives STOPPED. [non-rt] Throws Error: duplicate_name, out_of_range (settings); as configure() then.
  template <typename ShellType, typename CoreType, typename FsmType>
  Component& add_component(const std::string& name, const TaskSettings& settings = {}) {
    return add_component(name, new_part<Shell, ShellType>(), new_part<CoreBase, CoreType>(),
                         new_part<FsmBase, FsmType>(), settings);
  }
  Component& add_component(const std::string& name, std::unique_ptr<Shell> shell,
                           std::unique_ptr<CoreBase> core, std::unique_ptr<FsmBase> fsm,
                           const TaskSettings& settings);
  /// Adds a component of registered parts. [non-rt] Throws Error: unknown_shell, unknown_core, unknown_fsm
  /// besides.
  Component& add_component(const std::string& name, const std::string& shell, const std::string& core,
                           const std::string& fsm, const TaskSettings& settings);

  /// Adds a resource of a given type: add_resource<SharedData<Point>>("goal"). [non-rt]
  template <typename ResourceType, typename... Args>
  ResourceType& add_resource(const std::string& name, Args&&... args) {
    auto resource = std::make_unique<ResourceType>(std::forward<Args>(args)...);
    ResourceType& added = *resource;
    add_resource(name, std::unique_ptr<Resource>(std::move(resource)));
    return added;
  }
  void add_resource(const std::string& name, std::unique_ptr<Resource> resource);

  /// Connects a port to a service; of a running component in its next wait. [non-rt] Throws Error: unknown_port,
  /// unknown_service, type_mismatch, duplicate_name; once configured not_reconfigurable; timeout.
  void connect(Component& component, const std::string& port, Resource& resource, const std::string& service);
  void connect(const std::string& component, const std::string& port, const std::string& resource,
               const std::string& service);

  /// Lets who carries samples out of the architecture know of every write to a resource. [non-rt]
  /// Throws Error (invalid_argument) when it has no samples.
  void publish(const std::string& resource);
  /// Counts who carries samples into the architecture as a writer of a resource. [non-rt] Throws as
  /// Resource::bind_input().
  void subscribe(const std::string& resource);

  Component& component(const std::string& name) const;  // Throws Error: unknown_component
  Resource& resource(const std::string& name) const;    // Throws Error: unknown_resource
  /// The same, kept alive while the caller holds it, whatever is removed meanwhile. [non-rt]
  std::shared_ptr<Component> hold_component(const std::string& name) const;
  std::shared_ptr<Resource> hold_resource(const std::string& name) const;
  /// The same; nullptr when there is none. [non-rt]
  std::shared_ptr<Component> find_component(const std::string& name) const;
  std::shared_ptr<Resource> find_resource(const std::string& name) const;
  /// Throws Error (not_configured) when a component could not start for want of a configured core. [non-rt]
  void require_ready_cores() const;
  /// All there are now, in the order of declaration. [non-rt]
  std::vector<std::shared_ptr<Component>> components() const;
  std::vector<std::shared_ptr<Resource>> resources() const;

  /// The wiring of all components, as of one moment. [non-rt]
  std::vector<Wiring> wiring() const;

  /// Components (implementations, wiring, properties, states, grids) and resources, as of one moment. A component that has not
  /// taken a change yet that is made is described as it runs. [non-rt]
  ArchitectureDescription describe() const;

  /// A new, unconfigured core of a registered implementation. Throws Error: unknown_core.
  std::unique_ptr<CoreBase> make_core(const std::string& implementation) const;
  /// Throws Error (invalid_argument) when there is none.
  PluginRegistry& require_registry() const;
  PluginRegistry* registry() const noexcept { return registry_; }

  /// Threads of removed components that still run a timed-out execution. [non-rt]
  std::size_t threads_left_behind() const;

  /// The changes that are under way, or made and not settled: that a late component has not taken, or whose parts are there
  /// still. Waits for no change and for no hook. [non-rt]
  std::vector<OpenChangeFacts> open_changes() const;
  /// The component for which a change that is made waits, also one that the change removes; nullptr: no change waits for a
  /// component of that name. Waits as open_changes(). [non-rt]
  std::shared_ptr<Component> find_awaited(const std::string& name) const;
  /// Whether such a change gives the component new parts. Waits as open_changes(). [non-rt]
  bool awaits_parts(const std::string& name) const;

  ChangeSignal& changes() noexcept { return changes_; }
  /// Who changed what since the file or program made it. A core that runs after a fault as fallback is "fallback",
  /// one that a probation has put back "probation". [non-rt]
  std::vector<Authored> authors() const;
  /// Notes the author of a start or stop that was made without a transaction. [non-rt]
  void note_author(const Assigned& assigned, const std::string& author);
  /// Notes the author of each step of a transaction that is in force. [non-rt]
  void note_authors(const Transaction& transaction);
  /// What each element should be, by rules and persons. [non-rt]
  Overlays& overlays() noexcept { return overlays_; }
  /// The same: follows what has become of the architecture. `look`: before it was described. [non-rt]
  void follow(const Overlays::Look& look, const ArchitectureDescription& description);
  /// Grows with every committed change and every start, stop and fault; never 0. [non-rt]
  std::uint64_t revision() const noexcept {
    return std::uint64_t{1} + changes_.word.load(std::memory_order_acquire);
  }
  /// The instant that all grids are counted from; 0 before deployment. [rt]
  time_ns_t deployment_epoch_ns() const MAUVE_RT {
    return deployment_epoch_ns_.load(std::memory_order_relaxed);
  }
  /// By who deploys, and by a commit that resynchronises: now + kDeploymentLead. [rt]
  void set_deployment_epoch(time_ns_t epoch_ns) MAUVE_RT {
    deployment_epoch_ns_.store(epoch_ns, std::memory_order_relaxed);
  }

  /// The log lines of its parts. [non-rt]
  const std::shared_ptr<LogQueue>& log_queue() const noexcept { return log_queue_; }
  /// The level from which on lines of the component, or of the resource, of that name are kept; of both where both have it.
  /// [non-rt] Throws Error (unknown_component): neither is there.
  void set_log_level(const std::string& name, LogLevel level);
  LogLevel log_level(const std::string& name) const;
  /// Names by the numbers that trace records carry; those of removed components stay. [non-rt]
  std::vector<std::string> trace_components() const;
  /// Empties every ring, and what removed components left. [non-rt]
  TraceDrain drain_trace();
  /// The number under which somebody who is no component writes records; the same for the same name, which is no
  /// component's: `(rules)`. [non-rt] Throws Error (out_of_range) when all numbers are used up.
  std::uint16_t trace_number(const std::string& name);
  /// Writes a record there; its sequence is the next one of its component. [non-rt]
  void record(TraceRecord record);

  /// The next sample of the published resources not handed out yet; false when there is none. [non-rt], one
  /// thread.
  bool next_published(std::string& resource, std::vector<std::byte>& message, time_ns_t& time_ns);
  /// Told of the writes to published resources, and of clients' calls.
  Notifier& publications() noexcept { return publications_; }
  /// Notified when a stop has written to one of them.
  Notifier& stops() noexcept { return stops_; }
  /// Wires a resource that nobody uses yet to those who carry things in and out. [non-rt] Throws as publish(), and
  /// as Resource::bind_input().
  void prepare_outward(Resource& resource, TopicBinding topic);

  // ---- for hosts

  /// Under it changes are drafted and retired. [non-rt]
  ChangeLock& change_lock() noexcept { return change_lock_; }
  /// Its mutexes are taken after the change lock. [rt]
  CommitGate& commit_gate() MAUVE_RT { return commit_gate_; }
  /// Who runs it; nullptr: nobody. [non-rt]
  Runner* host() const;
  /// [non-rt], the change lock held. Throws Error (already_running) when it has a host.
  void set_host(Runner& host);
  /// Returns at once: a change that uses the host goes on, and finds it shut down. [non-rt]
  void release_host(const Runner& host) noexcept;

  // ---- for transactions

  /// Completes the changes that were committed and that all their components have taken. [non-rt], the change lock held; not
  /// from inside of a change that has begun to look at components.
  void settle_changes() noexcept;
  /// The same where no change is being made. [non-rt]
  void settle_if_idle() noexcept;
  /// Ends the probations whose time is over, and retires the parts that those which have ended have put out; a component that a
  /// change has claimed is left to the next call. [non-rt], the change lock held; as settle_changes().
  void settle_probations() noexcept;
  /// The same where no change is being made. [non-rt]
  void settle_probations_if_idle() noexcept;
  /// The old core of one whose core on probation hangs goes on in a component that takes its place. [non-rt]
  void bring_back(Component& hung);
  /// Keeps a change from its draft on, until it is settled or forgotten. [non-rt], the change lock held.
  void keep_open(std::shared_ptr<OpenChange> change);
  void forget_open(const OpenChange& change) noexcept;
  /// Settles what can be settled and lets other threads have the change lock until the look finds nothing to wait for, at most so
  /// long. [non-rt], the change lock held. Throws as throw_earlier().
  void wait_for_earlier(time_ns_t timeout_ns, const std::function<EarlierChange()>& look);
  /// Calls off a change of that component, or resource, that is being prepared and is at a hook of a new part; whether there was
  /// one. Waits for no change and for no hook. [non-rt]
  bool call_off_preparation(const std::string& target) const;
  /// Each whose hook has lasted for longer than it asked for. [non-rt], the change lock held.
  void call_off_overdue() const;
  /// What changes under way have claimed beside components. [rt], within a CommitGate::Look
  ArchitectureClaims& claims() MAUVE_RT {
    MAUVE_AUDIT(commit_gate_.is_looked_at_here());
    return claims_;
  }
  /// Throws Error (timeout): another change lasts, or a component, which is named, has not taken one. [non-rt], change lock held.
  [[noreturn]] void throw_earlier(EarlierChange earlier, time_ns_t waited_ns) const;
  /// The host, in use until the lock goes; it has no host, or one that ends, where that owns nothing. [non-rt], change lock held.
  Runner* use_host(std::shared_lock<SharedMutex>& use) const;
  /// Lets go of those that a change has made stale, before what they refer to goes. [non-rt], the change lock held.
  void drop_stale_prepared() noexcept;
  /// [non-rt], the change lock held.
  void enlist(OpenChange& prepared) {
    MAUVE_EXPECTS(change_lock_.is_held_here());
    prepared_.push_back(&prepared);
  }
  void delist(const OpenChange& prepared) noexcept {
    MAUVE_AUDIT(change_lock_.is_held_here());
    std::erase(prepared_, &prepared);
  }

  /// A component with a number of its own, not listed yet: its changes are nobody's business. One that was removed, and
  /// is gone, leaves its number to the next of its name, whose records follow its own. [non-rt]
  /// Throws Error (out_of_range) when all numbers are used up.
  std::shared_ptr<Component> make_unlisted(const std::string& name);
  /// How many numbers were given out; give_back() forgets those from `numbers` on. [non-rt]
  std::size_t numbers() const;
  void give_back_numbers(std::size_t numbers);
  /// What it consists of now, as one. [non-rt]
  Lists lists() const;
  /// Exchanges that for what a change makes of it. [rt], within a CommitGate::Look
  void swap_lists(Lists& lists) MAUVE_RT;
  /// A change is made that is to be settled. [rt]
  void note_open() MAUVE_RT { has_open_.store(true, std::memory_order_relaxed); }  // relaxed: a hint
  /// Has what was put out cleaned up, in user code: beside all changes where threads run, else at once. [non-rt]
  /// `of`: the component whose parts it is about.
  void dispose(const std::string& what, std::function<void()> work, const Component* of = nullptr,
               Keeper::Place place = Keeper::Place::last);
  /// Beside all changes, whether threads run or not. [non-rt]
  void dispose_beside(const std::string& what, std::function<void()> work, const void* lane);
  /// Whether dispose() would do so. [non-rt]
  bool disposes_beside(const void* lane = nullptr) const;
  /// A hook that was called off uses the parts of the component that are in by now: until release_parts() what is put out of it is
  /// not cleaned up, and it is not configured in its place. [non-rt]
  void hold_parts(const Component& component) { keeper_.hold(&component); }
  void release_parts(const Component& component) { keeper_.release(&component); }
  bool are_parts_held(const Component& component) const { return keeper_.is_held(&component); }
  /// Throws Error (already_running) while they are. [non-rt]
  void check_parts_free(const Component& component) const;
  const std::shared_ptr<ArchitecturePresence>& presence() const noexcept { return presence_; }
  /// What that does now, and since when. [non-rt]
  Keeper::Busy disposing() const { return keeper_.busy(); }
  /// How much was given to that by now. [non-rt]
  std::uint64_t disposed() const { return keeper_.taken(); }
  /// Waits until what came after the first ones is done, a little. [non-rt], without the change lock
  void wait_disposed(std::uint64_t first) const;
  /// Keeps a component whose thread has not ended; reap() lets those go that have. [non-rt]
  void keep_until_ended(std::shared_ptr<Component> component, bool was_listed);
  /// Cleans up resources that were removed, now or when nobody uses them any more. [non-rt]
  void retire(std::vector<std::shared_ptr<Resource>> resources);
  void reap();
  /// Keeps what a removed component's ring holds until the next drain. [non-rt]
  void retire_trace(Task& task);

 private:
  /// A new number that the trace knows the name by. Throws Error (out_of_range): all are used up.
  std::uint16_t give_number(const std::string& name) MAUVE_REQUIRES(list_mutex_);
  /// The number of a component of that name that is gone.
  std::optional<std::uint16_t> find_free_number(const std::string& name) const MAUVE_REQUIRES(list_mutex_);
  /// Keeps records until the next drain; of too many the oldest are lost.
  void keep_records(const std::vector<TraceRecord>& records) MAUVE_REQUIRES(trace_mutex_);

  struct Leaving {
    std::shared_ptr<Component> component;
    bool was_listed;
  };
  struct Final {  // of a removed component, or of who is none
    std::uint64_t written{0};
    std::uint64_t dropped{0};
  };

  bool configure_hook() override;
  void check_cleanup() const override;
  void cleanup_hook() override;
  void reject_core(const std::string& component, const std::string& core);
  bool end_threads() noexcept;
  void note_restructured() noexcept;

  PluginRegistry* registry_;
  const std::shared_ptr<LogQueue> log_queue_{
      std::make_shared<LogQueue>()};  // parts that are left behind have it, too
  ChangeLock change_lock_;
  mutable CommitGate commit_gate_;
  ArchitectureClaims claims_;
  std::vector<OpenChange*> prepared_;
  mutable Mutex open_mutex_;  // for a moment: no hook, and no other lock of a change but Work's facts
  std::vector<std::shared_ptr<OpenChange>> open_;
  Atomic<bool> has_open_{false};
  mutable Mutex host_mutex_;
  Runner* host_ MAUVE_GUARDED_BY(host_mutex_){nullptr};
  ChangeSignal changes_;
  Authors authors_;
  Overlays overlays_;
  Notifier publications_;
  Notifier stops_;
  Atomic<time_ns_t> deployment_epoch_ns_{0};
  mutable Mutex list_mutex_;
  std::vector<std::string> names_ MAUVE_GUARDED_BY(list_mutex_);  // by number
  std::map<std::uint16_t, std::weak_ptr<const Component>> numbered_
      MAUVE_GUARDED_BY(list_mutex_);  // who has a number; absent: no component ever had
  Mutex trace_mutex_;
  std::deque<TraceRecord> retired_ MAUVE_GUARDED_BY(trace_mutex_);
  std::vector<Final> finals_ MAUVE_GUARDED_BY(trace_mutex_);  // by number
  std::vector<std::shared_ptr<Resource>> retiring_ MAUVE_GUARDED_BY(list_mutex_);
  std::vector<Leaving> leaving_;
  Lists lists_;
  std::shared_ptr<ArchitecturePresence> presence_;
  Keeper keeper_;  // first to end but for the one that changes: it cleans up what others had
  Keeper comebacks_;
};

}  // namespace mauve
