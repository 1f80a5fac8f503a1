// SPDX-License-Identifier: LGPL-3.0-or-later
// A first component, a metronome: shell, core and fsm. A tick every millisecond, a beat every hundred ticks.
#pragma once

#include <mauve_rt/mauve_rt.hpp>

namespace mauve_tutorials {

/// What goes over the port: the std_msgs/msg/Float64 that all components share. A type of one's own is a struct
/// and a line MAUVE_TYPE, as in mauve_rt/elements/types.hpp.
using Beat = mauve::types::Float64;

/// The shell: what others see of the component.
struct MetronomeShell : mauve::Shell {
  mauve::Property<std::int64_t>& period_us = property("period_us", 1000,
                                                      {.unit = "us",
                                                       .description = "from tick to tick",
                                                       .minimum = 100,
                                                       .maximum = 1e6,
                                                       .structural = mauve::ReadBy::fsm});
  mauve::Property<std::int64_t>& ticks_per_beat =
      property("ticks_per_beat", 100, {.unit = "1", .description = "from beat to beat", .minimum = 1});
  mauve::WritePort<Beat>& beat = write_port<Beat>("beat");
};

/// The core: data and algorithms, one method for each action and guard of the fsm.
class Metronome : public mauve::Core<MetronomeShell> {
 public:
  void tick() { ++ticks_; }
  virtual bool is_beat_due() const { return ticks_ >= shell().ticks_per_beat; }
  void beat() {
    ticks_ = 0;
    shell().beat.write({.data = static_cast<double>(++beats_)});
  }

  /// Two numbers are copied: 50 us before a tick there is still time for it.
  mauve::time_ns_t budget_ns() const noexcept override { return mauve::us_to_ns(50); }

 protected:
  std::int64_t ticks() const noexcept { return ticks_; }
  std::int64_t beats() const noexcept { return beats_; }

 private:
  MAUVE_STATE(ticks_, beats_)  // a metronome that replaces this one goes on counting
  std::int64_t ticks_{0};      // since the last beat
  std::int64_t beats_{0};
};

/// The fsm: when the core's methods run. Only `wait` lets time pass.
struct MetronomeFsm : mauve::Fsm<MetronomeShell, Metronome> {
  void define() override {
    mauve::State& tick = execution("Tick", "tick", &Metronome::tick);
    mauve::State& beat = execution("Beat", "beat", &Metronome::beat);
    mauve::State& rest = wait("Rest", mauve::us_to_ns(shell().period_us));
    set_initial(tick);
    transition(tick, "is_beat_due", &Metronome::is_beat_due, beat);
    next(tick, rest);
    next(beat, rest);
    next(rest, tick);
  }
};

}  // namespace mauve_tutorials
