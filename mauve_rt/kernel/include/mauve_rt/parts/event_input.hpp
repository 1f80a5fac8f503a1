// SPDX-License-Identifier: LGPL-3.0-or-later
// EventInput: where an event wait learns that its port's resource was written.
#pragma once

#include <memory>
#include <optional>
#include <span>

#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/base/seam/atomic.hpp"
#include "mauve_rt/base/waiter.hpp"
#include "mauve_rt/data/port.hpp"
#include "mauve_rt/data/resource.hpp"

namespace mauve {

struct State;

/// Keeps the time of the first event not consumed yet, and wakes the component.
///
/// An fsm that a change puts in listens from its preparation on, since listening may fail, and a commit may not. Its
/// inputs ignore all events until the commit: those are for the fsm that still runs.
///
/// | member    | written by                          | read by | order                                            |
/// | --------- | ----------------------------------- | ------- | ------------------------------------------------ |
/// | time_     | writers, if empty; task empties; a  | task    | acq_rel: what was written before is visible      |
/// |           | commit fills it                     |         |                                                  |
/// | waiter_   | ordinary threads, the same again    | writers | relaxed: listening publishes it first            |
/// | is_live_  | before it listens; a commit         | writers | relaxed: the resource's events mutex, or where a |
/// |           |                                     |         | rewiring mutes it, any order: no event is lost   |
/// | resource_ | ordinary threads, one at a time,    | commits | the same, and a change of the component at a time|
/// |           | none in a commit of the component   |         |                                                  |
class EventInput final : public EventListener {
 public:
  explicit EventInput(PortBase& port) : port_(&port) {}
  ~EventInput() override;

  void on_event(time_ns_t time_ns) noexcept override;
  /// The time of the first event since the last call. [rt], the task's thread
  std::optional<time_ns_t> consume() MAUVE_RT;

  /// Keeps an event, unless one is kept: the first time of one that came, or one that consume() has returned. [rt]
  void keep(time_ns_t time_ns) MAUVE_RT;

  /// [rt]
  const PortBase& port() const MAUVE_RT { return *port_; }
  /// Whom it wakes; before it listens, and nobody else later. [non-rt]
  void set_waiter(Waiter& waiter) noexcept { waiter_.store(&waiter, std::memory_order_relaxed); }
  /// Ignores events until take_over(), or until it listens anew. [rt]
  void mute() MAUVE_RT { is_live_.store(false, std::memory_order_relaxed); }
  /// As on_event(), also of one that ignores events: by who listens in its place. [rt]
  void heed(time_ns_t time_ns) MAUVE_RT;
  /// Heeds events from now on, in place of the inputs of another fsm. One that came before is taken over when it came at
  /// the same port and resource, and no wait there has consumed it. [rt], a commit
  void take_over(std::span<const std::unique_ptr<State>> before) MAUVE_RT;
  /// Listens to the resource that the port is connected to now, and to no other. [non-rt]
  void listen();
  /// Listens to nothing from now on. [non-rt]
  void stop_listening() noexcept;
  /// The same for a resource where a stand-in listens so far. [non-rt]
  void listen_for(EventListener& stand_in, Resource& resource) noexcept;

 private:
  static constexpr time_ns_t kNone = INT64_MIN;

  time_ns_t unconsumed_by_all(std::span<const std::unique_ptr<State>> before) const MAUVE_RT;
  bool is_for_the_same(const EventInput& other) const MAUVE_RT;

  PortBase* port_;
  Atomic<Waiter*> waiter_{nullptr};
  Resource* resource_{nullptr};
  Atomic<time_ns_t> time_{kNone};
  Atomic<bool> is_live_{true};
};

}  // namespace mauve
