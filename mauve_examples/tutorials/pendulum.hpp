// SPDX-License-Identifier: LGPL-3.0-or-later
// A pendulum, and two controllers that hold it at an angle: one swings for seconds, one does not.
#pragma once

#include <cmath>

#include <mauve_rt/mauve_rt.hpp>

namespace mauve_tutorials {

using Scalar = mauve::types::Float64;

inline constexpr double kSamplePeriodS = 1e-3;

struct PendulumShell : mauve::Shell {
  mauve::ReadPort<Scalar>& torque = read_port<Scalar>("torque");  // Nm
  mauve::WritePort<Scalar>& angle = write_port<Scalar>("angle");  // rad; 0: it hangs
  mauve::WritePort<Scalar>& speed = write_port<Scalar>("speed");  // rad/s
};

/// 1 kg at 0.5 m, with some friction.
class Pendulum final : public mauve::Core<PendulumShell> {
 public:
  void move() {
    constexpr double kMass = 1.0, kLength = 0.5, kGravity = 9.81, kFriction = 0.2;
    const double torque =
        shell().torque.read().value.data - kFriction * speed_ - kMass * kGravity * kLength * std::sin(angle_);
    speed_ += kSamplePeriodS * torque / (kMass * kLength * kLength);
    angle_ += kSamplePeriodS * speed_;
    shell().angle.write({.data = angle_});
    shell().speed.write({.data = speed_});
  }

 private:
  MAUVE_STATE(angle_, speed_)
  double angle_{0.0};
  double speed_{0.0};
};

struct PendulumFsm : mauve::Fsm<PendulumShell, Pendulum> {
  void define() override {
    mauve::State& move = execution("Move", "move", &Pendulum::move);
    mauve::State& rest = wait("Rest", mauve::ms_to_ns(1));
    set_initial(move);
    next(move, rest);
    next(rest, move);
  }
};

struct AngleControllerShell : mauve::Shell {
  mauve::Property<double>& target = property("target", 0.8, {.unit = "rad", .minimum = -1.5, .maximum = 1.5});
  mauve::ReadPort<Scalar>& angle = read_port<Scalar>("angle");
  mauve::ReadPort<Scalar>& speed = read_port<Scalar>("speed");
  mauve::WritePort<Scalar>& torque = write_port<Scalar>("torque");
};

/// Gains of its own for each core. What is common to all is a torque, so that another core can go on with it.
class AngleController : public mauve::Core<AngleControllerShell> {
 public:
  void control() {
    const double error = shell().target.value() - shell().angle.read().value.data;
    integral_nm_ += integral_gain() * error * kSamplePeriodS;
    const double braking = damping() * shell().speed.read().value.data;
    shell().torque.write({.data = gain() * error + integral_nm_ - braking});
  }

 protected:
  virtual double gain() const noexcept = 0;           // Nm/rad
  virtual double integral_gain() const noexcept = 0;  // Nm/(rad s)
  virtual double damping() const noexcept = 0;        // Nm s/rad

 private:
  MAUVE_STATE(integral_nm_)
  double integral_nm_{0.0};
};

class SoftController final : public AngleController {
 protected:
  double gain() const noexcept override { return 4.0; }
  double integral_gain() const noexcept override { return 16.0; }
  double damping() const noexcept override { return 6.0; }
};

class FirmController final : public AngleController {
 protected:
  double gain() const noexcept override { return 40.0; }
  double integral_gain() const noexcept override { return 60.0; }
  double damping() const noexcept override { return 8.0; }
};

struct AngleControllerFsm : mauve::Fsm<AngleControllerShell, AngleController> {
  void define() override {
    mauve::State& control = execution("Control", "control", &AngleController::control);
    mauve::State& rest = wait("Rest", mauve::ms_to_ns(1));
    set_initial(control);
    next(control, rest);
    next(rest, control);
  }
};

}  // namespace mauve_tutorials
