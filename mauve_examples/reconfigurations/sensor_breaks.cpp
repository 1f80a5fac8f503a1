// SPDX-License-Identifier: LGPL-3.0-or-later
// Section II-F of the paper: a sensor breaks, and another processing chain is set up in its place.
//
//   before:  laser  -> scan  -> scan_filter  -> obstacle ----> control -> speed
//   after:   camera -> depth -> depth_filter -> depth_obstacle -'
//
// One transaction adds the new chain, wires it in and removes the old one. control runs at 1 kHz all the while.
#include <algorithm>
#include <exception>

#include "mauve_rt/elements/elements.hpp"

#include "control_watch.hpp"

namespace {

using mauve::types::Float64;
using namespace reconfigurations;

constexpr double kWall_m = 2.0;

using DriverShell = mauve::SourceShell<Float64>;
using DistanceFilterShell = mauve::FilterShell<Float64>;

/// Answers thirty times, then never again.
struct LaserDriver : mauve::UpdateCore<DriverShell> {
  void update() override {
    if (++scans_ == 30) throw std::runtime_error("the laser does not answer");
    shell().output.write({kWall_m});
  }
  int scans_{0};
};

/// Measures less well: up to 10 cm too much or too little.
struct CameraDriver : mauve::UpdateCore<DriverShell> {
  void update() override {
    sign_ = -sign_;
    shell().output.write({kWall_m + 0.1 * sign_});
  }
  double sign_{1.0};
};

struct ScanFilter : mauve::UpdateCore<DistanceFilterShell> {
  void update() override {
    const mauve::Sample<Float64> scan = shell().input.read();
    if (scan.status == mauve::DataStatus::new_data) shell().output.write(scan.value);
  }
};

/// The mean of the last two images.
struct DepthFilter : mauve::UpdateCore<DistanceFilterShell> {
  void update() override {
    const mauve::Sample<Float64> depth = shell().input.read();
    if (depth.status != mauve::DataStatus::new_data) return;
    if (before_m_ > 0.0) shell().output.write({(before_m_ + depth.value.data) / 2.0});
    before_m_ = depth.value.data;
  }
  double before_m_{0.0};
};

/// Slows down before obstacles, and does not drive blind: without a distance, or with an old one, the speed is 0.
struct Control : mauve::UpdateCore<DistanceFilterShell> {
  void update() override {
    const mauve::Sample<Float64> obstacle = shell().input.read();
    const bool is_blind =
        obstacle.status == mauve::DataStatus::none || shell().input.age_ns() > mauve::ms_to_ns(50);
    shell().output.write({is_blind ? 0.0 : std::clamp((obstacle.value.data - 0.5) / 2.0, 0.0, 1.0)});
  }
};

template <typename Shell, typename CoreType>
void add(mauve::Architecture& architecture, const char* name, int priority, std::int64_t period_us) {
  architecture.add_component<Shell, CoreType, mauve::PeriodicUpdateFsm<Shell>>(
      name, {.priority = priority, .trace_records = kTraceRecords});
  architecture.component(name).set_property("period_us", period_us);
}

mauve::ComponentParts every_ten_ms() {
  return {.settings = {.priority = 40}, .properties = {{"period_us", std::int64_t{10'000}}}};
}

mauve::Transaction camera_in_place_of_laser() {
  mauve::Transaction change;
  change.add_resource("depth", std::make_unique<mauve::SharedData<Float64>>());
  change.add_resource("depth_obstacle", std::make_unique<mauve::SharedData<Float64>>());
  change.add_component<DriverShell, CameraDriver, mauve::PeriodicUpdateFsm<DriverShell>>("camera",
                                                                                         every_ten_ms());
  change.add_component<DistanceFilterShell, DepthFilter, mauve::PeriodicUpdateFsm<DistanceFilterShell>>(
      "depth_filter", every_ten_ms());
  change.connect("camera", "output", "depth", "write")
      .connect("depth_filter", "input", "depth", "read")
      .connect("depth_filter", "output", "depth_obstacle", "write")
      .disconnect("control", "input")
      .connect("control", "input", "depth_obstacle", "read")
      .remove_component("laser")
      .remove_component("scan_filter")
      .remove_resource("scan")
      .remove_resource("obstacle")
      .start("camera")
      .start("depth_filter");
  return change;
}

int run() {
  mauve::Architecture architecture;
  add<DriverShell, LaserDriver>(architecture, "laser", 40, 10'000);
  add<DistanceFilterShell, ScanFilter>(architecture, "scan_filter", 40, 10'000);
  add<DistanceFilterShell, Control>(architecture, "control", 60, 1'000);
  architecture.add_resource<mauve::SharedData<Float64>>("scan");
  architecture.add_resource<mauve::SharedData<Float64>>("obstacle");
  auto& speed = architecture.add_resource<mauve::SharedData<Float64>>("speed");
  architecture.connect("laser", "output", "scan", "write");
  architecture.connect("scan_filter", "input", "scan", "read");
  architecture.connect("scan_filter", "output", "obstacle", "write");
  architecture.connect("control", "input", "obstacle", "read");
  architecture.connect("control", "output", "speed", "write");
  architecture.configure();

  mauve::Deployer deployer(architecture);
  deployer.deploy();
  wait_for("the robot to drive", [&] { return newest(speed).data > 0.0; });
  std::printf("with the laser: %.2f m/s\n", newest(speed).data);

  const mauve::Task& laser = architecture.component("laser").task();
  wait_for("the fault", [&] { return laser.state() == mauve::ComponentState::faulted; });
  wait_for("the robot to stand", [&] { return newest(speed).data == 0.0; });
  std::printf("laser FAULTED in %s: %s; %.2f m/s\n", laser.fault().where.c_str(), laser.fault().what.c_str(),
              newest(speed).data);

  print_report("the camera in its place", deployer.commit(camera_in_place_of_laser()), "control");
  wait_for("the robot to drive again", [&] { return newest(speed).data > 0.0; });
  std::printf("with the camera: %.2f m/s\n", newest(speed).data);
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  deployer.shutdown();
  return ControlWatch(deployer.drain_trace(), architecture.component("control").task()).verdict();
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
