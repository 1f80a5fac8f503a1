"""The model of the parts that a package has registered: the reverse of generating code from a model.

Of generated parts it is the model that they were generated from, but for descriptions of shells, cores, fsms
and ports, which are comments there. Of hand-written parts it is what they register.
"""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, get_args

from mauve_rt._kernel import (
    CoreDescription,
    DescribedState,
    PropertyDescription,
    ResourceParameter,
    message_files,
)
from mauve_rt.errors import MauveError
from mauve_rt.model.plugins import PluginLoader
from mauve_rt.modelling.durations import duration_text
from mauve_rt.modelling.schema import ModelFile
from mauve_rt.parts.message_types import action_of
from mauve_rt.parts.model_core import ModelCore
from mauve_rt.parts.part import Configurable

Mapped = dict[str, Any]
_TYPES = {"int": "int64", "float": "float64", "str": "string", "bool": "bool"}
_STATE_TYPE = re.compile(r"(?P<item>[^{\[]+)(?:\{.*\} of \d+ bytes)?(?P<list>\[.*\])?", re.ASCII)


@dataclass
class RegisteredModel:
    """What was found, in the form of a model file.

    Attributes:
        content: by key, as a model file has it.
        guesses: what nothing registered says; a person has to look at it.

    """

    content: Mapped
    guesses: list[str] = field(default_factory=list)


def registered_model(package: str, loader: PluginLoader) -> RegisteredModel:
    """The model of a package that is installed.

    Raises:
        MauveError: it has no shell, core, fsm, resource or type, or one cannot be loaded.
    """
    return _Reading(package, loader).result()


