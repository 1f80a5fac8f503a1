"""The kinds of steps: what target, name and value of each mean, and what it leaves behind. A line a kind.

All who take, check, show or tell steps read this table: a kind that needs no more than its component and a
plain value needs nothing else in Python. What the kernel does at it: kernel/change/steps/.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

Target = Literal["component", "new component", "resource", "new resource", "all"]
Name = Literal["", "core", "fsm", "shell", "property", "port"]
Value = Literal["", "scalar", "resource.service", "section", "replacement", "shadow", "promotion"]


@dataclass(frozen=True, kw_only=True)
class StepKind:
    """What a step of this kind is about."""

    what: str  # the effect in words, for the reference documentation
    target: Target = "component"
    name: Name = ""  # what of the target; empty: none
    value: Value = ""  # what its YAML text is; section: what stands below a name in the architecture file
    leaves: tuple[str, ...] = ()  # states of the component that show that it was done
    removes: bool = False  # its target
    needs_running: bool = False  # a rule with such a step waits until its component runs
    changes_parameters: bool = False  # those of the executor's node
    protects: bool = False  # it is never refused for its timing: it asks for less, or goes back
    is_prepared: bool = True  # an executor can make it ready for a rule of its own, so that it only commits

    @property
    def needs_value(self) -> bool:
        """Whether there must be a value: a scalar may be an empty text."""
        return self.value in ("resource.service", "section", "shadow")

    @property
    def is_structural(self) -> bool:
        """Whether it adds, removes or wires something: such changes are committed one after the other."""
        return self.removes or self.target.startswith("new") or self.name in ("shell", "port")

    def element(self, name: str) -> str:
        """What of its target a step with that name sets, as in Architecture.authors()."""
        if self.name:
            return f"{self.name} {name}" if self.name in ("property", "port") else self.name
        return "state" if self.leaves else ""

    @property
    def is_about_resource(self) -> bool:
        """Whether its target is a resource."""
        return self.target in ("resource", "new resource")


STEP_KINDS: Mapping[str, StepKind] = {
    "replace_core": StepKind(
        what="replace the core; the component keeps its pending instant. With probation_s, revert_on and "
        "releases in the value the core is on probation: a violation puts the old core back. With bumpless "
        "it goes in only where its outputs are near those of the old core; with blend_s in it they go over "
        "linearly",
        name="core",
        value="replacement",
        needs_running=True,
    ),
    "revert_core": StepKind(
        what="put the old core of a core on probation back; without a probation nothing happens",
        protects=True,
    ),
    "shadow": StepKind(
        what="execute a candidate core in parallel with the core, on the same inputs and without effects",
        name="core",
        value="shadow",
        is_prepared=False,
    ),
    "end_shadow": StepKind(what="end the shadow of the component", is_prepared=False, protects=True),
    "promote": StepKind(
        what="replace the core by the candidate of the shadow; value: bumpless, fresh, or none",
        value="promotion",
        is_prepared=False,
    ),
    "replace_fsm": StepKind(what="replace the fsm", name="fsm", needs_running=True),
    "replace_shell": StepKind(
        what="replace the shell, with a new instance of the fsm",
        name="shell",
        needs_running=True,
        changes_parameters=True,
    ),
    "set_property": StepKind(
        what="set a property of the component",
        name="property",
        value="scalar",
        needs_running=True,
        changes_parameters=True,
    ),
    "connect": StepKind(
        what="connect a port to a service of a resource", name="port", value="resource.service"
    ),
    "disconnect": StepKind(what="disconnect a port", name="port"),
    "add_component": StepKind(
        what="add a component; value: its section of an architecture file",
        target="new component",
        value="section",
        changes_parameters=True,
        is_prepared=False,
    ),
    "remove_component": StepKind(
        what="stop and remove the component", removes=True, changes_parameters=True, protects=True
    ),
    "add_resource": StepKind(
        what="add a resource; value: its section of an architecture file",
        target="new resource",
        value="section",
        is_prepared=False,
    ),
    "remove_resource": StepKind(what="remove the resource", target="resource", removes=True, protects=True),
    "start": StepKind(what="start the component at its next instant", leaves=("RUNNING",)),
    "stop": StepKind(what="stop the component", leaves=("STOPPED",), protects=True),
    "configure": StepKind(
        what="configure the component again, for example after a fault",
        leaves=("STOPPED", "RUNNING"),
        is_prepared=False,
    ),
    "resynchronise": StepKind(what="give all components a new common epoch", target="all", is_prepared=False),
}
