// SPDX-License-Identifier: LGPL-3.0-or-later
// What befalls one component, for any number of signals: it has one listener.
#pragma once

#include "mauve_rt/base/seam/atomic.hpp"
#include "mauve_rt/rules/feeds.hpp"
#include "mauve_rt/run/task_listener.hpp"

namespace mauve::rules {

/// What of a component a signal tells.
enum class Befalls : std::uint8_t {
  overrun,
  late_wakeup,
  late_response,
  release,
  over_declared,
  state,
  change
};

/// | member     | written by                     | read by             | order                                     |
/// | ---------- | ------------------------------ | ------------------- | ----------------------------------------- |
/// | told_      | [setup]; a count: who tells it | who tells it        | each signal is told by one at a time      |
/// | period_s_  | who calls follow()             | the component       | relaxed: a lone number                    |
/// | the rest   | who calls follow()             | the same            | -                                         |
class ComponentFeed final : public Feed, private TaskListener {
 public:
  /// Throws Error (unknown_component). [setup]
  ComponentFeed(std::string component, const FeedPlace& place);
  ~ComponentFeed() override;

  /// `bound_ns`: what counts as late. [setup]
  /// Throws Error (out_of_range): another one listens to the component, or it has no period that a release could miss.
  void add(Befalls what, Signal& signal, time_ns_t bound_ns = 0);
  /// It is told nothing any more. [non-rt]
  void remove(const Signal& signal);
  bool hears_anything() const noexcept { return !told_.empty(); }
  void follow() override;

 private:
  struct Told {
    Befalls what;
    Signal* signal;
    time_ns_t bound_ns;
    std::uint64_t count{0};
  };

  void on_late_wakeup(time_ns_t now_ns, time_ns_t late_ns) MAUVE_RT override;
  void on_late_response(time_ns_t now_ns, time_ns_t response_ns) MAUVE_RT override;
  void on_overrun(time_ns_t now_ns, std::uint64_t overruns) MAUVE_RT override;
  void on_over_declared(time_ns_t now_ns) MAUVE_RT override;
  void on_state(time_ns_t now_ns, ComponentState state) MAUVE_RT override;
  void tell(Befalls what, time_ns_t now_ns, double value) MAUVE_RT;
  void count(Befalls what, time_ns_t now_ns, time_ns_t measured_ns) MAUVE_RT;
  time_ns_t earliest(Befalls what) const;
  bool hears(Befalls what) const;
  void begin(const Task& task);
  void listen(std::shared_ptr<Component> component);
  void let_go() noexcept;

  Architecture& architecture_;
  const Clock& clock_;
  const std::string name_;
  std::vector<Told> told_;
  std::shared_ptr<Component> component_;  // nullptr: it was removed
  std::uint32_t seen_change_{0};
  Atomic<double> period_s_{0.0};
};

}  // namespace mauve::rules