class _Reading:
    def __init__(self, package: str, loader: PluginLoader) -> None:
        self._package = package
        self._loader = loader
        self._registry = loader.registry
        self._model = RegisteredModel({})
        self._types: Mapped = {}
        self._packages = {name.partition("/")[0] for name in loader.names("shell")}

    def result(self) -> RegisteredModel:
        names = {
            kind: [name for name in self._loader.names(kind) if name.partition("/")[0] == self._package]
            for kind in ("type", "shell", "core", "fsm", "resource")
        }
        if not any(names.values()):
            missing = self._loader.missing_package(f"{self._package}/Part")
            raise MauveError(missing or f"package '{self._package}' registers no parts; see `mauve plugins`")
        for kind, of_kind in names.items():
            for name in of_kind:
                self._loader.require(kind, name)
        for name in names["type"]:
            if not action_of(name):
                self._type(name)
        shells = {_last(name): self._shell(name) for name in names["shell"]}
        cores: Mapped = {}
        fsms = {_last(name): self._fsm(name, names["core"], cores) for name in names["fsm"]}
        cores = {name: _without_empty(core) for name, core in cores.items()}
        left = {_last(name) for name in names["core"]} - {
            one for core in cores.values() for one in core.get("implementations", ())
        }
        self._model.guesses += [
            f"core {name}: no fsm of the package calls it; it is left out" for name in sorted(left)
        ]
        resources = {_last(name): self._resource(name) for name in names["resource"]}
        sections = {
            "types": self._types,
            "shells": shells,
            "cores": cores,
            "fsms": fsms,
            "resources": resources,
        }
        self._model.content = {"mauve_model": 1, "package": self._package}
        self._model.content |= {name: sections[name] for name in ModelFile.settings if sections.get(name)}
        return self._model

    def _guess(self, what: str) -> None:
        if what not in self._model.guesses:
            self._model.guesses.append(what)

    def _type(self, name: str) -> None:
        if "/msg/" in name:
            shape = next(shape for shape in self._registry.type_shapes() if shape.type == name)
            lines = (line.partition("#")[0].split() for line in message_files(shape)[0].text.splitlines())
            fields = {words[1]: self._in_package(words[0]) for words in lines if words}
            self._types[_last(name)] = fields
            return
        path = f"{self._package}/{_last(name).lower()}.hpp"
        self._types[_last(name)] = {"cpp": f"{self._package}::{_last(name)}", "include": path, "name": name}
        self._guess(f"type {_last(name)}: its struct and its header are guesses")

    def _in_package(self, text: str) -> str:
        """A type of a field: `Point2D[<=3]` of this package, `geometry_msgs/msg/Point` of another."""
        package, separator, item = text.partition("/")
        if not separator:
            return text
        item = item.removeprefix("msg/")
        return item if package == self._package else f"{package}/msg/{item}"

    def _own(self, name: str) -> str:
        """A name without the package; with it that of another package, and of a part of an action."""
        return name if name.partition("/")[0] != self._package or action_of(name) else _last(name)

    def _shell(self, name: str) -> Mapped:
        shell = self._registry.describe_shell(name)
        properties = {one.name: _property(one, one.value, list(one.structural)) for one in shell.properties}
        ports = {one.name: self._port(name, one) for one in shell.ports}
        return _without_empty({"properties": properties, "ports": ports})

    def _port(self, shell: str, port: Any) -> Mapped:
        optional = {} if port.required else {"optional": True}
        if port.kind == "event":
            return {"event": True, **optional}
        if port.kind == "call":
            return {"call": self._call(port.type, f"port {_last(shell)}.{port.name}")}
        policies = {"on_commit": port.on_commit, "on_stop": port.on_stop} if port.kind == "write" else {}
        given = {key: policy for key, policy in policies.items() if policy != _DEFAULT_POLICIES[key]}
        given |= {key: name for key in ("frame", "child_frame") if (name := getattr(port, key))}
        return {port.kind: self._own(port.type), **given, **optional}

    def _call(self, type_name: str, of: str) -> str | Mapped:
        if "/srv/" in type_name:
            return type_name
        self._guess(f"{of}: its signature in C++ and its header are guesses")
        return {
            "cpp": "void()",
            "include": f"{self._package}/{_last(type_name).lower()}.hpp",
            "name": type_name,
        }

    def _fsm(self, name: str, core_names: Iterable[str], cores: Mapped) -> Mapped:
        shell = self._registry.fsm_shell(name)
        self._loader.require("shell", shell)  # it may be of another package
        states = {state.name: state for state in self._registry.describe_fsm(name)}
        abstract, methods = self._core_of(name)
        package, _, class_name = abstract.rpartition("/")
        core = _core_name(class_name, shell)
        if package != self._package and package in self._packages:
            core = f"{package}/{core}"  # of another package's model
        else:
            known = cores.setdefault(core, {"shell": self._own(shell), "actions": [], "guards": []})
            for kind in ("actions", "guards"):
                _add(known[kind], methods.get(kind, ()))
            for state in states.values():
                _add(known["actions"], [state.action] if state.action else [])
                _add(known["guards"], state.guards)
            suited = [each for each in core_names if self._suits(each, shell, class_name)]
            known |= self._facts_of(suited)
        initial = next(state.name for state in states.values() if state.is_initial)
        periodic = _period(states)
        shown = {
            each.name: _state(each, is_periodic=periodic is not None)
            for each in states.values()
            if periodic is None or not each.is_wait
        }
        head = {"core": core, "periodic": periodic, "initial": initial}
        return {key: value for key, value in head.items() if value is not None} | {"states": shown}

    def _core_of(self, fsm: str) -> tuple[str, Mapping[str, list[str]]]:
        """`package/Class` whose methods an fsm calls, empty: not known; and the methods that it has."""
        part = self._loader.python_class("fsm", fsm)
        if part is None:
            classes = self._registry.classes_of("fsm", fsm)
            return ("/".join(_class_names(classes[0])[-2:]) if classes else ""), {}
        for base in getattr(part, "__orig_bases__", ()):
            for found in get_args(base)[1:2]:
                is_modelled = isinstance(found, type) and issubclass(found, ModelCore)
                methods = (
                    {"actions": list(found.actions), "guards": list(found.guards)} if is_modelled else {}
                )
                name = getattr(found, "__name__", "")
                return (f"{_package_of(found)}/{name}" if is_modelled else name), methods
        return "", {}

    def _suits(self, core: str, shell: str, abstract: str) -> bool:
        if self._registry.core_shell(core) != shell:
            return False
        part = self._loader.python_class("core", core)
        if part is not None:
            return (
                not abstract
                or any(base.__name__ == abstract for base in part.__mro__)
                or not issubclass(part, Configurable)
            )
        classes = [_class_names(each)[-1] for each in self._registry.classes_of("core", core)]
        return not abstract or abstract in classes

    def _facts_of(self, cores: Iterable[str]) -> Mapped:
        """What the implementations of a core say: their state, their budget, their worst cases."""
        state: Mapped = {}
        budgets: list[int] = []
        implementations: Mapped = {}
        for name in cores:
            facts: CoreDescription = self._registry.describe_core(name)
            state |= {each: self._state_type(text) for each, text in facts.state_fields}
            budgets += [facts.budget_ns] if facts.budget_ns else []
            wcet = {method: duration_text(time_ns) for method, time_ns in facts.wcet_ns.items()}
            implementations[_last(name)] = _without_empty({"wcet": wcet})
        handover = {"budget": duration_text(max(budgets))} if budgets else {}
        return {"state": state, "handover": handover, "implementations": implementations}

    def _state_type(self, text: str) -> str:
        found = _STATE_TYPE.fullmatch(text)
        if found is None or "/" not in found["item"]:
            return text
        return self._in_package(found["item"]) + (found["list"] or "")

    def _resource(self, name: str) -> Mapped:
        kind = self._registry.resource_kind(name)
        described = self._registry.describe_resource(name, "")
        services = {
            one.name: {"call": self._call(one.type, f"service {_last(name)}.{one.name}")}
            for one in described.services
            if one.kind == "call"
        }
        parameters = {
            one.name: _property(one, one.initial, []) | ({"required": True} if one.required else {})
            for one in kind.parameters
        }
        return _without_empty({"services": services, "parameters": parameters})


