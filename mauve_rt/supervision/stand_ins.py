"""An architecture for rules that are tried without one: stand-ins for all that the rules name. Knows no ROS.

Their parts do nothing. They have the names that steps give, and exist in the registry of one runtime only.
Ports read or write; one whose service has another name is taken for one that reads.
"""

import json
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from typing import Any

from mauve_rt._kernel import PluginRegistry, Simulation
from mauve_rt.control.simulated_runtime import SimulatedRuntime
from mauve_rt.control.wishes import assignment_of
from mauve_rt.errors import MauveError
from mauve_rt.file_schema.schema_errors import read_content
from mauve_rt.file_schema.yaml_file import YamlFile
from mauve_rt.model.architecture_file import ArchitectureModel, Overrides
from mauve_rt.model.plugins import PluginIndex, PluginLoader
from mauve_rt.model.schema import FragmentModel, PropertyValue
from mauve_rt.model.step_kinds import STEP_KINDS
from mauve_rt.model.steps import Step
from mauve_rt.parts.cores import Core
from mauve_rt.parts.fsms import Fsm
from mauve_rt.parts.ports import Property, ReadPort, WritePort
from mauve_rt.parts.shells import Shell
from mauve_rt.supervision.rules import Rule, RulesFile
from mauve_rt.yaml.text import YamlError, read_yaml

_SHELL, _CORE, _FSM = "stand_in/Shell", "stand_in/Core", "stand_in/Fsm"
_RESOURCE = "stand_in"
_TYPE = "std_msgs/msg/Empty"
_PERIOD_NS = 100_000_000
_PART_KINDS = ("core", "fsm", "shell")


def is_stand_in(step: Step) -> bool:
    """Whether a step puts in what no rule names."""
    return step.name in (_SHELL, _CORE, _FSM)


class StandInRuntime(SimulatedRuntime):
    """The components and resources that the rules of a file name, before any of the rules acts.

    A value that the file gives in `undo` is there from the start on.
    """

    def __init__(self, simulation: Simulation, file: RulesFile) -> None:
        self.registry = PluginRegistry()  # of this runtime alone
        self._stand_ins = _StandIns(file.rules.rules)
        super().__init__(simulation, lambda: self._stand_ins.model(file))

    def configure(self) -> None:
        """Register the stand-ins, and build their architecture."""
        loader = PluginLoader(self.registry, PluginIndex.installed())
        for type_name in self._stand_ins.types():  # before there are ports in Python of a type in C++
            with suppress(MauveError):  # which the rule's step tells
                loader.require_type(type_name)
        self._stand_ins.register(self.registry)
        super().configure()

    def activate(self) -> None:
        """Start all but the components that rules start."""
        super().activate()
        for name in sorted(self._stand_ins.stopped):
            self.host.stop(name)


class _Idle(Fsm[Any, Any]):
    def define(self) -> None:
        wait = self.wait("Wait", _PERIOD_NS)
        self.set_initial(wait)
        self.next(wait, wait)


