"""The components of a running executor as steps will leave them, for the timing analysis.

The executor must not configure a second copy of what drives a robot. So only changed parts are made, in an
architecture of their own that is never configured, and only to ask for their states.
"""

from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from mauve_rt._kernel import Architecture, ComponentDescription, DescribedState, Transaction
from mauve_rt.analysis.machines import Machine
from mauve_rt.control.change_timing import with_times_of_core
from mauve_rt.control.runtime import Runtime
from mauve_rt.model.component_machines import is_python_part
from mauve_rt.model.fragment import fragment
from mauve_rt.model.resource_parts import describe_resource
from mauve_rt.model.schema import ComponentModel, PropertyValue
from mauve_rt.model.step_kinds import STEP_KINDS, StepKind
from mauve_rt.model.steps import Step
from mauve_rt.model.threads import uses_of
from mauve_rt.yaml.text import read_yaml

_Connection = tuple[str, str]
"""A resource and its service."""


class _Resource(NamedTuple):
    kind: str
    longest_hold_ns: int


class _Port(NamedTuple):
    """With the fields of a PortDescription that the analysis takes."""

    name: str
    type: str
    resource: str
    wait_free: bool
    longest_hold_ns: int


class _Described(NamedTuple):
    """With the fields of a ComponentDescription that the analysis takes."""

    name: str
    shell: str
    core: str
    fsm: str
    cpus: Sequence[int]
    priority: int
    policy: str
    period_ns: int
    offset_ns: int
    deadline_ns: int
    overrun: str
    states: Sequence[Any]
    ports: Sequence[Any]


@dataclass
class _Part:
    """A component as the steps so far leave it."""

    name: str
    model: ComponentModel
    shell: str
    core: str
    fsm: str
    properties: dict[str, PropertyValue]
    wires: dict[str, _Connection] = field(default_factory=dict)
    before: ComponentDescription | None = None
    """None: it is added."""
    is_made: bool = False
    """Whether it gets new instances of its parts."""
    has_new_fsm: bool = False

    @classmethod
    def of(cls, part: ComponentDescription, model: ComponentModel) -> "_Part":
        properties = {item.name: item.value for item in part.properties}
        wires = {port.name: (port.resource, port.service) for port in part.ports if port.resource}
        return cls(part.name, model, part.shell, part.core, part.fsm, properties, wires, part)


