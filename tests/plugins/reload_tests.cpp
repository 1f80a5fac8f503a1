// SPDX-License-Identifier: LGPL-3.0-or-later
// A package of plug-ins that the tests of reloads build in several variants, each by macros of its own.
#include "reload_tests.hpp"

#include <limits>
#include <stdexcept>

namespace reload_tests {

/// One for the process by the C++ standard: old and new code of one library must not share it.
inline double step = first_step();

struct LoopShell : mauve::Shell {
#ifdef OTHER_SHELL
  mauve::Property<double>& limit = property("limit", 10.0);
  mauve::ReadPort<Sum>& bias = read_port<Sum>("bias").optional();
#endif
  mauve::Property<double>& gain = property("gain", first_gain());
#ifdef WITHOUT_PORT
  mauve::WritePort<Sum>& level = write_port<Sum>("level");
#else
  mauve::WritePort<Sum>& sum = write_port<Sum>("sum");
#endif
};

class Loop : public mauve::Core<LoopShell> {
#ifdef OTHER_METHODS
 public:
  virtual void first() {}
#endif

 protected:
  double sum() const { return sum_; }
#ifdef OTHER_STATE
  MAUVE_STATE(sum_, rounds_, history_)
  std::array<double, 4> history_{};
  std::int32_t rounds_{0};
#else
  MAUVE_STATE(sum_, rounds_)
  std::int64_t rounds_{0};
#endif
  double sum_{0.0};

#ifdef ADOPTS
  bool adopt(const mauve::CoreBase& old) override { return dynamic_cast<const Loop*>(&old) != nullptr; }
#endif

 public:
  virtual void act() {
    sum_ += step * shell().gain.value();
    ++rounds_;
#ifdef THROWS
    if (rounds_ > 20) throw std::runtime_error("the new code is broken");
#endif
#ifndef WITHOUT_PORT
    shell().sum.write({sum_});
#endif
  }
};

/// Of a library of its own, which is not built again.
class Other : public Loop {};
struct WideShell : LoopShell {};

// Each does one thing wrong, at its third release.

class Misbehaving : public Loop {
 protected:
  bool is_time() { return ++releases_ == 3; }

 private:
  int releases_{0};
};
class Throws : public Misbehaving {
 public:
  void act() override {
    if (is_time()) throw std::runtime_error("the new code is broken");
    Loop::act();
  }
};
class Nan : public Misbehaving {
 public:
  void act() override {
    Loop::act();
#ifndef WITHOUT_PORT
    if (is_time()) shell().sum.write({std::numeric_limits<double>::quiet_NaN()});
#endif
  }
};
class Loud : public Misbehaving {
 public:
  void act() override {
    Loop::act();
#ifndef WITHOUT_PORT
    if (is_time()) shell().sum.write({1e9});
#endif
  }
};

/// Adds a tenth more each time.
class Louder : public Loop {
 public:
  void act() override {
    Loop::act();
#ifndef WITHOUT_PORT
    shell().sum.write({1.1 * sum()});
#endif
  }
};

/// Without values.
struct Box : mauve::Resource {
  Box() : Resource("reload_tests/Box", "") {}
};

class LoopFsm : public mauve::Fsm<LoopShell, Loop> {
  void define() override {
    auto& act = execution("act", "act", &Loop::act);
    auto& pause = wait("pause", mauve::ms_to_ns(1));
    next(act, pause);
    next(pause, act);
    set_initial(act);
  }
};

}  // namespace reload_tests

#ifdef OTHER_LIBRARY
MAUVE_PLUGINS(registry) {
  registry.core<reload_tests::Other>("reload_tests/Other", "reload_tests/LoopShell");
  registry.shell<reload_tests::WideShell>("reload_tests/WideShell");
}
#else
MAUVE_PLUGINS(registry) {
  reload_tests::register_types(registry);
  registry.shell<reload_tests::LoopShell>("reload_tests/LoopShell");
#ifndef WITHOUT_CORE
  registry.core<reload_tests::Loop>("reload_tests/Loop", "reload_tests/LoopShell");
#endif
  registry.fsm<reload_tests::LoopFsm>("reload_tests/LoopFsm", "reload_tests/LoopShell");
  registry.resource<reload_tests::Box>("reload_tests/Box");
#ifdef NEW_CORE
  registry.core<reload_tests::Other>("reload_tests/New", "reload_tests/LoopShell");
  registry.core<reload_tests::Throws>("reload_tests/Throws", "reload_tests/LoopShell");
  registry.core<reload_tests::Louder>("reload_tests/Louder", "reload_tests/LoopShell");
  registry.core<reload_tests::Nan>("reload_tests/Nan", "reload_tests/LoopShell");
  registry.core<reload_tests::Loud>("reload_tests/Loud", "reload_tests/LoopShell");
#endif
}
#endif