class _StandIns:
    """What the steps of rules name."""

    def __init__(self, rules: Iterable[Rule]) -> None:
        self.stopped: set[str] = set()
        self._components: dict[str, dict[str, Any]] = {}
        self._sections: dict[str, Mapping[str, Any]] = {}  # of resources that a step adds
        self._resources: set[str] = set()
        self._connections: dict[tuple[str, str], str] = {}
        self._shells = {_SHELL}
        self._parts = {("core", _CORE): _SHELL, ("fsm", _FSM): _SHELL}  # the shell that each is for
        self._values: dict[str, list[PropertyValue]] = {}  # of properties, by name
        self._ports: dict[str, set[str]] = {}  # what each connects to
        all_rules = list(rules)
        lists = [steps for rule in all_rules for steps in (rule.do, rule.steps("undo"))]
        for steps in lists:
            self._note(steps)
        for leaf in (leaf for rule in all_rules for leaf in rule.when.leaves()):
            if component := str(leaf.parameters.get("component") or ""):
                self._component(component)
        done = [step for rule in all_rules for step in rule.do]
        undone = [step for rule in all_rules for step in rule.steps("undo")]
        for step in done:
            if step.kind == "disconnect":
                self._connections.setdefault((step.target, step.name), f"{_RESOURCE}.read")
        for step in undone:
            self._begin_with(step)
        stops = {step.target for step in done if step.kind == "stop"}
        self.stopped |= {step.target for step in done if step.kind == "start"} - stops
        self._added = {step.target for step in done if STEP_KINDS[step.kind].target.startswith("new")}
        self._components = {name: each for name, each in self._components.items() if name not in self._added}
        self.stopped -= self._added
        self._add_resources()

    def model(self, file: RulesFile) -> ArchitectureModel:
        """As an architecture file would say it."""
        content = {
            "mauve": 1,
            "components": self._components,
            "resources": {
                name: {"kind": "shared_data", "type": self._type_of(name)} for name in sorted(self._resources)
            },
            "connections": [
                [f"{component}.{port}", service] for (component, port), service in self._connections.items()
            ],
        }
        text = YamlFile(file.path, text=json.dumps(content))
        return ArchitectureModel(text, read_content(FragmentModel, text), Overrides())

    def types(self) -> set[str]:
        """Of ports."""
        return {self._port_type(name) for name in self._ports}

    def register(self, registry: PluginRegistry) -> None:
        """Their parts."""
        members = {name: _property(values) for name, values in self._values.items()}
        shell = type("StandInShell", (Shell,), members | {name: self._port(name) for name in self._ports})
        for name in self._shells:
            registry.shell(name, shell)
        for (kind, name), its_shell in self._parts.items():
            if kind == "core":
                registry.core(name, Core, its_shell)
            else:
                registry.fsm(name, _Idle, its_shell)

    # ---- what there is

    def _note(self, steps: list[Step]) -> None:
        shells = {step.target: step.name for step in steps if STEP_KINDS[step.kind].name == "shell"}
        for step in steps:
            kind = STEP_KINDS[step.kind]
            if kind.target == "component":
                self._note_step(step, kind.name, shells.get(step.target, _SHELL))
            elif kind.target == "new component":
                self._note_section(_section(step))
            elif kind.target == "new resource":
                self._sections[step.target] = _section(step)
                self._resources.add(step.target)
            elif kind.target == "resource":
                self._resources.add(step.target)

    def _note_step(self, step: Step, element: str, shell: str) -> None:
        component = self._component(step.target)
        if element in _PART_KINDS:
            self._note_part(element, step.name, shell)
            if step.name not in component["alternatives"]:
                component["alternatives"].append(step.name)
        elif element == "property":
            value = assignment_of(step).value
            self._values.setdefault(step.name, []).append("" if value is None else value)
        elif element == "port":
            service = assignment_of(step).value if step.kind == "connect" else None
            self._ports.setdefault(step.name, set()).update([str(service)] if service else [])

    def _note_part(self, kind: str, name: str, shell: str) -> None:
        if kind == "shell":
            self._shells.add(name)
        else:
            self._parts.setdefault((kind, name), shell)

    def _note_section(self, section: Mapping[str, Any]) -> None:
        """Of a component that a step adds."""
        shell = str(section.get("shell") or _SHELL)
        self._shells.add(shell)
        for kind, key in (("core", "core"), ("core", "fallback"), ("fsm", "fsm")):
            if name := section.get(key):
                self._note_part(kind, str(name), shell)
        for name, value in dict(section.get("properties") or {}).items():
            self._values.setdefault(str(name), []).append(value)

    def _component(self, name: str) -> dict[str, Any]:
        parts = {"shell": _SHELL, "core": _CORE, "fsm": _FSM}
        return self._components.setdefault(name, {**parts, "alternatives": [], "properties": {}})

    def _begin_with(self, step: Step) -> None:
        """What an undo leaves was there before."""
        element = STEP_KINDS[step.kind].name
        if STEP_KINDS[step.kind].target != "component":
            return
        component = self._component(step.target)
        if element in _PART_KINDS:
            component[element] = step.name
        elif element == "property":
            component["properties"][step.name] = assignment_of(step).value
        elif step.kind == "connect":
            self._connections[step.target, step.name] = str(assignment_of(step).value)
        elif step.kind == "disconnect":
            self._connections.pop((step.target, step.name), None)
        elif step.kind == "stop":
            self.stopped.add(step.target)

    # ---- ports, properties and resources

    def _add_resources(self) -> None:
        services = [*self._connections.values(), *(each for ports in self._ports.values() for each in ports)]
        self._resources |= {service.partition(".")[0] for service in services}
        self._resources -= self._added
        self._connections = {
            (component, port): service
            for (component, port), service in self._connections.items()
            if self._added.isdisjoint((component, service.partition(".")[0]))
        }

    def _type_of(self, resource: str) -> str:
        """Of the ports that connect to it."""
        ports = (
            self._port_type(name) for name, services in self._ports.items() if _connects(services, resource)
        )
        return next(ports, _TYPE)

    def _port_type(self, name: str) -> str:
        resources = (service.partition(".")[0] for service in sorted(self._ports[name]))
        types = (str(self._sections[each].get("type") or "") for each in resources if each in self._sections)
        return next(filter(None, types), _TYPE)

    def _port(self, name: str) -> ReadPort[Any] | WritePort[Any]:
        writes = any(service.endswith(".write") for service in self._ports[name])
        return (WritePort if writes else ReadPort)(self._port_type(name), optional=True)


def _connects(services: Iterable[str], resource: str) -> bool:
    return any(service.partition(".")[0] == resource for service in services)


def _section(step: Step) -> Mapping[str, Any]:
    """What a step adds; one that is no YAML is refused when it is tried."""
    try:
        section = read_yaml(step.value)
    except YamlError:
        return {}
    return section if isinstance(section, dict) else {}


def _property(values: list[PropertyValue]) -> Property[Any]:
    """One of their type whose first value is none of them, where there is such a value."""
    like = next((value for value in values if isinstance(value, float)), values[0])
    return Property(next((value for value in _candidates(like, len(values)) if value not in values), like))


def _candidates(like: PropertyValue, others: int) -> Iterator[PropertyValue]:
    if isinstance(like, bool):
        yield not like
    elif isinstance(like, str):
        yield from ("before" * number for number in range(1, others + 2))
    else:
        yield from (type(like)(number) for number in range(others + 1))
