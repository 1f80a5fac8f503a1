// SPDX-License-Identifier: LGPL-3.0-or-later
// From the draft to the report; what is prepared stands in prepare.cpp, how other changes come in in work_order.cpp.
#include "change/work.hpp"

#include <algorithm>
#include <cmath>

#include "mauve_rt/architecture/runner.hpp"
#include "mauve_rt/base/contract.hpp"
#include "mauve_rt/base/seam/sleep.hpp"

#include "base/number_text.hpp"

namespace mauve {

TransactionCommit::TransactionCommit(Architecture& architecture, Runner* host,
                                     const TransactionOptions& options)
    : work_(std::make_shared<Work>(architecture, host, options)) {}
TransactionCommit::~TransactionCommit() = default;
void TransactionCommit::make(Transaction transaction) { work_->make(std::move(transaction)); }
TransactionReport TransactionCommit::report(time_ns_t phase_timeout_ns) {
  return work_->report(phase_timeout_ns);
}

TransactionCommit::Work::Work(Architecture& architecture, Runner* host, const TransactionOptions& options)
    : architecture_(architecture),
      host_(host),
      deployed_(host != nullptr && host->is_deployed()),
      is_simulated_(host != nullptr && host->is_simulated()),
      options_(options),
      begun_ns_(host != nullptr ? host->clock().now_ns() : monotonic_now_ns()) {}

/// A change is made or called off once, and settled after that; one that was never committed is settled at once.
void TransactionCommit::Work::advance(Phase to) {
  const Phase from = phase_.load(std::memory_order_relaxed);  // relaxed: one thread at a time has the work
  MAUVE_EXPECTS(from == Phase::being_made || to == Phase::settled ||
                (from == Phase::off && to == Phase::off));
  phase_.store(to, std::memory_order_release);
}

void TransactionCommit::Work::begin(Transaction transaction) {
  MAUVE_EXPECTS(architecture_.change_lock().is_held_here());
  MAUVE_EXPECTS(draft_ == nullptr && commit_ == nullptr);  // a work makes one change
  transaction_ = std::move(transaction);
  for (const auto& step : transaction_.steps())
    step_texts_.push_back(step->text() + (options_.dry_run ? " (dry run)" : ""));
  const time_ns_t patience_ns = is_simulated_ ? 0 : options_.timeouts.commit_ns;
  architecture_.wait_for_earlier(patience_ns, [this] { return look_at_earlier(); });
  claim_whole();
  try {
    begin_alone();
  } catch (...) {
    release_whole();
    throw;
  }
}

void TransactionCommit::Work::begin_alone() {
  if (const std::uint64_t revision = architecture_.revision();
      options_.expected_revision != 0 && options_.expected_revision != revision) {
    throw Error(ErrorCode::wrong_revision, "the architecture has changed since",
                {.element = "revision",
                 .expected = std::to_string(options_.expected_revision),
                 .found = std::to_string(revision),
                 .remedy = "read it again, then ask again"});
  }
  {
    const CommitGate::Look table(architecture_.commit_gate());
    structure_ = architecture_.commit_gate().structure();
  }
  architecture_.reap();
  architecture_.settle_probations();
  numbers_before_ = architecture_.numbers();
}

void TransactionCommit::Work::make(Transaction transaction) {
  const time_ns_t began = monotonic_now_ns();
  begin(std::move(transaction));
  architecture_.keep_open(shared_from_this());
  try {
    draft_steps();
    const auto pause = let_others_in();
    pause != nullptr ? prepare_beside_others() : prepare();
    prepare_ns_ = monotonic_now_ns() - began;
    if (!options_.dry_run) {
      require_host_open();
      commit_by_force_if_asked();
    }
  } catch (...) {
    rethrow_not_made();
  }
  if (options_.dry_run) {
    advance(Phase::off);
    return discard();
  }
  if (settle()) architecture_.forget_open(*this);
  release_whole();
  if (failure_) std::rethrow_exception(failure_);
}

/// In a handler. A hook that was left behind ends the change itself, once it has returned.
void TransactionCommit::Work::rethrow_not_made() {
  if (preparation_.is_left) throw;
  advance(Phase::off);
  discard();
  if (is_called_off_.load(std::memory_order_relaxed)) throw_called_off();
  throw;
}

/// What would be done before the commit cannot wait for it.
void TransactionCommit::Work::require_preparable() const {
  const auto refuse = [this](int step, const char* what) {
    throw Error(ErrorCode::invalid_argument, what,
                {.expected = "steps that do nothing before the commit",
                 .remedy = "make this step in a transaction of its own",
                 .step = step,
                 .step_name = text_of(step)});
  };
  if (draft_->resynchronise_step() != 0)
    refuse(draft_->resynchronise_step(), "a new epoch cannot be prepared");
  for (const DraftComponent& component : draft_->components()) {
    if (component.configure_step != 0) refuse(component.configure_step, "to configure cannot be prepared");
    if (component.promoted != nullptr)
      refuse(component.core_step, "a promote cannot be prepared: the candidate would stand still");
    if (component.bumpless) refuse(component.core_step, "a bumpless change cannot be prepared");
  }
}

TransactionCommit::Work::Basis TransactionCommit::Work::prepare_for_later(Transaction transaction) {
  const time_ns_t began = monotonic_now_ns();
  if (options_.force) {
    throw Error(ErrorCode::invalid_argument, "a prepared transaction stops nothing by force",
                {.element = "force", .remedy = "commit it unprepared, or stop the component by force first"});
  }
  if (options_.idle) {
    throw Error(ErrorCode::invalid_argument, "a prepared transaction waits for no idle instant",
                {.element = "idle", .remedy = "commit it unprepared, or leave `idle` out"});
  }
  if (options_.dry_run || !deployed_) {
    throw Error(ErrorCode::not_configured, "a transaction is prepared for an architecture that is deployed",
                {.remedy = "deploy it first; for a dry run ask for a commit"});
  }
  begin(std::move(transaction));
  is_prepared_ = true;
  architecture_.keep_open(shared_from_this());
  Basis basis;
  if (const PluginRegistry* registry = architecture_.registry()) basis.code = registry->version();
  try {
    draft_steps();
    require_preparable();
    {
      const auto pause = let_others_in();
      pause != nullptr ? prepare_beside_others() : prepare();
    }
    gather();
    require_host_open();
    basis.is_structural = is_structural_;
    basis.is_run_only = is_run_only_;
    basis.structure = structure_;
    for (const auto& component : draft_->claimed())
      basis.touched.push_back({.component = component, .changes = 0, .state = {}});
    const auto found = [&](std::list<DraftComponent>& components) {
      for (const DraftComponent& component : components) {
        for (Basis::Touched& touched : basis.touched) {
          if (touched.component != component.component) continue;
          touched.state = component.state;
          touched.changes = component.changes;
        }
      }
    };
    found(draft_->components());
    found(draft_->removed_components());
    if (is_run_only_) forget_wires();
    draft_->release();
    release_whole();
  } catch (...) {
    rethrow_not_made();
  }
  is_armed_.store(true, std::memory_order_release);
  prepare_ns_ = monotonic_now_ns() - began;
  return basis;
}

/// Other changes do not make it stale: it is to keep no resource in use that they remove.
void TransactionCommit::Work::forget_wires() {
  for (DraftComponent& component : draft_->components()) {
    component.wires.clear();
    component.wires_before.clear();
  }
}

Commit::Outcome TransactionCommit::Work::commit_prepared(time_ns_t until_ns) noexcept {
  begun_ns_.store(host_->clock().now_ns(), std::memory_order_relaxed);  // relaxed: is_armed_ publishes it
  is_armed_.store(false, std::memory_order_release);
  Commit::Outcome outcome = commit_->decide(until_ns, architecture_.commit_gate());
  committed_ = outcome == Commit::Outcome::made;
  if (!committed_) advance(Phase::off);
  const bool is_changed = outcome == Commit::Outcome::refused && commit_->refused_by() == &guard_;
  return is_changed ? Commit::Outcome::changed : outcome;
}

/// A shutdown waits for nobody's preparation: what was prepared for a running architecture is of no use any more.
void TransactionCommit::Work::require_host_open() const {
  if (!deployed_ || host_->is_deployed()) return;
  throw Error(ErrorCode::not_configured, "the architecture was shut down before the change was made",
              {.remedy = "deploy it, then ask again"});
}

/// Either a shutdown sees the threads of what was added, and gets those of what was changed, or they end here.
void TransactionCommit::Work::settle_with_host() {
  if (!deployed_ || host_->is_deployed()) return;
  const time_ns_t until_ns = monotonic_now_ns() + Runner::kThreadEnd;  // of all, however many hang
  for (DraftComponent* added : prepared_added_) host_->detach(*added->component, until_ns);
  for (const Change& change : changes_) {
    if (!change.draft->only_epoch) host_->detach(*change.draft->component, until_ns);
  }
}

void TransactionCommit::Work::draft_steps() {
  draft_ = std::make_unique<Draft>(architecture_, deployed_);
  reports_.resize(transaction_.steps().size());
  int number = 0;
  for (const auto& step : transaction_.steps()) {
    draft_->begin(++number);
    StepReport& report = reports_[static_cast<std::size_t>(number - 1)];
    report.step = step->text();
    report.component = step->component();
    at_step(number, [&] { step->draft(*draft_); });
    const DraftComponent* component = draft_->find(report.component);
    if (component == nullptr || component->core_step != number) continue;
    if (!component->is_added) report.from_core = component->component->core_implementation();
    report.to_core = component->promoted != nullptr ? component->promoted->core_name()
                                                    : component->fresh.core->implementation();
  }
  try {
    draft_->finish();
  } catch (const Error& failure) {
    rethrow_at(failure.detail().step, failure);
  }
  for (const DraftComponent& component : draft_->components()) {
    if (!options_.idle || !component.bumpless) continue;
    throw Error(ErrorCode::invalid_argument,
                "a bumpless change waits for near outputs, not for an idle instant",
                {.component = component.name(),
                 .element = "idle",
                 .remedy = "leave out `idle` or `bumpless`",
                 .step = component.core_step,
                 .step_name = text_of(component.core_step)});
  }
}

Afterwards TransactionCommit::Work::afterwards_of(const Change& change) const {
  const DraftComponent& draft = *change.draft;
  if (change.retreat != nullptr || (draft.ran && !draft.runs)) return Afterwards::stop;
  if (!draft.runs) return Afterwards::go_on;
  const bool anew = draft.restarts || (change.parts != nullptr && change.parts->restarts());
  return !draft.ran || anew ? Afterwards::restart : Afterwards::go_on;
}

void TransactionCommit::Work::gather() {
  // Wiring and properties are in before a new core takes over. adopt(), which may refuse, changes nothing.
  guard_.clear();
  places_.clear();
  std::vector<CommitAction*> actions{&guard_};
  for (const auto& action : actions_) actions.push_back(action.get());
  for (const Change& change : changes_) {
    if (change.parts != nullptr) actions.push_back(change.parts.get());
  }
  for (const auto& repair : repairs_) actions.push_back(repair.get());
  std::vector<std::shared_ptr<Component>> touched;  // first: outlives the commit
  const auto silent = options_.idle ? find_silent() : std::vector<std::shared_ptr<Component>>{};
  auto commit = std::make_unique<Commit>(changes_.size() + silent.size(), std::move(actions));
  if (options_.idle) commit->set_idle(options_.idle_within_ns);
  auto place = commit->participants().begin();
  for (Change& change : changes_) {
    change.place = &*place;
    place->task = &change.draft->component->task();
    place->afterwards = afterwards_of(change);
    place->replaces_parts = change.parts != nullptr;
    if (change.parts != nullptr && change.draft->restarts) change.parts->give_up_place();
    if (change.parts != nullptr && change.parts->candidate() != nullptr) {
      commit->set_last(*place, change.draft->bumpless.value_or(BumplessOptions{}).within_ns,
                       [host = host_](time_ns_t until_ns) { return host->pass_time(until_ns); });
      swapped_ = {.candidate = change.parts->candidate(), .step = change.draft->core_step};
    }
    place->repairs = change.draft->is_repaired();
    place->only_epoch = change.draft->only_epoch;
    if (draft_->resynchronise_step() != 0) place->epoch_lead_ns = kDeploymentLead;
    if (place->afterwards == Afterwards::restart) place->start_clock_ns = change.draft->clock_ns;
    if (change.retreat != nullptr) change.retreat->set_place(*place);
    if (!place->only_epoch) guard_.expect(*place, change.draft->state);
    places_.insert_or_assign(change.draft->name(), &*place);
    ++place;
  }
  touched.reserve(changes_.size() + silent.size());
  for (const Change& change : changes_) touched.push_back(change.draft->component);
  for (const auto& component : silent) {
    place->task = &component->task();
    place->is_silent = true;
    touched.push_back(component);
    ++place;
  }
  commit->assign_actions();
  prepare_publication();
  commit->set_publication(*this);
  if (is_structural_) commit->set_structural();
  if (deployed_) commit->set_hosted();
  const LockGuard lock(facts_mutex_);
  commit_.swap(commit);
  touched_.swap(touched);
}

/// Of an idle change on several CPUs: the components that take no part, and stand at or above the priority of a participant that runs, on a
/// CPU that both may run on. On one CPU there are none: the lowest participant closes.
std::vector<std::shared_ptr<Component>> TransactionCommit::Work::find_silent() const {
  std::vector<const TaskSettings*> running;
  for (const Change& change : changes_) {
    const Task& task = change.draft->component->task();
    if (!task.is_parked()) running.push_back(&task.settings());
  }
  const auto is_pinned_with_first = [&running](const TaskSettings* each) {
    return each->cpus.size() == 1 && each->cpus == running.front()->cpus;
  };
  if (std::all_of(running.begin(), running.end(), is_pinned_with_first)) return {};
  const auto may_delay = [](const TaskSettings& upper, const TaskSettings& lower) {
    const bool share_cpu = upper.cpus.empty() || lower.cpus.empty() ||
                           std::find_first_of(upper.cpus.begin(), upper.cpus.end(), lower.cpus.begin(),
                                              lower.cpus.end()) != upper.cpus.end();
    return share_cpu && upper.priority >= lower.priority;
  };
  std::vector<std::shared_ptr<Component>> silent;
  for (const auto& component : architecture_.components()) {
    const Task& task = component->task();
    // One that is FAULTED or STOPPING would call the change off; it starts nothing that a change does not start.
    const bool may_run = task.state() == ComponentState::running || task.is_parked();
    const bool takes_part = std::any_of(changes_.begin(), changes_.end(), [&](const Change& change) {
      return change.draft->component == component;
    });
    if (!may_run || takes_part || task.state() == ComponentState::faulted) continue;
    if (std::any_of(running.begin(), running.end(),
                    [&](const TaskSettings* each) { return may_delay(task.settings(), *each); }))
      silent.push_back(component);
  }
  return silent;
}

void TransactionCommit::Work::commit_by_force_if_asked() {
  gather();
  try {
    return carry_out_commit();
  } catch (const Error& failure) {
    const bool is_left = commit_->is_left();  // else a thread may come back to the record
    if (!options_.force || failure.code() != ErrorCode::timeout || !is_left || !force_hung()) throw;
  }
  gather();
  carry_out_commit();
}

/// Stops by force those whose state lasted through half of the commit's timeout at least; whether there was one.
bool TransactionCommit::Work::force_hung() {
  bool has_forced = false;
  for (auto change = changes_.begin(); change != changes_.end();) {
    const Task& task = change->draft->component->task();
    const StateAge age = task.state_age();
    const bool is_hung =
        !age.is_wait && age.age_ns >= options_.timeouts.commit_ns / 2 && !task.is_left_behind();
    const bool gives_way = change->parts != nullptr || afterwards_of(*change) == Afterwards::stop;
    if (!is_hung || !gives_way) {
      ++change;
      continue;
    }
    has_forced = true;
    const bool is_done = stop_by_force(*change) && change->retreat == nullptr;
    change = is_done ? changes_.erase(change) : std::next(change);
  }
  return has_forced;
}

/// False when its state has ended this moment, and it is stopped. Throws where more is to be done with it than to stop it.
bool TransactionCommit::Work::stop_by_force(const Change& change) {
  constexpr time_ns_t kOneThatEndsNow = ms_to_ns(100);
  DraftComponent& draft = *change.draft;
  Task& task = draft.component->task();
  try {
    const bool is_forced = task.stop(kOneThatEndsNow, true);
    draft.state = task.state();
    draft.ran = false;
    const bool is_only_stopped = std::none_of(actions_.begin(), actions_.end(),
                                              [&](const auto& action) { return action->task == &task; });
    if (!is_forced || change.retreat != nullptr || (change.parts == nullptr && is_only_stopped))
      return is_forced;
  } catch (const Error& failure) {
    rethrow_at(draft.first_step, failure);
  }
  throw Error(ErrorCode::faulted, "the component is FAULTED: " + task.fault().what,
              {.component = draft.name(),
               .remedy = Task::kLeftBehindRemedy,
               .step = draft.first_step,
               .step_name = text_of(draft.first_step)});
}

void TransactionCommit::Work::carry_out_commit() {
  CommitGate& gate = architecture_.commit_gate();
  const time_ns_t until_ns = later_by(monotonic_now_ns(), options_.timeouts.commit_ns);
  commit_->set_yields();
  Commit::Outcome outcome{};
  {
    std::unique_lock structural(gate.structural, std::defer_lock);
    if (is_structural_) structural.lock();
    outcome = commit_->decide(until_ns, gate);
  }
  committed_ = outcome == Commit::Outcome::made;
  if (outcome == Commit::Outcome::stale) {
    throw Error(ErrorCode::wrong_revision,
                is_structural_
                    ? "a prepared change added, removed or connected something first; nothing was changed"
                    : "a prepared change came before this one; nothing was changed",
                {.remedy = "read the architecture, then ask again"});
  }
  if (!committed_) throw_not_made();
  note_made();
  set_epoch();
  commit_->await_passes(until_ns);
}

void TransactionCommit::Work::throw_not_made() {
  const bool is_adopts_own = commit_->refused_by() != nullptr && !commit_->has_given_up();
  for (const Change& change : changes_) {
    if (change.parts != nullptr && change.parts->candidate() != nullptr) throw_if_not_near(change);
  }
  try {
    commit_->rethrow_refusal();
  } catch (const Error& failure) {
    require_host_open();  // else the commit was called off by a shutdown
    if (!is_adopts_own) rethrow_at(step_of(failure.detail().component), failure);
    throw_refused(failure.what());
  } catch (...) {
    throw_refused(caught_text());
  }
  throw_refused("the adopt of the new core returned false");
}

/// Of a bumpless change that was not made for that.
void TransactionCommit::Work::throw_if_not_near(const Change& change) const {
  const bool is_over = commit_->off() == Commit::Off::not_ready;
  const ShadowRecord record = change.parts->candidate()->record();
  const bool has_ended = commit_->refused_by() == change.parts.get() && record.end_ns != 0;
  if (!is_over && !has_ended) return;
  const BumplessOptions bumpless = change.draft->bumpless.value_or(BumplessOptions{});
  ErrorDetail detail{.component = change.draft->name(),
                     .element = "bumpless",
                     .expected = {},
                     .found = has_ended ? record.reason : std::string{},
                     .remedy = has_ended
                                   ? "correct the candidate; nothing was changed"
                                   : "allow a greater step or more time (within_s), or hand over more state",
                     .step = change.draft->core_step,
                     .step_name = text_of(change.draft->core_step)};
  for (const OutputStep& output : record.steps) {
    const std::string separator = detail.expected.empty() ? "" : ", ";
    detail.expected += separator + output.output + " within " + number_text(output.greatest);
    if (has_ended) continue;
    detail.found += (detail.found.empty() ? "" : ", ") +
                    (std::isnan(output.least)
                         ? output.output + " not written by both cores"
                         : output.output + " at least " + number_text(output.least) + " apart, at instant " +
                               std::to_string(output.least_instant_ns) + " ns");
  }
  if (has_ended)
    throw Error(ErrorCode::adopt_refused,
                "the candidate ended before its outputs were near those of the core", detail);
  detail.found += "; " + std::to_string(record.compared) + " of " + std::to_string(record.releases) +
                  " releases compared";
  throw Error(ErrorCode::timeout,
              "the outputs of the candidate did not come near those of the core within " +
                  std::to_string(bumpless.within_ns / ms_to_ns(1)) + " ms; nothing was changed",
              detail);
}

void TransactionCommit::Work::throw_refused(const std::string& what) const {
  if (commit_->refused_by() == &guard_ && guard_.changed() != nullptr) {
    throw Error(ErrorCode::wrong_revision,
                "the component was started or stopped, or it faulted, before the change was made",
                {.component = guard_.changed()->name(),
                 .element = "state",
                 .found = std::string(to_string(guard_.changed()->state())),
                 .remedy = "read the architecture, then ask again",
                 .step = step_of(guard_.changed()->name()),
                 .step_name = text_of(step_of(guard_.changed()->name()))});
  }
  for (const Change& change : changes_) {
    if (change.parts.get() != commit_->refused_by()) continue;
    const DraftComponent& draft = *change.draft;
    const int step = draft.core_step != 0 ? draft.core_step : draft.first_step;
    const Handover* handover = change.parts->handover();
    const bool is_between_builds = handover != nullptr && handover->is_between_builds();
    throw Error(
        ErrorCode::adopt_refused, "adopt refused: " + what,
        {.component = draft.name(),
         .expected = is_between_builds ? "an adopt that accepts a core of another build" : "",
         .found = is_between_builds ? "false, or an exception" : "",
         .remedy = is_between_builds
                       ? "nothing was changed; to adopt, a core of another build has no known C++ type, and "
                         "dynamic_cast of it gives nullptr: name the state in MAUVE_STATE, which is copied "
                         "between builds, and accept such a core in adopt"
                       : "nothing was changed; an adopt that throws an exception gives its reason here",
         .step = step,
         .step_name = text_of(step)});
  }
  throw Error(ErrorCode::adopt_refused, what);
}

/// A component that is late to another change keeps its grid until its next start.
void TransactionCommit::Work::set_epoch() {
  if (!resynchronises_) return;
  const time_ns_t epoch_ns = later_by(commit_->instant_ns() - 1, kDeploymentLead);
  architecture_.set_deployment_epoch(epoch_ns);
  for (const auto& component : architecture_.components()) {
    if (!places_.contains(component->name())) component->task().join_when_it_starts(epoch_ns);
  }
}

/// The fallback stays ready as long as shell and fsm are the ones it was made ready for, unless it has just been replaced
/// or a structural property was set that it may have read, or its code was loaded anew.
void TransactionCommit::Work::renew_fallback(Change& change) {
  Component& component = *change.draft->component;
  const bool is_outdated = change.parts->restarts() || change.draft->sets_structural();
  // The core that is out may be the next spare. A core that is on probation may need the old one yet.
  std::shared_ptr<PartsChange> out;
  if (!change.parts->has_probation()) out = std::move(change.parts);
  component.renew_fallback(std::move(out), is_outdated);
}

/// A shadow that begins has the properties that the same change sets.
void TransactionCommit::Work::settle_shadow(const DraftComponent& changed) {
  Component& component = *changed.component;
  // The take may have ended it. The curves of a candidate that went in go on.
  if (const auto before = component.last_shadow(); before == nullptr || !before->measures_outputs())
    component.settle_shadow();
  if (changed.shadow != nullptr) component.keep_shadow(changed.shadow);
  const auto shadow = component.last_shadow();
  if (shadow == nullptr) return;
  for (const auto& [name, property] : changed.properties) shadow->set_property(name, property.value);
}

/// Whoever waits for the report keeps nothing that others may take away meanwhile.
void TransactionCommit::Work::keep_for_report() {
  changes_.clear();
  actions_.clear();
  repairs_.clear();
  prepared_added_.clear();
  prepared_resources_.clear();
  lists_ = {};
  wires_.clear();
  frames_.clear();
  added_.clear();
  elements_.clear();
  services_.clear();
  draft_.reset();
}

TransactionReport TransactionCommit::Work::report(time_ns_t phase_timeout_ns) {
  // In virtual time the releases that follow come only when this call has returned.
  const time_ns_t until =
      later_by(monotonic_now_ns(), is_simulated_ ? 0 : std::max<time_ns_t>(0, phase_timeout_ns));
  if (committed_ && commit_->wait_passed(until)) architecture_.settle_if_idle();
  std::map<std::string, StepReport> measured;
  for (const auto& [name, place] : places_) {
    if (committed_) measured[name] = report_of(*place, std::max<time_ns_t>(0, until - monotonic_now_ns()));
  }
  if (swapped_.candidate != nullptr) {
    const std::vector<OutputStep> outputs = measured_steps(until);
    const LockGuard lock(reports_mutex_);
    reports_[static_cast<std::size_t>(swapped_.step - 1)].outputs = outputs;
  }
  const LockGuard lock(reports_mutex_);
  TransactionReport report{.steps = reports_,
                           .revision = architecture_.revision(),
                           .prepare_ns = is_simulated_ ? 0 : prepare_ns_,
                           .blackout_ns = 0,
                           .is_idle = committed_ && options_.idle};
  for (const auto& [name, place] : places_) {
    const bool is_open = !place->has_passed() || (!is_simulated_ && place->awaits_release());
    if (committed_ && is_open) report.is_complete = false;
    if (committed_ && place->in_flight) report.instant_ns = commit_->instant_ns();
  }
  const auto& steps = transaction_.steps();
  const auto for_all =
      std::find_if(steps.begin(), steps.end(), [](const auto& step) { return step->is_for_all(); });
  if (committed_ && for_all != steps.end()) {  // a line each, after those of the steps
    for (const auto& component : touched_) {
      if (!places_.contains(component->name())) continue;  // it took part silently
      StepReport& line = report.steps.emplace_back();
      line.step = (*for_all)->text();
      line.component = component->name();
    }
  }
  for (StepReport& step : report.steps) {
    if (is_simulated_) step.prepare_ns = 0;
    const auto found = measured.find(step.component);
    if (found == measured.end()) continue;
    step.blackout_ns = found->second.blackout_ns;
    step.missed_releases = found->second.missed_releases;
    step.phase_nominal_ns = found->second.phase_nominal_ns;
    step.phase_actual_ns = found->second.phase_actual_ns;
    step.released_ns = found->second.released_ns;
    step.instant_ns = found->second.instant_ns;
    step.release_ns = found->second.release_ns;
    step.remark = found->second.remark;
    const Participant& place = *places_.at(step.component);
    step.shift_ns = place.has_passed() ? place.shift_ns : 0;
    report.blackout_ns = std::max(report.blackout_ns, step.blackout_ns);
  }
  return report;
}

/// Of a bumpless change that is made: once the new core has written each listed output, or as far as it has by the instant.
std::vector<OutputStep> TransactionCommit::Work::measured_steps(time_ns_t until_ns) const {
  constexpr time_ns_t kMeasuredLook = us_to_ns(500);
  while (swapped_.candidate->awaits_outputs() && monotonic_now_ns() < until_ns) sleep_for(kMeasuredLook);
  return swapped_.candidate->record().steps;
}

const std::string& TransactionCommit::Work::text_of(int step) const {
  return reports_[static_cast<std::size_t>(std::max(step, 1) - 1)].step;
}

int TransactionCommit::Work::step_of(const std::string& component) const {
  for (const Change& change : changes_) {
    if (change.draft->name() == component) return change.draft->first_step;
  }
  return 0;
}

void TransactionCommit::Work::rethrow_at(int step, const Error& failure) const {
  ErrorDetail detail = failure.detail();
  if (detail.step == 0) detail.step = step;
  if (detail.step != 0) detail.step_name = text_of(detail.step);
  throw Error(failure.code(), failure.statement(), detail);
}

}  // namespace mauve
