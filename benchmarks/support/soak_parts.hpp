// SPDX-License-Identifier: LGPL-3.0-or-later
// What random transactions change: a shell with two ports, and two of each part to change between.
#pragma once

#include <string>

#include "mauve_rt/mauve_rt.hpp"

#include "support/values.hpp"

namespace bench {

struct SoakShell : mauve::Shell {
  mauve::Property<std::int64_t>& period_us =
      property("period_us", 1000, {.unit = "us", .structural = mauve::ReadBy::fsm});
  mauve::Property<double>& gain = property("gain", 1.0, {.minimum = 0.0, .maximum = 10.0});
  mauve::ReadPort<Small>& input = read_port<Small>("input").optional();
  mauve::WritePort<Small>& output = write_port<Small>("output").optional();
};
struct OtherSoakShell : SoakShell {};

struct SoakCore : mauve::Core<SoakShell> {
  virtual void work() {
    const Small found = shell().input.read().value;
    shell().output.write({found.first + 1, found.second + 1});
  }
  std::string description() const override { return "core soak"; }
};
struct OtherSoakCore : SoakCore {};
/// Never takes over.
struct RefusingSoakCore : SoakCore {
  bool adopt(const mauve::CoreBase& /*old*/) override { return false; }
};

/// Once a period.
struct SoakFsm : mauve::Fsm<SoakShell, SoakCore> {
  void define() override {
    mauve::State& work = execution("Work", "work", &SoakCore::work);
    mauve::State& rest = wait("Rest", length_ns());
    set_initial(work);
    next(work, rest);
    next(rest, work);
  }
  virtual mauve::time_ns_t length_ns() { return mauve::us_to_ns(shell().period_us); }
};
/// Every other one.
struct OtherSoakFsm : SoakFsm {
  mauve::time_ns_t length_ns() override { return 2 * mauve::us_to_ns(shell().period_us); }
};

inline void register_soak_parts(mauve::PluginRegistry& registry) {
  registry.type<Small>();
  registry.shell<SoakShell>("soak/Shell");
  registry.shell<OtherSoakShell>("soak/OtherShell");
  registry.core<SoakCore>("soak/Core", "soak/Shell");
  registry.core<OtherSoakCore>("soak/OtherCore", "soak/Shell");
  registry.core<RefusingSoakCore>("soak/Refusing", "soak/Shell");
  registry.fsm<SoakFsm>("soak/Fsm", "soak/Shell");
  registry.fsm<OtherSoakFsm>("soak/OtherFsm", "soak/Shell");
}

}  // namespace bench
