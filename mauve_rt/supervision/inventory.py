"""What ~/list_components says of an executor: enough to tell whether the effect of any step is in place."""

import math
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field

from mauve_rt.model.step_kinds import STEP_KINDS
from mauve_rt.model.steps import Step
from mauve_rt.yaml.text import YamlError, read_yaml


@dataclass(frozen=True, kw_only=True)
class ListedComponent:
    """A component as ~/list_components shows it."""

    state: str
    shell: str = ""
    core: str = ""
    fsm: str = ""
    properties: Mapping[str, str] = field(default_factory=dict)  # values as YAML text
    connections: Mapping[str, str] = field(default_factory=dict)  # resource.service by port; empty: none

    def shows(self, step: Step) -> bool:
        """Whether what a step asks of this component is so already."""
        kind = STEP_KINDS[step.kind]
        match kind.name:
            case "":
                return self.state in kind.leaves
            case "property":
                return step.name in self.properties and _same(self.properties[step.name], step.value)
            case "port":
                wanted = step.value if kind.value else ""  # of a disconnect: nothing
                return step.name in self.connections and _same(self.connections[step.name], wanted)
            case part:
                return step.name == {"core": self.core, "fsm": self.fsm, "shell": self.shell}[part]


@dataclass(frozen=True)
class Inventory:
    """Components and resources of an executor."""

    instance_id: str
    components: Mapping[str, ListedComponent]
    resources: Collection[str] = ()

    def shows(self, steps: Iterable[Step]) -> bool:
        """Whether what every step asks for is so already."""
        return all(self._shows_step(step) for step in steps)

    def _shows_step(self, step: Step) -> bool:
        kind = STEP_KINDS[step.kind]
        if kind.is_about_resource:
            return (step.target in self.resources) is not kind.removes
        component = self.components.get(step.target)
        if kind.target == "new component" or kind.removes:
            return (component is not None) is not kind.removes
        return component is not None and component.shows(step)


def _same(one: str, other: str) -> bool:
    """Whether two texts are the same value in YAML."""
    first, second = _value(one), _value(other)
    numbers = (int, float)
    if isinstance(first, bool) or isinstance(second, bool):
        return first is second
    if isinstance(first, numbers) and isinstance(second, numbers):
        return math.isclose(first, second, rel_tol=1e-9)
    return first == second


def _value(text: str) -> object:
    try:
        return read_yaml(text)
    except YamlError:  # such as text with quotes in it: it is what it is
        return text.removeprefix("'").removesuffix("'")
