// SPDX-License-Identifier: LGPL-3.0-or-later
#include "conditions/kinds.hpp"

namespace mauve::rules {

namespace {

/// The signal's value is the component's period in s.
class NoRelease final : public Condition {
 public:
  NoRelease(Signal& signal, double periods) : signal_(signal), periods_(periods) {}
  void arm(time_ns_t now_ns) noexcept override {
    armed_ns_ = since_ns_ = now_ns;
    holds_ = false;
    calm_.arm(now_ns);
  }
  Look look(time_ns_t now_ns) noexcept override {
    const bool held = holds_;
    for (;;) {
      const Signal::Last last = signal_.last();
      if (last.count == 0) {
        if (signal_.listen(kInfinity, -kInfinity, last)) return {.since_ns = since_ns_};
        continue;
      }
      const time_ns_t from_ns = std::max(armed_ns_, last.time_ns);
      const time_ns_t longest_ns = nanoseconds(periods_ * last.value);
      const time_ns_t due_ns = later_by(from_ns, longest_ns);
      calm_.look(now_ns, longest_ns);
      const bool holds = now_ns > due_ns && (held || calm_.proves(due_ns, kForever));
      if (holds != holds_) since_ns_ = std::max(since_ns_, holds ? due_ns : from_ns);
      holds_ = holds;
      const double edge = holds ? kInfinity : -kInfinity;  // while it does not hold every release is quiet
      if (!signal_.listen(edge, -edge, last)) continue;
      return {.truth = truth_of(holds),
              .since_ns = since_ns_,
              .next_ns = holds ? kForever : calm_.next_ns(due_ns),
              .look_ns = holds ? kForever : calm_.look_ns(due_ns),
              .measured = static_cast<double>(now_ns - from_ns) * 1e-9};
    }
  }

 private:
  Signal& signal_;
  const double periods_;
  Calm calm_;
  time_ns_t armed_ns_{0};
  time_ns_t since_ns_{0};
  bool holds_{false};
};

}  // namespace

ConditionKind no_release_kind() {
  return {.name = "no_release",
          .summary = "a component was not released for longer than `periods` of its periods",
          .parameters = {kComponent, {.name = "periods", .type = "float", .minimum = 1, .initial = 3.0}},
          .hears =
              [](const Parameters& told) {
                return std::vector{SignalSpec{SignalKind::release, text(told, "component")}};
              },
          .make = [](const Parameters& parameters,
                     std::span<Signal* const> signals) -> std::unique_ptr<Condition> {
            return std::make_unique<NoRelease>(*signals[0], told<double>(parameters, "periods"));
          }};
}

}  // namespace mauve::rules
