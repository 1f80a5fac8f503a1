// SPDX-License-Identifier: LGPL-3.0-or-later
// What a transaction does in its commit beside putting in parts and property values.
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "mauve_rt/architecture/architecture.hpp"
#include "mauve_rt/run/probation.hpp"
#include "mauve_rt/run/shadow.hpp"

namespace mauve {

/// Refuses the commit when a component is no longer as the draft found it. A check: it has no task.
class StateGuard final : public CommitAction {
 public:
  /// A participant and the state it was found in. [non-rt], before the commit.
  void expect(const Participant& place, ComponentState found) { found_.push_back({&place, found}); }
  /// Expects nothing any more. [non-rt], before the commit.
  void clear() noexcept { found_.clear(); }

  bool adopt() override {
    for (const Found& found : found_) {
      const bool ran = found.state == ComponentState::running;
      if (found.place->in_flight == ran && (ran || found.place->task->state() == found.state)) continue;
      changed_ = found.place->task;
      return false;
    }
    return true;
  }
  void take() noexcept override {}
  /// The one that changed. [non-rt], after a refusal.
  const Task* changed() const noexcept { return changed_; }

 private:
  struct Found {
    const Participant* place;
    ComponentState state;
  };
  std::vector<Found> found_;
  const Task* changed_{nullptr};
};

/// Gains a writer's end: what a component that had it before writes to it, late, is dropped.
class FloorChange final : public CommitAction {
 public:
  explicit FloorChange(ServiceBase& service) : service_(service) {}
  void take() noexcept override { service_.raise_floor(instant_ns); }

 private:
  ServiceBase& service_;
};

/// Puts the old core of a probation back: of a running component in its next step, within the same wait.
class RevertRequest final : public CommitAction {
 public:
  RevertRequest(Task& its_task, std::shared_ptr<Probation> probation)
      : task_(its_task), probation_(std::move(probation)), trace_id_(TraceNames::intern("revert_core")) {
    task = &its_task;
    probation_->name_request("a step revert_core");
  }
  void take() noexcept override { task_.revert_here(*probation_); }
  std::uint32_t trace_id() const noexcept override { return trace_id_; }

 private:
  Task& task_;
  std::shared_ptr<Probation> probation_;
  std::uint32_t trace_id_;
};

/// Captures the component's releases for a shadow from then on.
class ShadowBegin final : public CommitAction {
 public:
  ShadowBegin(Task& its_task, std::shared_ptr<Shadow> shadow)
      : task_(its_task),
        shadow_(std::move(shadow)),
        trace_id_(TraceNames::intern("shadow " + shadow_->core_name())) {}
  void take() noexcept override { task_.set_shadow(*shadow_); }
  std::uint32_t trace_id() const noexcept override { return trace_id_; }

 private:
  Task& task_;
  std::shared_ptr<Shadow> shadow_;
  std::uint32_t trace_id_;
};

/// Ends the component's shadow, if there is one.
class ShadowEnd final : public CommitAction {
 public:
  ShadowEnd(Task& its_task, ShadowCause why)
      : task_(its_task), why_(why), trace_id_(TraceNames::intern("end_shadow")) {}
  void take() noexcept override { task_.end_shadow(why_); }
  std::uint32_t trace_id() const noexcept override { return trace_id_; }

 private:
  Task& task_;
  ShadowCause why_;
  std::uint32_t trace_id_;
};

/// Exchanges a port's connection for one made ready.
class WiringChange final : public CommitAction {
 public:
  WiringChange(PortBase& port, PortConnection connection)
      : port_(port),
        gains_(port.kind() == PortKind::write ? connection.service : nullptr),
        connection_(std::move(connection)),
        trace_id_(TraceNames::intern("wire " + port.name())) {}
  void take() noexcept override { port_.swap(connection_); }
  bool make_safe(bool may_wait, time_ns_t time_ns) noexcept override {
    if (gains_ == nullptr) return true;
    gains_->raise_floor(time_ns);
    return port_.make_safe(*gains_, may_wait, time_ns);
  }
  std::uint32_t trace_id() const noexcept override { return trace_id_; }

 private:
  PortBase& port_;
  ServiceBase* const gains_;   // a writer's end; nullptr: none
  PortConnection connection_;  // the new one; after take the old one
  std::uint32_t trace_id_;
};

/// An event wait's port is disconnected: the events of its resource are heeded no more from the commit on.
class ListeningEnd final : public CommitAction {
 public:
  explicit ListeningEnd(EventInput& input) : input_(input) {}
  void take() noexcept override { input_.mute(); }

 private:
  EventInput& input_;
};

/// Listens to a rewired port's new resource for an event wait: has its place there before the commit, as nothing may
/// fail after it, and passes events on from the commit, so that none is missed. Those of the old resource are heeded no more then.
///
/// | member | written by             | read by | order                                  |
/// | ------ | ---------------------- | ------- | -------------------------------------- |
/// | live_  | who takes the change   | writers | release: what was changed before it    |
/// | input_ | [setup]                | writers | listening publishes it                 |
class ListenerChange final : public CommitAction, public EventListener {
 public:
  /// Throws Error (out_of_range) when the resource takes no more listeners. [non-rt]
  ListenerChange(Resource& resource, EventInput& input)
      : resource_(resource), use_(resource.use()), input_(input) {
    resource_.listen(*this);
  }
  ~ListenerChange() override { resource_.unlisten(*this); }
  void take() noexcept override {
    input_.mute();
    live_.store(true, std::memory_order_release);
  }
  void on_event(time_ns_t time_ns) noexcept override {
    if (live_.load(std::memory_order_acquire)) input_.heed(time_ns);
  }
  /// Lets the event wait listen itself. [non-rt], after the commit
  void hand_over() noexcept { input_.listen_for(*this, resource_); }

 private:
  Resource& resource_;
  std::shared_ptr<const void> use_;
  EventInput& input_;
  Atomic<bool> live_{false};
};

/// Forgets a fault: the component is STOPPED then, with new parts or parts configured anew.
class Repair final : public CommitAction {
 public:
  explicit Repair(Component& component) : component_(component), trace_id_(TraceNames::intern("repair")) {}
  void take() noexcept override {
    Task& repaired = component_.task();
    repaired.swap_fault(none_);
    for (const auto& port : component_.shell().ports()) port->reopen();
    repaired.set_state(ComponentState::stopped);
  }
  std::uint32_t trace_id() const noexcept override { return trace_id_; }

 private:
  Component& component_;
  FaultNote none_;
  std::uint32_t trace_id_;
};

/// Takes a component off its resources: its last outputs are written before anybody else gets to write there.
class Retreat final : public CommitAction {
 public:
  explicit Retreat(const Shell& shell) {
    for (const auto& port : shell.ports()) ports_.emplace_back(port.get(), PortConnection{});
  }
  /// Whose component it is. [non-rt], before the commit.
  void set_place(const Participant& place) noexcept { place_ = &place; }
  void take() noexcept override {
    place_->task->set_removed();
    if (place_->in_flight) place_->task->write_outputs(false, instant_ns - 1);
    for (auto& [port, connection] : ports_) {
      if (place_->left_behind) {
        port->leave_behind();  // its thread still uses it
      } else {
        port->swap(connection);
      }
    }
  }
  std::uint32_t trace_id() const noexcept override { return trace_id_; }

 private:
  const Participant* place_{nullptr};
  std::vector<std::pair<PortBase*, PortConnection>> ports_;
  std::uint32_t trace_id_{TraceNames::intern("remove")};
};

}  // namespace mauve
