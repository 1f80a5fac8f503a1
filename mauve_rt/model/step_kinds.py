"""The kinds of steps: what target, name and value of each mean, and what it leaves behind. A line a kind.

All who take, check, show or tell steps read this table: a kind that needs no more than its component and a
plain value needs nothing else in Python. What the kernel does at it: kernel/change/steps/.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

Target = Literal["component", "new component", "resource", "new resource", "all"]
Name = Literal["", "core", "fsm", "shell", "property", "port"]
Value = Literal["", "scalar", "resource.service", "section"]


@dataclass(frozen=True, kw_only=True)
class StepKind:
    """What a step of this kind is about."""

    target: Target = "component"
    name: Name = ""  # what of the target; empty: none
    value: Value = ""  # what its YAML text is; section: what stands below a name in the architecture file
    leaves: tuple[str, ...] = ()  # states of the component that show that it was done
    removes: bool = False  # its target
    needs_running: bool = False  # a rule with such a step waits until its component runs
    changes_parameters: bool = False  # those of the executor's node
    is_prepared: bool = True  # an executor can make it ready for a rule of its own, so that it only commits

    @property
    def needs_value(self) -> bool:
        """Whether there must be a value: a scalar may be an empty text."""
        return self.value in ("resource.service", "section")

    @property
    def is_structural(self) -> bool:
        """Whether it adds, removes or wires something: such changes are committed one after the other."""
        return self.removes or self.target.startswith("new") or self.name in ("shell", "port")

    @property
    def is_about_resource(self) -> bool:
        """Whether its target is a resource."""
        return self.target in ("resource", "new resource")


STEP_KINDS: Mapping[str, StepKind] = {
    "replace_core": StepKind(name="core", needs_running=True),
    "replace_fsm": StepKind(name="fsm", needs_running=True),
    "replace_shell": StepKind(name="shell", needs_running=True, changes_parameters=True),
    "set_property": StepKind(name="property", value="scalar", needs_running=True, changes_parameters=True),
    "connect": StepKind(name="port", value="resource.service"),
    "disconnect": StepKind(name="port"),
    "add_component": StepKind(
        target="new component", value="section", changes_parameters=True, is_prepared=False
    ),
    "remove_component": StepKind(removes=True, changes_parameters=True),
    "add_resource": StepKind(target="new resource", value="section", is_prepared=False),
    "remove_resource": StepKind(target="resource", removes=True),
    "start": StepKind(leaves=("RUNNING",)),
    "stop": StepKind(leaves=("STOPPED",)),
    "configure": StepKind(leaves=("STOPPED", "RUNNING"), is_prepared=False),
    "resynchronise": StepKind(target="all", is_prepared=False),
}
