// SPDX-License-Identifier: LGPL-3.0-or-later
// The fallback core of a component: made ready with the component, and anew after changes.
#include <algorithm>

#include "mauve_rt/architecture/architecture.hpp"
#include "mauve_rt/architecture/plugin.hpp"
#include "mauve_rt/base/error.hpp"
#include "mauve_rt/base/seam/sleep.hpp"
#include "mauve_rt/run/component.hpp"

#include "base/prefault.hpp"
#include "run/preview.hpp"

namespace mauve {

namespace {

/// How often a renewal looks whether the component is claimed: no thread tells it.
constexpr time_ns_t kClaimedLook = ms_to_ns(5);

/// Another core of that name, of the generation that is in force by now; nullptr: the core is of that one.
std::unique_ptr<CoreBase> rebuilt_core(const PluginRegistry* registry, const CoreBase& core) {
  if (registry == nullptr) return nullptr;
  const int generation = registry->generation_of("core", core.implementation());
  if (generation == 0 || generation == core.generation()) return nullptr;
  return registry->make_core(core.implementation());
}

}  // namespace

void Component::set_fallback(std::unique_ptr<CoreBase> core) {
  fallback_name_ = core->implementation();
  fallback_core_ = std::move(core);
}

/// The fallback is ready with the component: at the time of a fault nothing is left to be built.
void Component::prepare_fallback() {
  if (fallback_core_ == nullptr) return;
  fallback_ =
      std::make_unique<PartsChange>(*this, Parts{.shell = {}, .core = std::move(fallback_core_), .fsm = {}});
  fallback_->be_fallback();
  spare_ = fallback_->core();
  fallback_->prepare();
  task_.set_fallback(fallback_.get());
}

void Component::check_fallback(const Shell& shell, const FsmBase& fsm) const {
  if (spare_ == nullptr) return;
  const std::unique_ptr<CoreBase> rebuilt =
      rebuilt_core(require_listed().registry(), *spare_);  // renew_fallback() puts it in
  CoreBase& core = rebuilt != nullptr ? *rebuilt : *spare_;
  if (core.accepts(shell) && fsm.bind_core(core).is_bound()) return;
  throw Error(ErrorCode::type_mismatch, "the fallback core would not suit the new parts",
              {.component = name_,
               .element = "fallback " + fallback_name_,
               .expected = "a core for " + shell.description() + " and " + fsm.description(),
               .remedy = "remove the component and add one with another fallback, in one transaction"});
}

void Component::check_renewed() const {
  if (!is_renewing()) return;
  throw Error(ErrorCode::already_running, "the fallback core is being made ready",
              {.component = name_,
               .element = "fallback " + fallback_name_,
               .expected = "the end of its configure",
               .remedy = "try again, or remove the component"});
}

bool Component::has_outdated_fallback() const {
  const PluginRegistry* registry = require_listed().registry();
  if (registry == nullptr || spare_ == nullptr) return false;
  const int generation = registry->generation_of("core", fallback_name_);
  return generation != 0 && generation != spare_->generation();
}

std::unique_ptr<CoreBase> Component::another_fallback() const {
  return spare_ != nullptr ? spare_->another() : nullptr;
}

/// One renewal: the parts that are out are cleaned up, the fallback is taken back, configured for the parts that are in force, and
/// given to the task. begin() and install() are for who has claimed the component, and run no user code. What is between them is user
/// code, and holds nothing: changes of the component go on, and where one of them has replaced shell or fsm, the fallback is configured
/// once more. Parts that are replaced meanwhile are cleaned up after the renewal: Component::lane().
class Component::FallbackRenewal {
 public:
  FallbackRenewal(Component& component, std::shared_ptr<PartsChange> out, bool is_outdated)
      : component_(component), out_(std::move(out)), is_outdated_(is_outdated) {}

  /// By who has claimed the component, or where no thread runs.
  void run_at_once() noexcept {
    run([](const auto& part) {
      part();
      return true;
    });
  }
  /// By a thread of its own; the architecture may end before it does.
  void run_beside(ArchitecturePresence& presence) noexcept {
    run([&](const auto& part) { return run_claimed(presence, part); });
    if (std::exchange(is_begun_, false)) component_.is_renewing_.store(false, std::memory_order_release);
  }

 private:
  /// What the fallback is configured for.
  struct World {
    const Shell* shell{nullptr};
    const FsmBase* fsm{nullptr};
    std::vector<ShownProperty> properties{};
    std::shared_ptr<const Wires> wires{};  // keeps the resources in use
    const PluginRegistry* registry{nullptr};
  };

  template <typename Within>
  void run(Within&& within) noexcept {
    clean_up();
    if (!within([this] { begin(); })) return;
    while (is_begun_) {
      prepare();
      if (!within([this] { install(); })) return;
    }
  }
  template <typename Part>
  bool run_claimed(ArchitecturePresence& presence, const Part& part) {
    for (;; sleep_for(kClaimedLook)) {
      const std::shared_lock use(presence.mutex);
      if (presence.architecture == nullptr) return false;
      const LockGuard change(presence.architecture->change_lock());
      CommitGate& gate = presence.architecture->commit_gate();
      ChangeMark& mark = component_.change_mark_;
      {
        const CommitGate::Look table(gate);
        if (mark.is_claimed() || gate.has_open_about(component_.task_)) continue;
        mark.claim();
        mark.hold();
      }
      part();
      const CommitGate::Look table(gate);
      mark.release();
      return true;
    }
  }

