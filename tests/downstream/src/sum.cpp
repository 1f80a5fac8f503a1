// SPDX-License-Identifier: LGPL-3.0-or-later
// Parts over generated messages: writes the sum of the joints' positions, every 10 ms.
#include <numeric>

#include <mauve_rt/mauve_rt.hpp>
#include <mauve_types/sensor_msgs/msg/joint_state.hpp>
#include <mauve_types/std_msgs/msg/float64.hpp>

namespace mauve_downstream {

using mauve::msg::sensor_msgs::JointState;
using mauve::msg::std_msgs::Float64;

struct SumShell : mauve::Shell {
  mauve::ReadPort<JointState>& joints = read_port<JointState>("joints");
  mauve::WritePort<Float64>& sum = write_port<Float64>("sum");
};

struct SumCore : mauve::Core<SumShell> {
  void act() {
    shell().joints.with([&](const JointState& joints) {
      shell().sum.write({.data = std::accumulate(joints.position.begin(), joints.position.end(), 0.0)});
    });
  }
};

struct SumFsm : mauve::PeriodicFsm<SumShell, SumCore> {
  void define() override {
    period(mauve::ms_to_ns(10));
    set_initial(periodic_state("Sum", "act", &SumCore::act));
  }
};

}  // namespace mauve_downstream

MAUVE_PLUGINS(registry) {
  registry.type<mauve_downstream::JointState>();
  registry.type<mauve_downstream::Float64>();
  registry.shell<mauve_downstream::SumShell>("mauve_downstream/SumShell");
  registry.core<mauve_downstream::SumCore>("mauve_downstream/Sum", "mauve_downstream/SumShell");
  registry.fsm<mauve_downstream::SumFsm>("mauve_downstream/SumFsm", "mauve_downstream/SumShell");
}
