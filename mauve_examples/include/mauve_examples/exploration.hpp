// SPDX-License-Identifier: LGPL-3.0-or-later
// Exploration: where to look next, 2 Hz. Two cores: one agrees with the peers, one decides alone.
#pragma once

#include <memory>

#include "mauve_examples/explorer.hpp"
#include "mauve_examples/model/exploration_core.hpp"
#include "mauve_examples/occupancy_map.hpp"

namespace mauve_examples {

/// What both algorithms share: all but the decision. Replacing one by the other carries over everything: the
/// goal and the way left to it, the merged map, the peers' last claims.
class ExplorationBase : public ExplorationCore {
 public:
  /// Hears the peers, takes over the own map's changes and looks for frontiers. [rt]
  void look() override;
  /// Takes a goal if one is wanted and to be had. [rt]
  void decide() override;
  /// Tells the peers. [rt]
  void tell() override;

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
class Exploration final : public ExplorationBase {
 protected:
  bool choose(Explorer& explorer) noexcept override { return explorer.decide_together(clock_ns()); }
};

/// Decides alone; goes on telling the peers, so that they hear it when the link is back.
class LocalExploration final : public ExplorationBase {
 protected:
  bool choose(Explorer& explorer) noexcept override { return explorer.decide_alone(clock_ns()); }
};

}  // namespace mauve_examples
