// SPDX-License-Identifier: LGPL-3.0-or-later
// What the library mauve_tutorials offers; the package's plugins.txt lists the same names.
#include "accelerando.hpp"
#include "metronome.hpp"

MAUVE_PLUGINS(registry) {
  using namespace mauve_tutorials;
  registry.type<Beat>();
  registry.shell<MetronomeShell>("mauve_examples/MetronomeShell");
  registry.core<Metronome>("mauve_examples/Metronome", "mauve_examples/MetronomeShell");
  registry.core<Accelerando>("mauve_examples/Accelerando", "mauve_examples/MetronomeShell");
  registry.fsm<MetronomeFsm>("mauve_examples/MetronomeFsm", "mauve_examples/MetronomeShell");
}
