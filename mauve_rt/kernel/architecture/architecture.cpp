// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/architecture/architecture.hpp"

#include <algorithm>

#include "mauve_rt/architecture/plugin.hpp"
#include "mauve_rt/architecture/runner.hpp"
#include "mauve_rt/base/contract.hpp"
#include "mauve_rt/base/error.hpp"
#include "mauve_rt/base/seam/futex.hpp"
#include "mauve_rt/base/seam/sleep.hpp"
#include "mauve_rt/change/transaction_commit.hpp"

#include "base/keep_for_ever.hpp"
#include "base/prefault.hpp"
#include "parts/lookup.hpp"

namespace mauve {

namespace {

constexpr time_ns_t kEndTimeout = ms_to_ns(500);
/// How long a request waits for the cleanup of what it has put out.
constexpr time_ns_t kCleanup = s_to_ns(1);

template <typename Item>
std::shared_ptr<Item> find_in(const std::vector<std::shared_ptr<Item>>& items, const std::string& name) {
  for (const auto& item : items) {
    if (item->name() == name) return item;
  }
  return nullptr;
}

}  // namespace

Architecture::Architecture(PluginRegistry* registry)
    : registry_(registry), presence_(std::make_shared<ArchitecturePresence>()) {
  presence_->architecture = this;
  note_allocated_before();  // whatever comes after may be what its components own
}

Architecture::~Architecture() {
  MAUVE_AUDIT(prepared_.empty());  // a prepared transaction refers to its architecture
  comebacks_.wait(0, kForever);    // it is a change of this architecture
  keeper_.wait(0, monotonic_now_ns() + kEndTimeout);
  {
    const std::unique_lock gone(presence_->mutex);
    presence_->architecture = nullptr;
  }
  // A fallback core whose configure hangs uses shell, fsm and resources of its component.
  const bool have_ended = end_threads() && presence_->renewals.load(std::memory_order_acquire) == 0;
  std::erase_if(open_, [](const auto& change) { return change->settle(); });
  // The thread of a change that was called off finds no architecture any more, and frees no parts from here on: a hook of that
  // change may still use them, and check_cleanup() would throw.
  const bool are_held = std::any_of(lists_.components.begin(), lists_.components.end(),
                                    [this](const auto& component) { return are_parts_held(*component); });
  if (!have_ended || are_held || !open_.empty()) {
    // A thread that does not come back from user code is left behind with all it may use: nothing of that is freed.
    for (const auto& resource : lists_.resources) resource->set_notifier(nullptr);
    keep_for_ever(std::move(lists_.resources));
    for (const Leaving& leaving : leaving_) leaving.component->task().detach_thread();
    keep_for_ever(std::move(leaving_));
    auto& components = lists_.components;
    const auto has_ended = [this](const auto& component) {
      return component->task().has_ended() && !component->is_renewing() && !are_parts_held(*component);
    };
    const auto first = std::partition(components.begin(), components.end(), has_ended);
    std::for_each(first, components.end(), [](const auto& component) { component->task().detach_thread(); });
    keep_for_ever(std::vector<std::shared_ptr<Component>>(first, components.end()));
    keep_for_ever(std::move(open_));  // a thread that was left behind may not have taken its change
    components.erase(first, components.end());
    lists_.resources.clear();
  }
  open_.clear();
  Configurable::cleanup();
}

void Architecture::configure() {
  const auto change = change_lock_.join_alone();
  Configurable::configure();
}

void Architecture::cleanup() {
  wait_disposed(0);  // a component is not cleaned up while its fallback core is being made ready
  const auto change = change_lock_.join_alone();
  Configurable::cleanup();
}

std::unique_ptr<TransactionCommit> Architecture::make(Transaction transaction,
                                                      const TransactionOptions& options) {
  struct Disposed {
    ~Disposed() { architecture.wait_disposed(first); }
    const Architecture& architecture;
    std::uint64_t first;
  };
  const Disposed last{*this, disposed()};
  const LockGuard change(change_lock_);
  std::shared_lock<SharedMutex> use;
  Runner* const host = use_host(use);
  auto work = std::make_unique<TransactionCommit>(*this, host, options);
  work->make(std::move(transaction));
  return work;
}

void Architecture::check_parts_free(const Component& component) const {
  if (!are_parts_held(component)) return;
  throw Error(ErrorCode::already_running, "a hook of a change that was called off still uses its parts",
              {.component = component.name(),
               .expected = "the end of the hook",
               .remedy = "try again, or remove the component"});
}

bool Architecture::disposes_beside(const void* lane) const {
  const Runner* const runner = host();
  if (runner != nullptr && !runner->is_simulated()) return true;
  return lane != nullptr &&
         keeper_.is_at(lane);  // of a host that has gone: it may use what is to be cleaned up
}

void Architecture::dispose(const std::string& what, std::function<void()> work, const Component* of,
                           Keeper::Place place) {
  const void* lane = of;
  if (of != nullptr && !keeper_.is_at(of)) lane = of->lane();
  if (!disposes_beside(lane)) return work();
  keeper_.take(what, std::move(work), lane, place);
}

void Architecture::dispose_beside(const std::string& what, std::function<void()> work, const void* lane) {
  keeper_.take(what, std::move(work), lane);
}

void Architecture::wait_disposed(std::uint64_t first) const {
  keeper_.wait(first, later_by(monotonic_now_ns(), kCleanup));
}

TransactionReport Architecture::commit(Transaction transaction, const TransactionOptions& options) {
  return make(std::move(transaction), options)->report(options.timeouts.phase_ns);
}

std::unique_ptr<TransactionCommit> Architecture::make_one(Transaction transaction,
                                                          const CommitTimeouts& timeouts) {
  try {
    return make(std::move(transaction), {.timeouts = timeouts});
  } catch (const Error& failure) {  // who asked for one thing needs no number for it
    ErrorDetail detail = failure.detail();
    detail.step = 0;
    detail.step_name.clear();
    throw Error(failure.code(), failure.statement(), detail);
  }
}

StepReport Architecture::commit_one(Transaction transaction, const CommitTimeouts& timeouts) {
  return make_one(std::move(transaction), timeouts)->report(timeouts.phase_ns).steps.front();
}

void Architecture::settle_changes() noexcept {
  MAUVE_AUDIT(change_lock_.is_held_here());
  has_open_.store(false, std::memory_order_relaxed);  // relaxed: a hint; first: one may be made meanwhile
  if (std::any_of(open_.begin(), open_.end(), [](const auto& change) { return change->is_under_way(); }))
    note_open();
  for (OpenChange* prepared : prepared_) prepared->settle();
  const auto open = open_;  // a hook may ask for a change of its own
  for (const auto& change : open) {
    if (change->settle()) forget_open(*change);
  }
}

/// A change that comes first makes this one stale, which has the core by then: it is given back, and the next change takes it.
void Architecture::bring_back(Component& hung) {
  constexpr time_ns_t kEarlierChanges = s_to_ns(5);
  constexpr time_ns_t kBetweenTries = ms_to_ns(1);
  const auto probation = hung.present_probation();
  if (probation != nullptr) reject_core(hung.name(), probation->record().to_core);
  const time_ns_t until = later_by(monotonic_now_ns(), kEarlierChanges);
  for (;; sleep_for(kBetweenTries)) {
    Transaction change;
    change.bring_back(hung.name()).by("probation");
    try {
      make(std::move(change), {.timeouts = {.commit_ns = kEarlierChanges}});
      if (probation != nullptr) probation->end_comeback();
      return;
    } catch (const Error& failure) {
      if (probation == nullptr) return;
      const bool may_pass =
          failure.code() == ErrorCode::wrong_revision || failure.code() == ErrorCode::timeout;
      if (may_pass && probation->has_core_back() && monotonic_now_ns() < until) continue;
      return probation->note_left_out(failure.what());
    }
  }
}

void Architecture::settle_probations() noexcept {
  MAUVE_AUDIT(change_lock_.is_held_here());
  for (const auto& component : components()) {
    const bool is_probation_over = component->is_probation_over();  // it gives up one that hangs
    const auto probation = component->present_probation();
    if (probation != nullptr && probation->claim_comeback())
      comebacks_.take(
          "the comeback of the old core of " + component->description(),
          [this, component] { bring_back(*component); }, component.get());
    const auto shadow = component->last_shadow();
    if (shadow != nullptr) shadow->conclude_if_hung(component->task().state_age().hung_after_ns);
    const bool has_shadow_ended = shadow != nullptr && shadow->is_to_settle();
    if (!is_probation_over && !has_shadow_ended) continue;
    ChangeMark& mark = component->change_mark();
    const bool is_reverted = component->is_probation_reverted();
    {
      const CommitGate::Look table(commit_gate_);
      if (mark.is_claimed() || mark.is_unsettled() || commit_gate_.has_open_about(component->task()))
        continue;
      mark.claim();
      mark.hold();
      if (is_reverted) mark.set_changed();
    }
    drop_stale_prepared();  // they refer to the core that goes now
    component->settle_probation();
    component->settle_shadow();
    if (is_reverted) {
      authors_.note(component->name(), "core", "probation");
      if (probation != nullptr) reject_core(component->name(), probation->record().to_core);
    }
    const CommitGate::Look table(commit_gate_);
    mark.release();
  }
}

void Architecture::settle_probations_if_idle() noexcept {
  if (!change_lock_.try_lock()) return;
  const std::uint64_t first = disposed();
  {
    const LockGuard change(change_lock_, std::adopt_lock);
    std::shared_lock<SharedMutex> use;
    use_host(use);
    settle_changes();
    settle_probations();
  }
  wait_disposed(first);
}

void Architecture::keep_open(std::shared_ptr<OpenChange> change) {
  MAUVE_EXPECTS(change_lock_.is_held_here());
  const LockGuard lock(open_mutex_);
  open_.push_back(std::move(change));
}

void Architecture::forget_open(const OpenChange& change) noexcept {
  std::shared_ptr<OpenChange> forgotten;  // ends without the mutex: its parts are user code
  const LockGuard lock(open_mutex_);
  const auto place =
      std::find_if(open_.begin(), open_.end(), [&](const auto& each) { return each.get() == &change; });
  if (place == open_.end()) return;
  forgotten = std::move(*place);
  open_.erase(place);
}

std::vector<OpenChangeFacts> Architecture::open_changes() const {
  std::vector<OpenChangeFacts> all;
  const LockGuard lock(open_mutex_);
  for (const auto& change : open_) change->tell(all);
  return all;
}

std::shared_ptr<Component> Architecture::find_awaited(const std::string& name) const {
  const LockGuard lock(open_mutex_);
  for (const auto& change : open_) {
    if (auto component = change->find_awaited(name)) return component;
  }
  return nullptr;
}

bool Architecture::awaits_parts(const std::string& name) const {
  const LockGuard lock(open_mutex_);
  return std::any_of(open_.begin(), open_.end(),
                     [&name](const auto& change) { return change->awaits_parts(name); });
}

bool Architecture::call_off_preparation(const std::string& target) const {
  const LockGuard lock(open_mutex_);
  return std::any_of(open_.begin(), open_.end(), [&](const auto& change) {
    return change->is_about(target) && change->call_off_preparation();
  });
}

void Architecture::call_off_overdue() const {
  MAUVE_EXPECTS(change_lock_.is_held_here());
  for (const auto& change : open_) {
    if (change->is_overdue()) change->call_off_preparation();
  }
}

void Architecture::wait_for_earlier(time_ns_t timeout_ns, const std::function<EarlierChange()>& look) {
  MAUVE_EXPECTS(change_lock_.is_held_here());
  const time_ns_t until = later_by(monotonic_now_ns(), timeout_ns);
  for (;;) {
    settle_changes();
    const EarlierChange earlier = look();
    if (earlier == EarlierChange::none) return;
    if (earlier == EarlierChange::under_way) call_off_overdue();
    if (monotonic_now_ns() >= until) throw_earlier(earlier, timeout_ns);
    change_lock_.wait_for_others();
  }
}

void Architecture::throw_earlier(EarlierChange earlier, time_ns_t waited_ns) const {
  MAUVE_EXPECTS(change_lock_.is_held_here());
  if (earlier == EarlierChange::under_way) {
    throw Error(ErrorCode::timeout,
                "another change of the same is being prepared or made; nothing was changed",
                {.expected = "its end within " + std::to_string(waited_ns / ms_to_ns(1)) + " ms",
                 .remedy = "try again, or allow a longer commit timeout; where it hangs, abandon it"});
  }
  for (const auto& change : open_) {
    if (const Task* late = change->find_late())
      late->throw_state_running("the component has not taken an earlier change yet; nothing was changed",
                                waited_ns, "try again when its state has ended, or stop it by force");
  }
  throw Error(ErrorCode::timeout, "an earlier change is not completed yet; nothing was changed",
              {.remedy = "try again"});
}

void Architecture::settle_if_idle() noexcept {
  if (!has_open_.load(std::memory_order_relaxed) || !change_lock_.try_lock()) return;  // relaxed: a hint
  const LockGuard change(change_lock_, std::adopt_lock);
  std::shared_lock<SharedMutex> use;
  use_host(use);
  settle_changes();
}

Runner* Architecture::use_host(std::shared_lock<SharedMutex>& use) const {
  MAUVE_EXPECTS(change_lock_.is_held_here());
  const LockGuard lock(host_mutex_);
  // Only its end waits for that. Tried: changes share it, and a host that ends was released before. A hook may shut down
  // the host, which takes these locks the other way round.
  if (host_ != nullptr) use = host_->use();
  return host_;
}

void Architecture::drop_stale_prepared() noexcept {
  MAUVE_AUDIT(prepared_.empty() || change_lock_.is_held_here());  // none is left at the architecture's end
  for (OpenChange* prepared : prepared_) prepared->drop_if_stale();
}

Runner* Architecture::host() const {
  const LockGuard lock(host_mutex_);
  return host_;
}

void Architecture::set_host(Runner& host) {
  {
    const LockGuard lock(host_mutex_);
    if (host_ != nullptr) {
      throw Error(ErrorCode::already_running, "the architecture is deployed, or simulated, already",
                  {.expected = "an architecture without a host", .remedy = "shut its host down first"});
    }
    MAUVE_EXPECTS(change_lock_.is_held_here());
    host_ = &host;
  }
  const Lists all = lists();
  for (const auto& resource : all.resources) {
    for (ServiceBase* service : resource->services()) service->forget_floor();
  }
  // What happened when belongs to another clock.
  const CommitGate::Look table(commit_gate_);
  for (const auto& resource : all.resources) {
    for (ServiceBase* service : resource->services()) service->set_since_ns(0);
  }
  for (const auto& component : all.components) component->change_mark().set_since_ns(0);
}

void Architecture::release_host(const Runner& host) noexcept {
  const LockGuard lock(host_mutex_);
  if (host_ == &host) host_ = nullptr;
}

/// False when one still executes a state.
bool Architecture::end_threads() noexcept {
  const time_ns_t until = monotonic_now_ns() + kEndTimeout;
  bool all_ended = true;
  for (const auto& component : lists_.components) {
    all_ended &= component->task().end_thread(until);
    component->leave_architecture();
  }
  for (const Leaving& leaving : leaving_) all_ended &= leaving.component->task().end_thread(until);
  return all_ended;
}

PluginRegistry& Architecture::require_registry() const {
  if (registry_ != nullptr) return *registry_;
  throw Error(ErrorCode::invalid_argument, "the architecture has no plug-in registry",
              {.remedy = "give one to its constructor, or add parts by type"});
}

Component& Architecture::add_component(const std::string& name, std::unique_ptr<Shell> shell,
                                       std::unique_ptr<CoreBase> core, std::unique_ptr<FsmBase> fsm,
                                       const TaskSettings& settings) {
  Parts parts{.shell = std::move(shell), .core = std::move(core), .fsm = std::move(fsm)};
  commit_one(std::move(Transaction().add_component(name, std::move(parts), {.settings = settings})));
  return component(name);
}

Component& Architecture::add_component(const std::string& name, const std::string& shell,
                                       const std::string& core, const std::string& fsm,
                                       const TaskSettings& settings) {
  commit_one(std::move(
      Transaction().add_component(name, {.shell = shell, .core = core, .fsm = fsm, .settings = settings})));
  return component(name);
}

void Architecture::add_resource(const std::string& name, std::unique_ptr<Resource> resource) {
  commit_one(std::move(Transaction().add_resource(name, std::move(resource))));
}

void Architecture::connect(Component& component, const std::string& port, Resource& resource,
                           const std::string& service) {
  connect(component.name(), port, resource.name(), service);
}

void Architecture::connect(const std::string& component, const std::string& port, const std::string& resource,
                           const std::string& service) {
  commit_one(std::move(Transaction().connect(component, port, resource, service)), {.phase_ns = 0});
}

void Architecture::publish(const std::string& name) {
  const auto change = change_lock_.join_alone();
  prepare_outward(resource(name), TopicBinding::publish);
  note_restructured();
}

void Architecture::subscribe(const std::string& name) {
  const auto change = change_lock_.join_alone();
  resource(name).bind_input();
  note_restructured();
}

void Architecture::note_restructured() noexcept {
  const LockGuard structural(commit_gate_.structural);
  const CommitGate::Look table(commit_gate_);
  commit_gate_.restructured();
}

void Architecture::prepare_outward(Resource& resource, TopicBinding topic) {
  if (topic != TopicBinding::none && !resource.is_serializable()) {
    throw Error(ErrorCode::invalid_argument, "the resource cannot be bound to a topic",
                {.element = "resource " + resource.name(),
                 .expected = "one that holds messages",
                 .found = resource.kind()});
  }
  if (topic == TopicBinding::subscribe) resource.bind_input();
  if (topic == TopicBinding::publish || resource.client() != nullptr)
    resource.set_notifier(&publications_, &stops_);
}

namespace {

/// Copies from lists that the gate's mutex guards, into room that is made before: nothing is allocated under it.
template <typename MakeRoom, typename Copy>
void copy_within(CommitGate& gate, const Lists& lists, MakeRoom&& make_room, Copy&& copy) {
  for (std::size_t room = 16;; room *= 2) {
    make_room(room);
    const CommitGate::Look table(gate);
    if (std::max(lists.components.size(), lists.resources.size()) <= room) return copy();
  }
}

}  // namespace

std::vector<std::shared_ptr<Component>> Architecture::components() const {
  std::vector<std::shared_ptr<Component>> copy;
  copy_within(
      commit_gate_, lists_, [&](std::size_t room) { copy.reserve(room); },
      [&] { copy.assign(lists_.components.begin(), lists_.components.end()); });
  return copy;
}

std::vector<std::shared_ptr<Resource>> Architecture::resources() const {
  std::vector<std::shared_ptr<Resource>> copy;
  copy_within(
      commit_gate_, lists_, [&](std::size_t room) { copy.reserve(room); },
      [&] { copy.assign(lists_.resources.begin(), lists_.resources.end()); });
  return copy;
}

Lists Architecture::lists() const {
  Lists copy;
  const auto make_room = [&](std::size_t room) {
    copy.components.reserve(room);
    copy.resources.reserve(room);
  };
  copy_within(commit_gate_, lists_, make_room, [&] {
    copy.components.assign(lists_.components.begin(), lists_.components.end());
    copy.resources.assign(lists_.resources.begin(), lists_.resources.end());
  });
  return copy;
}

std::vector<Wiring> Architecture::wiring() const {
  std::vector<Wiring> copy;
  copy_within(
      commit_gate_, lists_, [&](std::size_t room) { copy.reserve(room); },
      [&] {
        for (const auto& component : lists_.components)
          copy.push_back({.component = component, .wires = component->wires()});
      });
  return copy;
}

void Architecture::swap_lists(Lists& lists) noexcept {
  MAUVE_AUDIT(commit_gate_.is_looked_at_here());
  lists_.components.swap(lists.components);
  lists_.resources.swap(lists.resources);
}

std::shared_ptr<Component> Architecture::hold_component(const std::string& name) const {
  if (auto found = find_component(name)) return found;
  throw_no_component(name, components());
}

std::shared_ptr<Resource> Architecture::hold_resource(const std::string& name) const {
  if (auto found = find_resource(name)) return found;
  throw_no_resource(name, resources());
}

std::shared_ptr<Component> Architecture::find_component(const std::string& name) const {
  const CommitGate::Look table(commit_gate_);
  return find_in(lists_.components, name);
}

std::shared_ptr<Resource> Architecture::find_resource(const std::string& name) const {
  const CommitGate::Look table(commit_gate_);
  return find_in(lists_.resources, name);
}

void Architecture::set_log_level(const std::string& name, LogLevel level) {
  const auto component = find_component(name);
  const auto resource = find_resource(name);
  if (component == nullptr && resource == nullptr) throw_no_component(name, components());
  if (component != nullptr) component->task().log_source().set_level(level);
  if (resource != nullptr) resource->log_source().set_level(level);
}

LogLevel Architecture::log_level(const std::string& name) const {
  const auto resource = find_resource(name);
  if (resource != nullptr && find_component(name) == nullptr) return resource->log_source().level();
  return hold_component(name)->task().log_source().level();
}

Component& Architecture::component(const std::string& name) const { return *hold_component(name); }
Resource& Architecture::resource(const std::string& name) const { return *hold_resource(name); }

std::unique_ptr<CoreBase> Architecture::make_core(const std::string& implementation) const {
  return require_registry().make_core(implementation);
}

bool Architecture::next_published(std::string& resource, std::vector<std::byte>& message,
                                  time_ns_t& time_ns) {
  for (const auto& published : resources()) {
    for (Resource* const side : {published.get(), published->static_side()}) {
      if (side == nullptr || !side->next_published(message, time_ns)) continue;
      resource = side->name();
      return true;
    }
  }
  return false;
}

void Architecture::require_ready_cores() const {
  for (const auto& component : components()) component->require_ready_core();
}

bool Architecture::configure_hook() {
  try {
    for (const auto& resource : resources()) resource->configure();
    for (const auto& component : components()) component->configure();
  } catch (...) {
    cleanup_hook();
    throw;
  }
  return true;
}

void Architecture::check_cleanup() const {
  for (const auto& component : components()) {
    component->check_renewed();
    check_parts_free(*component);
    if (component->task().is_parked()) continue;
    throw Error(ErrorCode::already_running, "the component still executes a state",
                {.component = component->name(),
                 .element = "state " + component->task().current_state(),
                 .expected = "a parked component",
                 .found = std::string(to_string(component->task().state())),
                 .remedy = "stop it, and wait for the state's end"});
  }
}

void Architecture::cleanup_hook() {
  const Lists all = lists();
  for (auto component = all.components.rbegin(); component != all.components.rend(); ++component)
    (*component)->cleanup();
  for (auto resource = all.resources.rbegin(); resource != all.resources.rend(); ++resource)
    (*resource)->cleanup();
}

}  // namespace mauve
