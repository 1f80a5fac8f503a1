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

/// Lets the given time pass, then says where the robot is told to go.
void watch(mauve::SharedData<Point>& point, const char* when, std::chrono::milliseconds duration,
           const char* what = "goal") {
  std::this_thread::sleep_for(duration);
  Point value;
  mauve::time_ns_t time_ns = 0;
  mauve::ReaderState reader;
  point.read.read(value, time_ns, reader);
  std::printf("%-45s %s number %llu is (%.1f, %.1f)\n", when, what,
              static_cast<unsigned long long>(reader.seen), value.x, value.y);
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

/// Adds a Guidance with the machine given, whose robot is at once where it is told to go.
template <typename FsmType>
mauve::SharedData<Point>& add_guidance(mauve::Architecture& architecture, const std::string& name) {
  architecture.add_component<listings::GuidanceShell, listings::GuidanceCore, FsmType>(name);
  auto& target = architecture.add_resource<mauve::SharedData<Point>>(name + "_target");
  architecture.connect(name, "goal", "goal", "read");
  architecture.connect(name, "target", name + "_target", "write");
  architecture.connect(name, "position", name + "_target", "read");
  return target;
}

/// The two machines of Guidance side by side, given the same goal.
void compare_machines() {
  mauve::Architecture architecture;
  auto& goal = architecture.add_resource<mauve::SharedData<Point>>("goal");
  auto& psm_target = add_guidance<listings::GuidancePsm>(architecture, "psm");
  auto& fsm_target = add_guidance<listings::GuidanceFsm>(architecture, "fsm");
  architecture.configure();
  mauve::Deployer deployer(architecture);
  deployer.deploy();
  goal.write.write({2.0, 0.0, 0.0}, mauve::monotonic_now_ns());
  watch(psm_target, "Fig. 2, one action in each period of 50 ms:", 500ms, "target");
  watch(fsm_target, "Fig. 4, cycles of 50, 20 and 10 ms:", 0ms, "target");
}

}  // namespace

int main() {
  try {
    run();
    compare_machines();
  } catch (const std::exception& failure) {
    std::fprintf(stderr, "%s\n", failure.what());
    return 1;
  }
  return 0;
}