_DEFAULT_POLICIES = {"on_commit": "hold", "on_stop": "set_zero"}


def _last(name: str) -> str:
    return name.rpartition("/")[2]


def _class_names(mangled: str) -> list[str]:
    """Namespaces and name of a class in the compiler's words, such as N8my_robot12GuidanceCoreE."""
    rest, names = mangled.removeprefix("N"), []
    while found := re.match(r"\d+", rest):
        length = int(found[0])
        names.append(rest[found.end() : found.end() + length])
        rest = rest[found.end() + length :]
    return names or [mangled]


def _package_of(abstract: type) -> str:
    """The package of a generated class in Python."""
    return abstract.__module__.partition(".")[0].removesuffix("_parts")


def _core_name(abstract: str, shell: str) -> str:
    if not re.fullmatch(r"[A-Za-z]\w*", abstract):
        return _last(shell).removesuffix("Shell") or _last(shell)
    return abstract.removesuffix("Core") or abstract


def _without_empty(mapping: Mapped) -> Mapped:
    return {key: value for key, value in mapping.items() if value not in ({}, [], None)}


def _add(names: list[str], more: Iterable[str]) -> None:
    names += [name for name in more if name not in names]


def _property(one: PropertyDescription | ResourceParameter, value: Any, read_by: list[str]) -> Mapped:
    facts: Mapped = {"type": _TYPES[one.type], "default": value, "unit": one.unit or None}
    facts |= {"minimum": one.minimum, "maximum": one.maximum, "description": one.description or None}
    facts |= {"read_by": read_by[0] if len(read_by) == 1 else read_by}
    return {key: each for key, each in facts.items() if each is not None and each != []}


def _period(states: Mapping[str, DescribedState]) -> str | None:
    """Of a machine that executes one state in each period; None: it is another one."""
    executions = [state for state in states.values() if not state.is_wait]
    releases = [states.get(f"Await{state.name}") for state in executions]
    waits = [state for state in states.values() if state.is_wait]
    lengths = {_length(each.duration_text, each.duration_ns) for each in waits}
    is_one = all(
        release is not None
        and release.is_wait
        and not release.is_event_wait
        and not release.guards
        and list(release.successors) == [state.name]
        for release, state in zip(releases, executions, strict=True)
    )
    to_waits = all(states[to].is_wait for state in executions for to in state.successors)
    if not executions or not is_one or not to_waits or len(waits) != len(executions) or len(lengths) != 1:
        return None
    return lengths.pop()


def _length(text: str, ns: int) -> str:
    return text or duration_text(ns)


def _state(state: DescribedState, *, is_periodic: bool) -> Mapped:
    successors = [to.removeprefix("Await") if is_periodic else to for to in state.successors]
    branches: list[Any] = [
        {"if": guard, "to": to} for guard, to in zip(state.guards, successors, strict=False)
    ]
    branches += successors[len(state.guards) :]
    after = {"next": branches[0] if len(branches) == 1 else branches} if branches else {}
    if state.is_event_wait:
        event = {
            "inputs": state.event_port,
            "timeout": _length(state.duration_text, state.duration_ns),
            "min_interarrival": _length(state.min_interarrival_text, state.min_interarrival_ns),
        }
        return {"wait_event": event, **after}
    if state.is_wait:
        return {"wait": _length(state.duration_text, state.duration_ns), **after}
    bound = {"max_execution": duration_text(state.max_execution_ns)} if state.max_execution_ns else {}
    return {"run": state.action, **bound, **after}
