// SPDX-License-Identifier: LGPL-3.0-or-later
// Another shell, with a new instance of the fsm.
#include "change/steps/step_kind.hpp"

namespace mauve {

constexpr StepKind steps::replace_shell{
    .name = "replace_shell",
    .element = "shell",
    .is_structural = true,
    .words = part_words<Shell>,
    .draft = [](Draft& draft, TransactionStep& step) {
      std::unique_ptr<Shell> shell = brings<Shell>(step) ? take(value_of<std::unique_ptr<Shell>>(step))
                                                         : draft.registry().make_shell(step.name);
      DraftComponent& changed = replacing(draft, step.target);
      try {
        changed.component->set_up_ports(*shell);
      } catch (const Error& failure) {
        rethrow_as_of(failure, step.target, draft.step());
      }
      changed.fresh.shell = std::move(shell);
      for (auto& [name, wire] : changed.wires) {
        const PortBase* const port = changed.fresh.shell->find_port(name);
        wire.frames = port == nullptr ? nullptr : port->frames();
      }
      changed.shell_step = draft.step();
      // What steps before have set, they have set of this shell too.
      const std::map<std::string, DraftProperty> set = changed.properties;
      for (const auto& [name, property] : set) draft.set_property(changed, name, property.value);
    }};

}  // namespace mauve
