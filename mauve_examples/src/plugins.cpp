// SPDX-License-Identifier: LGPL-3.0-or-later
// What this library offers by name.
#include "mauve_examples/control.hpp"
#include "mauve_examples/exploration.hpp"
#include "mauve_examples/guidance.hpp"
#include "mauve_examples/mapping.hpp"
#include "mauve_examples/robot.hpp"

MAUVE_PLUGINS(registry) {
  using namespace mauve_examples;
  registry.type<Point>();
  registry.type<Pose2D>();
  registry.type<Twist>();
  registry.type<Bool>();
  registry.type<Scan>();
  registry.type<RobotBody>();
  registry.type<MapUpdate>();
  registry.type<PeerMessage>();
  registry.resource<OccupancyMap>("mauve_examples/OccupancyMap");

  registry.shell<RobotShell>("mauve_examples/RobotShell");
  registry.core<RobotCore>("mauve_examples/Robot", "mauve_examples/RobotShell");
  registry.fsm<RobotFsm>("mauve_examples/RobotFsm", "mauve_examples/RobotShell");

  registry.shell<ControlShell>("mauve_examples/ControlShell");
  registry.core<ControlCore>("mauve_examples/Control", "mauve_examples/ControlShell");
  registry.fsm<ControlFsm>("mauve_examples/ControlFsm", "mauve_examples/ControlShell");

  registry.shell<GuidanceShell>("mauve_examples/GuidanceShell");
  registry.core<GuidanceCore>("mauve_examples/Guidance", "mauve_examples/GuidanceShell");
  registry.fsm<GuidanceFsm>("mauve_examples/GuidanceFsm", "mauve_examples/GuidanceShell");

  registry.shell<MappingShell>("mauve_examples/MappingShell");
  registry.core<MappingCore>("mauve_examples/Mapping", "mauve_examples/MappingShell");
  registry.fsm<MappingFsm>("mauve_examples/MappingFsm", "mauve_examples/MappingShell");

  registry.shell<ExplorationShell>("mauve_examples/ExplorationShell");
  registry.core<ExplorationCore>("mauve_examples/Exploration", "mauve_examples/ExplorationShell");
  registry.core<LocalExplorationCore>("mauve_examples/LocalExploration", "mauve_examples/ExplorationShell");
  registry.fsm<ExplorationFsm>("mauve_examples/ExplorationFsm", "mauve_examples/ExplorationShell");
}