class ChangedParts:
    """What steps leave of the components and resources that there are."""

    def __init__(
        self,
        steps: Iterable[Step],
        runtime: Runtime,
        parts: Sequence[ComponentDescription],
        uses: Mapping[str, Collection[str]],
    ) -> None:
        """Of steps that the executor accepts; `uses`: of resources, as `uses_of`."""
        self._runtime = runtime
        self._before = parts
        self._resources = {
            resource.name: _Resource(resource.kind, resource.longest_hold_ns)
            for resource in runtime.described_resources()
        }
        self.uses = {resource: {*sides} for resource, sides in uses.items()}
        self._parts = {
            part.name: _Part.of(part, model)
            for part in parts
            if (model := runtime.declared(part.name)) is not None
        }
        for step in steps:
            self._take(step)

    def cores(self) -> dict[str, str]:
        """Of the components that were there before."""
        return {part.name: part.core for part in self._parts.values() if part.before is not None}

    def machines(self, known: Mapping[str, Machine]) -> list[Machine]:
        """Of each component; `known`: those of components before the change.

        Raises:
            MauveError: the states of a component cannot be so.
        """
        before = Counter((port.resource, port.service) for part in self._before for port in part.ports)
        after = Counter(wire for part in self._parts.values() for wire in part.wires.values())
        moved = {wire for wire in before | after if before[wire] != after[wire]}
        return [self._machine(part, known.get(part.name), after, moved) for part in self._parts.values()]

    def _machine(
        self, part: _Part, known: Machine | None, users: Counter[_Connection], moved: Collection[_Connection]
    ) -> Machine:
        live = {port.name: port for port in part.before.ports} if part.before is not None else {}
        is_rewired = part.wires != {
            name: (port.resource, port.service) for name, port in live.items() if port.resource
        }
        if known is not None and not (part.is_made or is_rewired or {*part.wires.values()} & {*moved}):
            return known
        if part.before is None or part.is_made:
            described, states = self._made(part)
        else:
            described, states = part.before, part.before.states
        types = {port.name: port.type for port in described.ports}
        ports = [
            live[name]
            if name in live and wire not in moved and (live[name].resource, live[name].service) == wire
            else self._port(name, types.get(name, ""), wire, users[wire])
            for name, wire in part.wires.items()
        ]
        told = _Described(
            part.name,
            part.shell,
            part.core,
            part.fsm,
            described.cpus,
            described.priority,
            part.before.policy if part.before is not None else "",
            part.model.period_ns if part.has_new_fsm or part.before is None else part.before.period_ns,
            described.offset_ns,
            described.deadline_ns,
            described.overrun,
            states,
            ports,
        )
        kinds = {name: resource.kind for name, resource in self._resources.items()}
        machine = Machine.of(told, is_python=is_python_part(told, self._runtime.index), kinds=kinds)
        return with_times_of_core(machine, told, part.model, self._runtime.registry)

    def _made(self, part: _Part) -> tuple[ComponentDescription, list[DescribedState]]:
        architecture = Architecture(self._runtime.registry)
        transaction = Transaction()
        names = {item.name for item in self._runtime.registry.describe_shell(part.shell).properties}
        properties = {name: value for name, value in part.properties.items() if name in names}
        settings = part.model.task_settings()
        transaction.add_component(
            part.name, part.shell, part.core, part.fsm, properties=properties, **settings
        )
        architecture.commit(transaction)
        return architecture.components()[0], architecture.previewed_states(part.name)

    def _port(self, name: str, type_name: str, wire: _Connection, users: int) -> _Port:
        hold_ns = self._resources[wire[0]].longest_hold_ns
        return _Port(name, type_name, wire[0], self._is_wait_free(wire, users), hold_ns)

    def _is_wait_free(self, wire: _Connection, users: int) -> bool:
        """Whether its users take no lock; where that is not known, they do."""
        resource, service = wire
        if (self._resources[resource].kind, service) == ("shared_data", "read"):
            return True
        is_written = "subscribes" in self.uses.get(resource, ())
        return users + is_written == 1

    # ---- steps

    def _take(self, step: Step) -> None:
        kind = STEP_KINDS[step.kind]
        if kind.target == "new component":
            self._add_component(step)
        elif kind.target == "new resource":
            self._add_resource(step)
        elif kind.removes:
            self._parts.pop(step.target, None)
            self._resources.pop(step.target, None)
            self.uses.pop(step.target, None)
        elif kind.name == "port":
            self._connect(step)
        elif kind.name == "property":
            value: Any = read_yaml(step.value)
            self._parts[step.target].properties[step.name] = value
        elif core := self._core(step, kind):
            part = self._parts[step.target]
            part.core, part.is_made = core, True
        elif kind.name in ("fsm", "shell"):
            part = self._parts[step.target]
            setattr(part, kind.name, step.name)
            part.is_made = part.has_new_fsm = True
        elif step.kind == "configure":
            part = self._parts[step.target]
            part.is_made = part.has_new_fsm = True
        # Others change no demand: a component that is stopped counts as if it ran.

    def _core(self, step: Step, kind: StepKind) -> str:
        """That a step puts in; empty: none."""
        if kind.name == "core":
            return "" if kind.value == "shadow" else step.name
        records = {
            "promote": [(each.component, each.core) for each in self._runtime.shadows()],
            "revert_core": [(each.component, each.from_core) for each in self._runtime.probations()],
        }.get(step.kind, [])
        return next((core for name, core in reversed(records) if name == step.target), "")

    def _add_component(self, step: Step) -> None:
        model = fragment(self._runtime.model, step.value, section="components", name=step.target)
        component = model.components[step.target]
        parts = component.shell, component.core, component.fsm
        properties = model.properties(step.target)
        self._parts[step.target] = _Part(step.target, component, *parts, properties, is_made=True)

    def _add_resource(self, step: Step) -> None:
        model = fragment(self._runtime.model, step.value, section="resources", name=step.target)
        resource = model.resources[step.target]
        found = describe_resource(resource, self._runtime.registry)
        hold_ns = resource.longest_hold_ns or found.longest_hold_ns
        self._resources[step.target] = _Resource(resource.kind, hold_ns)
        self.uses |= uses_of(model)

    def _connect(self, step: Step) -> None:
        wires = self._parts[step.target].wires
        wires.pop(step.name, None)
        if step.value:
            resource, _, service = str(read_yaml(step.value)).partition(".")
            wires[step.name] = (resource, service)
