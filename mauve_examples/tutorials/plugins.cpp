// SPDX-License-Identifier: LGPL-3.0-or-later
// What the library mauve_tutorials offers; the package's plugins.txt lists the same names.
#include "accelerando.hpp"
#include "metronome.hpp"
#include "pendulum.hpp"

MAUVE_PLUGINS(registry) {
  using namespace mauve_tutorials;
  registry.type<Beat>();
  registry.shell<MetronomeShell>("mauve_examples/MetronomeShell");
  registry.core<Metronome>("mauve_examples/Metronome", "mauve_examples/MetronomeShell");
  registry.core<Accelerando>("mauve_examples/Accelerando", "mauve_examples/MetronomeShell");
  registry.fsm<MetronomeFsm>("mauve_examples/MetronomeFsm", "mauve_examples/MetronomeShell");
  registry.shell<PendulumShell>("mauve_examples/PendulumShell");
  registry.core<Pendulum>("mauve_examples/Pendulum", "mauve_examples/PendulumShell");
  registry.fsm<PendulumFsm>("mauve_examples/PendulumFsm", "mauve_examples/PendulumShell");
  registry.shell<AngleControllerShell>("mauve_examples/AngleControllerShell");
  registry.core<SoftController>("mauve_examples/SoftController", "mauve_examples/AngleControllerShell");
  registry.core<FirmController>("mauve_examples/FirmController", "mauve_examples/AngleControllerShell");
  registry.fsm<AngleControllerFsm>("mauve_examples/AngleControllerFsm",
                                   "mauve_examples/AngleControllerShell");
}
