// SPDX-License-Identifier: LGPL-3.0-or-later
// Common shells: one input, one output, or both, and a period.
#pragma once

#include "mauve_rt/parts/shell.hpp"

namespace mauve {

/// The shell of a component that does the same in each period; see PeriodicUpdateFsm.
struct PeriodicShell : Shell {
  Property<std::int64_t>& period_us = property("period_us", 10'000,
                                               {.unit = "us",
                                                .description = "from one update to the next",
                                                .minimum = 1,
                                                .maximum = 3.6e9,
                                                .structural = ReadBy::fsm});
};

/// Produces: a sensor's driver, a generator.
template <Described T>
struct SourceShell : PeriodicShell {
  WritePort<T>& output = this->template write_port<T>("output");
};

/// Consumes: an actuator's driver, a logger.
template <Described T>
struct SinkShell : PeriodicShell {
  ReadPort<T>& input = this->template read_port<T>("input");
};

/// Makes its output from its input: a filter, a converter, a controller.
template <Described In, Described Out = In>
struct FilterShell : PeriodicShell {
  ReadPort<In>& input = this->template read_port<In>("input");
  WritePort<Out>& output = this->template write_port<Out>("output");
};

}  // namespace mauve
