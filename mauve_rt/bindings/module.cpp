// SPDX-License-Identifier: LGPL-3.0-or-later
// mauve_rt._kernel. A signature names the classes of Python that were registered before it: hence the order.
#include "log.hpp"
#include "translate.hpp"

PYBIND11_MODULE(_kernel, module) {
  using namespace mauve::bindings;
  module.doc() = R"(The native kernel, translated one to one. Times are int64 nanoseconds of CLOCK_MONOTONIC.

Attributes:
    END_SIGNALS: Signals that end a process in order: see wait_end_signal().
    ERROR_REPLIES: By the code of a MauveError: the constant of mauve_msgs/msg/ReplyCode that answers a request which
        such an error refuses.
    NOT_MEASURED: In the place of a time that there is not, or not yet.
    STATE_TIMES: What add_component(states=...) takes for each execution state, in words.
    NO_LOG: Of a part that belongs to no architecture: its lines go nowhere.
    KEPT: Source of overlays of rules that were active before a restart, and that the rules file lacks.
    HELD_STOPPED: Source of overlays that keep components stopped after a restart.
    STOP_TIMEOUT_NS: How long a state may go on after a stop of all components, before its component is given up.
    TRANSFORM_OUTCOMES: The outcomes of a set or lookup of a transform in words, by the numbers of
        mauve_msgs/msg/TransformOutcome.
    TASK_SETTINGS: What add_component() takes by keyword, besides `states` and `max_slew`.
)";
  bind_errors(module);
  bind_descriptions(module);
  bind_log(module);
  bind_python_shell(module);
  bind_python_fsm(module);
  bind_registry(module);
  bind_settings(module);
  bind_output_steps(module);
  bind_reports(module);
  bind_probation(module);
  bind_shadow(module);
  bind_open_change(module);
  bind_transaction(module);
  bind_overlays(module);
  bind_architecture(module);
  bind_state_keeper(module);
  bind_value_log(module);
  bind_transforms(module);
  bind_goals(module);
  bind_host(module);
  bind_simulation(module);
  bind_rules(module);
  bind_rule_runner(module);
  bind_process_end(module);
  module.attr("__version__") = MAUVE_VERSION;
  module.attr("NOT_MEASURED") = mauve::kNotMeasured;
  module.def("monotonic_ns", &mauve::monotonic_now_ns);
}
