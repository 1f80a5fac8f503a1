// SPDX-License-Identifier: LGPL-3.0-or-later
#include "conditions/kinds.hpp"

namespace mauve::rules {

namespace {

const std::string kOverdue = "overdue";

/// Holds while one goal executes for longer than a time. The signal's value: the goal, 0 for none; its time: since when.
class Overdue final : public Condition {
 public:
  Overdue(Signal& signal, time_ns_t longer_than_ns) : signal_(signal), longer_than_ns_(longer_than_ns) {}
  void arm(time_ns_t now_ns) noexcept override { armed_ns_ = now_ns; }
  Look look(time_ns_t now_ns) noexcept override {
    for (;;) {
      const Signal::Last last = signal_.last();
      if (signal_.listen(last.value, last.value, last)) return look_at(last, now_ns);
    }
  }

 private:
  Look look_at(const Signal::Last& last, time_ns_t now_ns) const noexcept {
    if (last.count == 0) return {.truth = Truth::unknown, .since_ns = armed_ns_};
    if (last.value == 0.0) return {.since_ns = std::max(armed_ns_, last.time_ns)};
    const time_ns_t due_ns = later_by(last.time_ns, longer_than_ns_);
    const bool holds = now_ns > due_ns;
    return {.truth = truth_of(holds),
            .since_ns = std::max(armed_ns_, holds ? due_ns : last.time_ns),
            .next_ns = holds ? kForever : later_by(due_ns, 1),
            .measured = static_cast<double>(now_ns - last.time_ns) * 1e-9};
  }

  Signal& signal_;
  const time_ns_t longer_than_ns_;
  time_ns_t armed_ns_{0};
};

}  // namespace

ConditionKind action_kind() {
  return {
      .name = "action",
      .summary =
          "the last goal of an action was aborted or the kernel rejected it, or a goal executes longer than "
          "`longer_than_s`",
      .parameters = {{.name = "resource", .type = "resource", .required = true},
                     {.name = "is", .type = "aborted|overdue", .required = true},
                     {.name = "longer_than_s", .type = "float", .unit = "s", .minimum = 1e-9}},
      .hears =
          [](const Parameters& told) {
            const bool is_overdue = text(told, "is") == kOverdue;
            if (is_overdue != is_told(told, "longer_than_s")) {
              throw Error(ErrorCode::invalid_argument, "a limit belongs to a goal that is overdue",
                          {.element = "longer_than_s",
                           .expected = is_overdue ? "a time in s" : "no longer_than_s, or is: overdue",
                           .found = is_overdue ? "nothing" : "is: " + text(told, "is"),
                           .remedy = is_overdue ? "add longer_than_s" : "remove longer_than_s"});
            }
            return std::vector{SignalSpec{SignalKind::goal, text(told, "resource"), text(told, "is")}};
          },
      .make = [](const Parameters& parameters,
                 std::span<Signal* const> signals) -> std::unique_ptr<Condition> {
        if (text(parameters, "is") == kOverdue) {
          return std::make_unique<Overdue>(*signals[0],
                                           nanoseconds(told<double>(parameters, "longer_than_s")));
        }
        return std::make_unique<Equal>(*signals[0], 1.0);
      }};
}

}  // namespace mauve::rules
