// SPDX-License-Identifier: LGPL-3.0-or-later
// EventInput: where an event wait learns that its port's resource was written.
#pragma once

#include <atomic>
#include <optional>

#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/base/waiter.hpp"
#include "mauve_rt/data/port.hpp"
#include "mauve_rt/data/resource.hpp"

namespace mauve {

/// Keeps the time of the first event not consumed yet, and wakes the component.
///
/// | member    | written by                        | read by | order                                          |
/// | --------- | --------------------------------- | ------- | ---------------------------------------------- |
/// | time_     | writers, if empty; task empties   | task    | acq_rel: what was written before is visible    |
/// | waiter_   | ordinary threads, the same again  | writers | relaxed: listening publishes it first          |
/// | resource_ | ordinary threads, one at a time   | -       | -                                              |
class EventInput final : public EventListener {
 public:
  explicit EventInput(PortBase& port) : port_(&port) {}
  ~EventInput() override;

  void on_event(time_ns_t time_ns) noexcept override;
  /// The time of the first event since the last call. [rt], the task's thread
  std::optional<time_ns_t> consume() MAUVE_RT;

  /// [rt]
  const PortBase& port() const MAUVE_RT { return *port_; }
  /// Whom it wakes; before it listens, and nobody else later. [non-rt]
  void set_waiter(Waiter& waiter) noexcept { waiter_.store(&waiter, std::memory_order_relaxed); }
  /// Listens to the resource that the port is connected to now, and to no other. [non-rt]
  void listen();
  /// Listens to nothing from now on. [non-rt]
  void stop_listening() noexcept;
  /// The same for a resource where a stand-in listens so far. [non-rt]
  void listen_for(EventListener& stand_in, Resource& resource) noexcept;

 private:
  static constexpr time_ns_t kNone = INT64_MIN;

  PortBase* port_;
  std::atomic<Waiter*> waiter_{nullptr};
  Resource* resource_{nullptr};
  std::atomic<time_ns_t> time_{kNone};
};

}  // namespace mauve
