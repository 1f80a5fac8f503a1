// SPDX-License-Identifier: LGPL-3.0-or-later
// What the library mauve_figures offers; the package's plugins.txt lists the same names.
#include "work.hpp"

MAUVE_PLUGINS(registry) {
  using namespace mauve_figures;
  registry.shell<WorkShell>("mauve_examples/WorkShell");
  registry.core<Work>("mauve_examples/Work", "mauve_examples/WorkShell");
  registry.core<ShortWork>("mauve_examples/ShortWork", "mauve_examples/WorkShell");
  registry.fsm<WorkFsm>("mauve_examples/WorkFsm", "mauve_examples/WorkShell");
}
