// SPDX-License-Identifier: LGPL-3.0-or-later
// Section II-F of the paper: a sensor becomes useless, GPS indoors, and useful again.
//
//   outdoors:  gps          -> fix   ----> localisation -> pose -> control -> speed
//   indoors:   scan_matcher -> match -'
//
// Each way is one transaction. localisation keeps its estimate, and control runs at 1 kHz all the while.
#include <atomic>
#include <cmath>
#include <exception>

#include "mauve_rt/elements/elements.hpp"

#include "control_watch.hpp"

namespace {

using mauve::types::Float64;
using namespace reconfigurations;

/// What it measured last stays true of its time: a stop writes no zero over it.
struct SensorShell : mauve::PeriodicShell {
  mauve::WritePort<Float64>& output = write_port<Float64>("output", {.on_stop = mauve::OutputPolicy::hold});
};
using LinkShell = mauve::FilterShell<Float64>;

constexpr double kSpeed_m_s = 1.0;

/// The world: a robot that drives along x, and a sky that it sees or not.
std::atomic<bool> sees_the_sky{true};
mauve::time_ns_t departure_ns = 0;
double true_x_m(mauve::time_ns_t instant_ns) {
  return kSpeed_m_s * static_cast<double>(instant_ns - departure_ns) * 1e-9;
}

/// Has a fix only under the sky.
struct Gps : mauve::UpdateCore<SensorShell> {
  void update() override {
    if (sees_the_sky.load(std::memory_order_relaxed))
      shell().output.write({true_x_m(clock_ns())});  // relaxed: a lone flag
  }
};

/// Finds the robot between walls: none are there outdoors.
struct ScanMatcher : mauve::UpdateCore<SensorShell> {
  void update() override {
    if (!sees_the_sky.load(std::memory_order_relaxed)) shell().output.write({true_x_m(clock_ns())});
  }
};

/// Goes on by dead reckoning from the last position it was given, whoever gave it.
struct Localisation : mauve::UpdateCore<LinkShell> {
  void update() override {
    const mauve::Sample<Float64> position = shell().input.read();
    if (position.status == mauve::DataStatus::new_data) {
      x_m_ = position.value.data;
      at_ns_ = position.time_ns;
    }
    if (at_ns_ != 0)
      shell().output.write({x_m_ + kSpeed_m_s * static_cast<double>(clock_ns() - at_ns_) * 1e-9});
  }
  double x_m_{0.0};
  mauve::time_ns_t at_ns_{0};
};

/// Drives on while it knows where it is, and notes the largest step between two poses.
struct Control : mauve::UpdateCore<LinkShell> {
  void update() override {
    const mauve::Sample<Float64> pose = shell().input.read();
    if (pose.status == mauve::DataStatus::new_data) {
      if (before_ns_ != 0) {
        const double expected_m = kSpeed_m_s * static_cast<double>(pose.time_ns - before_ns_) * 1e-9;
        const double jump_m = std::abs(pose.value.data - before_m_ - expected_m);
        if (jump_m > largest_jump_m.load(std::memory_order_relaxed))
          largest_jump_m.store(jump_m, std::memory_order_relaxed);
      }
      before_m_ = pose.value.data;
      before_ns_ = pose.time_ns;
    }
    shell().output.write({before_ns_ != 0 ? kSpeed_m_s : 0.0});
  }
  std::atomic<double> largest_jump_m{0.0};  // relaxed: a lone figure
  double before_m_{0.0};
  mauve::time_ns_t before_ns_{0};
};

template <typename Shell, typename CoreType>
mauve::Component& add(mauve::Architecture& architecture, const char* name, int priority,
                      std::int64_t period_us) {
  mauve::Component& component = architecture.add_component<Shell, CoreType, mauve::PeriodicUpdateFsm<Shell>>(
      name, {.priority = priority, .trace_records = kTraceRecords});
  component.set_property("period_us", period_us);
  return component;
}

/// Stops one source of positions, starts the other, and has localisation listen to that.
mauve::Transaction change_over(const char* from, const char* to, const char* resource) {
  mauve::Transaction change;
  change.stop(from)
      .start(to)
      .disconnect("localisation", "input")
      .connect("localisation", "input", resource, "read");
  return change;
}

/// How old the newest position of a source is.
mauve::time_ns_t age_ns(mauve::SharedData<Float64>& resource) {
  Float64 position;
  mauve::time_ns_t time_ns = 0;
  mauve::ReaderState reader;
  resource.read.read(position, time_ns, reader);
  return mauve::monotonic_now_ns() - time_ns;
}

int run() {
  mauve::Architecture architecture;
  add<SensorShell, Gps>(architecture, "gps", 30, 20'000);
  add<SensorShell, ScanMatcher>(architecture, "scan_matcher", 30, 20'000);
  add<LinkShell, Localisation>(architecture, "localisation", 50, 5'000);
  auto& control = add<LinkShell, Control>(architecture, "control", 60, 1'000);
  auto& fix = architecture.add_resource<mauve::SharedData<Float64>>("fix");
  auto& match = architecture.add_resource<mauve::SharedData<Float64>>("match");
  auto& pose = architecture.add_resource<mauve::SharedData<Float64>>("pose");
  architecture.add_resource<mauve::SharedData<Float64>>("speed");
  architecture.connect("gps", "output", "fix", "write");
  architecture.connect("scan_matcher", "output", "match", "write");
  architecture.connect("localisation", "input", "fix", "read");
  architecture.connect("localisation", "output", "pose", "write");
  architecture.connect("control", "input", "pose", "read");
  architecture.connect("control", "output", "speed", "write");
  architecture.configure();

  departure_ns = mauve::monotonic_now_ns();
  mauve::Deployer deployer(architecture);
  deployer.deploy();
  deployer.stop("scan_matcher");
  const auto& core = control.core_as<Control>();
  const auto say = [&](const char* where) {
    std::printf("%s: x = %.2f m, largest jump of the pose %.3f m\n", where, newest(pose).data,
                core.largest_jump_m.load());
  };
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  say("outdoors");

  sees_the_sky = false;
  wait_for("the fix to grow old", [&] { return age_ns(fix) > mauve::ms_to_ns(100); });
  print_report("GPS is lost", deployer.commit(change_over("gps", "scan_matcher", "match")), "localisation");
  wait_for("a match", [&] { return newest(match).data > 0.0; });
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  say("indoors");

  sees_the_sky = true;
  wait_for("the match to grow old", [&] { return age_ns(match) > mauve::ms_to_ns(100); });
  print_report("no walls any more", deployer.commit(change_over("scan_matcher", "gps", "fix")),
               "localisation");
  wait_for("a fix", [&] { return age_ns(fix) < mauve::ms_to_ns(100); });
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  say("outdoors again");

  deployer.shutdown();
  const int status = ControlWatch(deployer.drain_trace(), control.task()).verdict();
  return core.largest_jump_m < 0.01 ? status : 1;
}

}  // namespace

int main() {
  try {
    return run();
  } catch (const std::exception& failure) {
    std::fprintf(stderr, "%s\n", failure.what());
    return 1;
  }
}
