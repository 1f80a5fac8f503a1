// SPDX-License-Identifier: LGPL-3.0-or-later
// Parts over a struct of this package: a leg that sets its foot one metre on, every 10 ms.
#include <mauve_downstream/leg.hpp>
#include <mauve_rt/mauve_rt.hpp>

namespace mauve_downstream {

struct LegShell : mauve::Shell {
  mauve::WritePort<Leg>& leg = write_port<Leg>("leg");
};

struct LegCore : mauve::Core<LegShell> {
  void act() {
    leg_.foot.x += 1.0;
    (void)leg_.name.assign("front left");
    (void)leg_.torque.resize(2);
    leg_.torque[0] = 2.0 * leg_.foot.x;
    leg_.torque[1] = -0.5;
    leg_.joints[1] = {.angle = 0.25, .is_hot = true};
    shell().leg.write(leg_);
  }

 private:
  Leg leg_;
};

struct LegFsm : mauve::PeriodicFsm<LegShell, LegCore> {
  void define() override {
    period(mauve::ms_to_ns(10));
    set_initial(periodic_state("Step", "act", &LegCore::act));
  }
};

}  // namespace mauve_downstream

MAUVE_PLUGINS(registry) {
  registry.type<mauve_downstream::Leg>();
  registry.shell<mauve_downstream::LegShell>("mauve_downstream/LegShell");
  registry.core<mauve_downstream::LegCore>("mauve_downstream/Leg", "mauve_downstream/LegShell");
  registry.fsm<mauve_downstream::LegFsm>("mauve_downstream/LegFsm", "mauve_downstream/LegShell");
}
