// SPDX-License-Identifier: LGPL-3.0-or-later
// The component Exploration with two cores, for Listing 3: one waits for the other robots, one does not.
#pragma once

#include <cstdint>

#include "mauve_rt/mauve_rt.hpp"

#include "mauve_examples/types.hpp"

namespace listings {

using mauve_examples::Point;

struct ExplorationShell : mauve::Shell {
  mauve::WritePort<Point>& goal = write_port<Point>("goal", {.on_stop = mauve::OutputPolicy::hold});
};

/// What both algorithms share. `decide` is what a core of this component must be able to do.
class ExplorationBase : public mauve::Core<ExplorationShell> {
 public:
  virtual void decide() = 0;

 protected:
  std::int64_t decisions() const noexcept { return decisions_; }
  void send(const Point& goal) {
    ++decisions_;
    shell().goal.write(goal);
  }

 private:
  std::int64_t decisions_{0};
};

/// Nobody answers here, so this one never gets beyond its first goal.
class ExplorationCore final : public ExplorationBase {
 public:
  void decide() override {
    if (decisions() == 0) send({2.0, 0.0, 0.0});
  }
};

/// Takes one goal after the other, around a square of 2 m.
class LocalExplorationCore final : public ExplorationBase {
 public:
  void decide() override {
    const std::int64_t corner = decisions() % 4;
    send({corner == 0 || corner == 3 ? 2.0 : 0.0, corner < 2 ? 2.0 : 0.0, 0.0});
  }
};

struct ExplorationFsm : mauve::Fsm<ExplorationShell, ExplorationBase> {
  void define() override {
    mauve::State& decide = execution("Decide", "decide", &ExplorationBase::decide);
    mauve::State& pause = wait("Pause", mauve::ms_to_ns(100));
    set_initial(decide);
    next(decide, pause);
    next(pause, decide);
  }
};

}  // namespace listings