  void clean_up() {
    if (out_ == nullptr) return;
    out_->retire();
    CoreBase* const core = out_->core();
    if (core != nullptr && core->implementation() == component_.fallback_name_)
      spare_ = out_->give_back_core();
    out_.reset();
  }
  void begin() {
    Architecture* const architecture = component_.architecture_.load(std::memory_order_acquire);
    if (architecture == nullptr) return;
    if (!component_.is_configured()) {  // its configure makes it ready
      if (spare_ != nullptr && component_.fallback_core_ == nullptr)
        component_.fallback_core_ = std::move(spare_);
      return;
    }
    if (!is_outdated_ && spare_ == nullptr && !component_.has_outdated_fallback()) return;
    component_.task_.retract_fallback();
    before_ = std::move(component_.fallback_);
    component_.spare_ = nullptr;
    if (before_ != nullptr && !before_->was_taken()) {
      surplus_ = std::move(spare_);
      spare_ = before_->give_back_core();
    }
    if (spare_ == nullptr) return;  // it is in force
    is_begun_ = true;
    component_.is_renewing_.store(true, std::memory_order_release);
    note(*architecture);
  }
  void note(Architecture& architecture) {
    component_.spare_ = spare_.get();
    world_ = {.shell = &component_.shell(),
              .fsm = &component_.fsm(),
              .properties = component_.shown().properties,
              .wires = {},
              .registry = architecture.registry()};
    const CommitGate::Look table(architecture.commit_gate());
    world_.wires = component_.wires_;
  }
  void prepare() {
    is_ready_ = false;
    try {
      spare_->cleanup();
      if (auto rebuilt = rebuilt_core(world_.registry, *spare_)) {
        surplus_ = std::exchange(spare_, std::move(rebuilt));  // Component::spare_ until install()
      }
      make_change();
      Preview preview;
      preview.set(*world_.shell, world_.properties);
      preview.wire(*world_.shell, *world_.wires);
      fresh_->prepare();
      if (component_.task_.has_thread()) prefault_allocated();
      is_ready_ = true;
    } catch (...) {  // it cannot be configured anew; the change itself is in
      make_change();
    }
  }
  void make_change() {
    if (fresh_ != nullptr) return;
    fresh_ =
        std::make_unique<PartsChange>(component_, Parts{.shell = {}, .core = std::move(spare_), .fsm = {}});
    fresh_->be_fallback();
  }
  void install() {
    Architecture* const architecture = component_.architecture_.load(std::memory_order_acquire);
    const bool is_present = &component_.shell() == world_.shell && &component_.fsm() == world_.fsm &&
                            &fresh_->fsm() == world_.fsm;
    if (architecture != nullptr && !is_present) {
      spare_ = fresh_->give_back_core();
      fresh_.reset();
      return note(*architecture);
    }
    is_begun_ = false;
    component_.spare_ = architecture != nullptr ? fresh_->core() : nullptr;
    if (architecture != nullptr) {  // else the component was removed
      component_.fallback_ = std::move(fresh_);
      if (is_ready_) component_.task_.set_fallback(component_.fallback_.get());
    }
    component_.is_renewing_.store(false, std::memory_order_release);
  }

  Component& component_;
  std::shared_ptr<PartsChange> out_;
  const bool is_outdated_;
  World world_;
  std::unique_ptr<CoreBase> spare_;      // cleaned up and configured next
  std::unique_ptr<CoreBase> surplus_;    // ends with this
  std::unique_ptr<PartsChange> before_;  // as the fallback was: ends with this
  std::unique_ptr<PartsChange> fresh_;   // as the fallback will be
  bool is_begun_{false};
  bool is_ready_{false};
};

void Component::renew_fallback(std::shared_ptr<PartsChange> out, bool is_outdated) noexcept {
  Architecture* const architecture = architecture_.load(std::memory_order_acquire);
  std::shared_ptr<Component> self = self_.lock();
  auto renewal = std::make_shared<FallbackRenewal>(*this, std::move(out), is_outdated);
  if (architecture == nullptr || self == nullptr || !architecture->disposes_beside(lane()))
    return renewal->run_at_once();
  const auto presence = architecture->presence();
  presence->renewals.fetch_add(1, std::memory_order_acq_rel);
  architecture->dispose_beside(
      "cleanup of parts, and renewal of the fallback core, of " + description(),
      [self = std::move(self), renewal = std::move(renewal), presence]() mutable {
        renewal->run_beside(*presence);
        renewal.reset();  // what is left over goes here
        presence->renewals.fetch_sub(1, std::memory_order_acq_rel);
      },
      lane());
}

void Component::dispose(std::shared_ptr<PartsChange> parts, bool is_outdated, bool at_once) noexcept {
  if (!fallback_name_.empty() && at_once)
    return FallbackRenewal(*this, std::move(parts), is_outdated).run_at_once();
  if (!fallback_name_.empty()) return renew_fallback(std::move(parts), is_outdated);
  Architecture* const architecture = architecture_.load(std::memory_order_acquire);
  if (at_once || architecture == nullptr) return parts->retire();
  architecture->dispose(
      "cleanup of parts of " + description(),
      [own = self_.lock(), parts = std::move(parts)]() mutable { parts.reset(); }, this);
}

}  // namespace mauve
