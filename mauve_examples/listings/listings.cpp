// SPDX-License-Identifier: LGPL-3.0-or-later
// The paper's listings as a program: two components without ROS and without a file, one core replaced while
// they run.
#include <chrono>
#include <cstdio>
#include <memory>
#include <thread>

#include "mauve_rt/mauve_rt.hpp"

#include "exploration.hpp"
#include "guidance.hpp"

namespace {

using listings::Point;
using namespace std::chrono_literals;

/// Says where the robot is told to go, then lets the given time pass.
void watch(mauve::SharedData<Point>& goal, const char* when, std::chrono::milliseconds duration) {
  std::this_thread::sleep_for(duration);
  Point value;
  mauve::time_ns_t time_ns = 0;
  std::uint64_t sequence = 0;
  goal.read.read(value, time_ns, sequence);
  std::printf("%-45s goal number %llu is (%.0f, %.0f)\n", when, static_cast<unsigned long long>(sequence),
              value.x, value.y);
}

void run() {
  mauve::Architecture architecture;
  architecture.add_component<listings::GuidanceShell, listings::GuidanceCore, listings::GuidanceFsm>(
      "guidance", {.priority = 60});
  auto& exploration = architecture.add_component<listings::ExplorationShell, listings::ExplorationCore,
                                                 listings::ExplorationFsm>("exploration", {.priority = 40});
  auto& goal = architecture.add_resource<mauve::SharedData<Point>>("goal");
  architecture.add_resource<mauve::SharedData<Point>>("target");
  architecture.connect("exploration", "goal", "goal", "write");
  architecture.connect("guidance", "goal", "goal", "read");
  architecture.connect("guidance", "target", "target", "write");
  architecture.connect("guidance", "position", "target",
                       "read");  // a robot that is at once where it is told to go
  architecture.configure();

  mauve::Deployer deployer(architecture);
  deployer.deploy();
  for (const std::string& missing : deployer.realtime_status().missing)
    std::printf("not real-time: %s\n", missing.c_str());
  watch(goal, "Exploration, waiting for answers:", 350ms);

  // Listing 3: stop, replace, start again on the same grid.
  mauve::Task& exploration_task = exploration.task();
  const mauve::time_ns_t clock = exploration_task.get_time();
  exploration_task.stop();
  exploration.cleanup_core();
  exploration.replace_core<listings::LocalExplorationCore>();
  exploration.configure_core();
  exploration_task.start(clock);
  watch(goal, "LocalExploration, after Listing 3:", 350ms);

  // The same in flight: the component goes on with its next release, none is missed.
  const mauve::StepReport report = exploration.swap_core(std::make_unique<listings::ExplorationCore>());
  std::printf("replaced in flight: blackout %.1f us, %lld releases missed\n",
              static_cast<double>(report.blackout_ns) * 1e-3, static_cast<long long>(report.missed_releases));
  watch(goal, "Exploration again:", 250ms);
  deployer.shutdown();

  for (const auto& component : architecture.components()) {
    const auto period_ns = component->fsm().period_ns();
    std::printf("%-12s period %lld ms\n", component->name().c_str(),
                static_cast<long long>(period_ns / 1'000'000));
  }
}

}  // namespace

int main() {
  try {
    run();
  } catch (const std::exception& failure) {
    std::fprintf(stderr, "%s\n", failure.what());
    return 1;
  }
  return 0;
}
