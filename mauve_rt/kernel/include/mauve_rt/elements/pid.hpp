// SPDX-License-Identifier: LGPL-3.0-or-later
// PID controller with anti-windup, filtered derivative and gains that are set while it runs.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "mauve_rt/elements/double_fields.hpp"
#include "mauve_rt/elements/guarded_core.hpp"
#include "mauve_rt/elements/types.hpp"

namespace mauve {

/// The algorithm: K. J. Astrom, T. Hagglund, PID Controllers: Theory, Design, and Tuning (ISA 1995), sections 3.4 to 3.6.
/// Integral and derivative are backward differences. All functions [rt].
struct Pid {
  struct Settings {
    double kp{1.0};
    double ki{0.0};                // 1/s
    double kd{0.0};                // s
    double set_point_weight{1.0};  // of the proportional part
    double derivative_filter_s{0.0};
    double anti_windup_s{0.0};
    double minimum{-1.0};
    double maximum{1.0};
  };

  double integral{0.0};  // its contribution to the command: a new ki changes what comes, never what there is
  double rate{0.0};      // of `measured`, filtered, without kd
  double measured{0.0};  // of the period before
  bool is_running{false};

  /// The command for this period; `dt_s` > 0 since the last call.
  double update(const Settings& with, double set_point, double now_measured, double dt_s) MAUVE_RT {
    // On the measurement, so that a step of the set point causes no peak.
    if (is_running)
      rate = (with.derivative_filter_s * rate + now_measured - measured) / (with.derivative_filter_s + dt_s);
    measured = now_measured;
    is_running = true;
    integral += with.ki * (set_point - now_measured) * dt_s;
    const double wanted =
        with.kp * (with.set_point_weight * set_point - now_measured) + integral - with.kd * rate;
    const double command = std::max(with.minimum, std::min(wanted, with.maximum));
    // Back-calculation. A time constant of less than a period takes all of the excess back at once.
    integral += (command - wanted) * dt_s / std::max(with.anti_windup_s, dt_s);
    return command;
  }
};

struct PidShell : PeriodicShell {
  Property<double>& kp = property("kp", 1.0, {.unit = "1", .description = "proportional gain"});
  Property<double>& ki = property("ki", 0.0, {.unit = "1/s", .description = "integral gain"});
  Property<double>& kd = property("kd", 0.0, {.unit = "s", .description = "derivative gain"});
  Property<double>& set_point_weight =
      property("set_point_weight", 1.0,
               {.unit = "1",
                .description = "part of the set point in the proportional part",
                .minimum = 0.0,
                .maximum = 1.0});
  Property<double>& derivative_filter_s =
      property("derivative_filter_s", 0.0,
               {.unit = "s", .description = "time constant of the filter of the derivative", .minimum = 0.0});
  Property<double>& anti_windup_s = property(
      "anti_windup_s", 1.0,
      {.unit = "s", .description = "time constant by which the integral follows a limit", .minimum = 0.0});
  Property<double>& minimum =
      property("minimum", -1.0, {.description = "least command; it comes before a lower maximum"});
  Property<double>& maximum = property("maximum", 1.0, {.description = "greatest command"});
  Property<std::int64_t>& max_age_ms = property(
      "max_age_ms", 500,
      {.unit = "ms", .description = "an older measurement ends the control; 0: any age", .minimum = 0});
  Property<std::int64_t>& set_point_max_age_ms = property(
      "set_point_max_age_ms", 0,
      {.unit = "ms", .description = "an older set point ends the control; 0: any age", .minimum = 0});
  ReadPort<types::Float64>& set_point = read_port<types::Float64>("set_point");
  ReadPort<types::Float64>& measured = read_port<types::Float64>("measured");
  WritePort<types::Float64>& output = write_port<types::Float64>("command");
};

/// Control ends, with command 0, while an input is too old or no finite number; it begins again without an integral. A core that
/// replaces this one goes on with `integral`, `rate`, `measured` and `is_running`:
///
///   architecture.add_component<PidShell, PidCore, PeriodicUpdateFsm<PidShell>>("speed");
class PidCore final : public GuardedCore<PidShell> {
 public:
  std::vector<StateField> state_fields() override {
    return make_state_fields("integral, rate, measured, is_running", pid_.integral, pid_.rate, pid_.measured,
                             pid_.is_running);
  }
  void take(CoreBase& old) noexcept override {
    GuardedCore::take(old);
    if (const auto* other = dynamic_cast<const PidCore*>(&old)) {  // what a ring gave once
      set_point_ = other->set_point_;
      measured_ = other->measured_;
    }
  }

 protected:
  bool read_inputs() override {
    set_point_.update(shell().set_point);
    measured_.update(shell().measured);
    return is_fresh(set_point_, shell().set_point_max_age_ms) && is_fresh(measured_, shell().max_age_ms) &&
           is_finite(set_point_.value()) && is_finite(measured_.value());
  }
  void write_output() override {
    const Pid::Settings settings{.kp = shell().kp,
                                 .ki = shell().ki,
                                 .kd = shell().kd,
                                 .set_point_weight = shell().set_point_weight,
                                 .derivative_filter_s = shell().derivative_filter_s,
                                 .anti_windup_s = shell().anti_windup_s,
                                 .minimum = shell().minimum,
                                 .maximum = shell().maximum};
    shell().output.write(
        {pid_.update(settings, set_point_.value().data, measured_.value().data, period_s())});
  }
  void write_default() override { shell().output.write({}); }
  void reset() override { pid_ = {}; }
  bool configure_hook() override {
    set_point_ = {};
    measured_ = {};
    return GuardedCore::configure_hook();
  }

 private:
  Pid pid_;
  LatestSample<types::Float64> set_point_;
  LatestSample<types::Float64> measured_;
};

}  // namespace mauve
