// SPDX-License-Identifier: LGPL-3.0-or-later
// Exploration: where to look next, 2 Hz. Two cores: one agrees with the peers, one decides alone.
#pragma once

#include <memory>

#include "mauve_examples/explorer.hpp"
#include "mauve_examples/occupancy_map.hpp"

namespace mauve_examples {

struct ExplorationShell : mauve::Shell {
  mauve::Property<std::string>& robot_name = property(
      "robot_name", "robot_1", {.description = "what its peers call it", .structural = mauve::ReadBy::core});
  mauve::Property<std::string>& peers = property(
      "peers", "",
      {.description = "the robots it explores with, separated by commas", .structural = mauve::ReadBy::core});
  mauve::Property<std::string>& map = property(
      "map", "", {.description = "YAML file: how large the world is", .structural = mauve::ReadBy::core});

  mauve::ReadPort<Pose2D>& pose = read_port<Pose2D>("pose");
  mauve::CallPort<void(MapReader)>& map_get = call_port<void(MapReader)>("map_get", kMapReaderType);
  mauve::ReadPort<PeerMessage>& inbox = read_port<PeerMessage>("inbox");
  mauve::WritePort<PeerMessage>& outbox = write_port<PeerMessage>(
      "outbox", {.on_commit = mauve::OutputPolicy::hold, .on_stop = mauve::OutputPolicy::hold});
  mauve::WritePort<Point>& goal = write_port<Point>(
      "goal", {.on_commit = mauve::OutputPolicy::hold, .on_stop = mauve::OutputPolicy::hold});
  mauve::WritePort<Bool>& done = write_port<Bool>(
      "done", {.on_commit = mauve::OutputPolicy::hold, .on_stop = mauve::OutputPolicy::hold});
};

/// What both algorithms share: all but the decision. Replacing one by the other carries over everything: the
/// goal and the way left to it, the merged map, the peers' last claims.
class ExplorationCoreBase : public mauve::Core<ExplorationShell> {
 public:
  /// Hears the peers, takes over the own map's changes and looks for frontiers. [rt]
  void look();
  /// Takes a goal if one is wanted and to be had. [rt]
  void decide();
  /// Tells the peers. [rt]
  void tell();

  /// Refuses another map or another set of peers. [rt]
  bool adopt(const mauve::CoreBase& old) override;
  void take(mauve::CoreBase& old) noexcept override;

 protected:
  bool configure_hook() override;
  void cleanup_hook() override;
  virtual bool choose(Explorer& explorer) noexcept = 0;

 private:
  std::unique_ptr<Explorer> explorer_;
  std::unique_ptr<PeerMessage> message_;
  std::string robot_and_peers_;
};

/// Takes no goal before all peers have answered.
class ExplorationCore final : public ExplorationCoreBase {
 protected:
  bool choose(Explorer& explorer) noexcept override { return explorer.decide_together(clock_ns()); }
};

/// Decides alone; goes on telling the peers, so that they hear it when the link is back.
class LocalExplorationCore final : public ExplorationCoreBase {
 protected:
  bool choose(Explorer& explorer) noexcept override { return explorer.decide_alone(clock_ns()); }
};

struct ExplorationFsm : mauve::Fsm<ExplorationShell, ExplorationCoreBase> {
  void define() override;
};

}  // namespace mauve_examples
