"""Loading an architecture file and the checks that need nothing but the file and this machine."""

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from mauve_rt.errors import ArchitectureFileError, Problem
from mauve_rt.file_schema.schema_errors import owner, read_content
from mauve_rt.file_schema.words import did_you_mean, listed
from mauve_rt.file_schema.yaml_file import Location, YamlFile
from mauve_rt.model.resource_kinds import (
    EXAMPLES_OF_TYPES,
    foreign_bindings,
    given_kinds,
    given_kinds_with,
    has_key,
    needed_binding,
)
from mauve_rt.model.schema import ComponentModel, FileModel, FramesModel, PropertyValue, ResourceModel
from mauve_rt.model.substitution import substituted_frame, substituted_property

if TYPE_CHECKING:
    from mauve_rt.model.modelled_parts import ModelledParts


@dataclass(frozen=True, kw_only=True)
class Connection:
    """One line of `connections`."""

    component: str
    port: str
    resource: str
    service: str
    location: Location


class ArchitectureModel:
    """A loaded architecture file: what it says, as far as it alone tells checked, and where it says it."""

    def __init__(self, file: YamlFile, content: FileModel, overrides: "Overrides") -> None:
        self.file = file
        self.path: Path = file.path
        self.namespace = overrides.namespace or content.executor.namespace
        self.executor = content.executor
        self.peers = list(content.executor.peers if overrides.peers is None else overrides.peers)
        self.require_realtime = content.executor.require_realtime
        self.diagnostics = content.executor.diagnostics
        self.sender = content.executor.sender
        self.sentinel = content.executor.sentinel
        self.mirrors = list(content.executor.mirror)
        self.recorded = list(content.executor.record)
        self.components: dict[str, ComponentModel] = dict(content.components)
        self.resources: dict[str, ResourceModel] = dict(content.resources)
        self.connections = [
            Connection(
                component=port.split(".")[0],
                port=port.split(".")[1],
                resource=service.split(".")[0],
                service=service.split(".")[1],
                location=("connections", index),
            )
            for index, (port, service) in enumerate(content.connections)
        ]
        self.parts: ModelledParts | None = None  # where not all parts are installed
        self._overridden = dict(overrides.properties)

    def problem(self, location: Location, what: str, **facts: str) -> Problem:
        """A problem at an element of the file; names component and element by itself."""
        return self.file.problem(location, what, **{**_owner_facts(location), **facts})

    def key_problem(self, location: Location, what: str, **facts: str) -> Problem:
        """As problem(), but at the element's key rather than at its value."""
        return self.file.key_problem(location, what, **{**_owner_facts(location), **facts})

    def properties(self, component: str) -> dict[str, PropertyValue]:
        """The properties of a component as it gets them: overridden, places replaced, paths made absolute.

        Raises:
            ArchitectureFileError: `$(share PACKAGE)` names a package that is not installed, or an unknown
            `$(...)`.
        """
        values = {}
        for name, value in self.components[component].properties.items():
            values[name] = self._substituted(component, name, value, self.path.resolve().parent)
        for (owning, name), value in self._overridden.items():
            if owning == component:
                values[name] = self._substituted(component, name, value, Path.cwd())
        return values

    def frames(self, component: str) -> dict[str, tuple[str, str]]:
        """(frame, child_frame) of the ports of a component as the file declares them; empty: it does not.

        Raises:
            ArchitectureFileError: a place in a name is empty.
        """
        return {
            port: self.frames_of(declared, ("components", component, "frames", port))
            for port, declared in self.components[component].frames.items()
        }

    def resource_frames(self, resource: str) -> tuple[str, str]:
        """(frame, child_frame) of a resource, as frames()."""
        return self.frames_of(self.resources[resource], ("resources", resource))

    def frames_of(self, declared: FramesModel | ResourceModel, place: Location) -> tuple[str, str]:
        """(frame, child_frame) of a declaration at that place, as frames()."""
        try:
            frame, child_frame = (
                substituted_frame(name, self) if name else ""
                for name in (declared.frame, declared.child_frame)
            )
        except LookupError as error:
            problem = self.problem(place, "bad frame", found=str(error.args[0]))
            raise ArchitectureFileError(self.path, [problem]) from None
        return frame, child_frame

    def property_place(self, component: str, name: str) -> Location:
        """Where a property of a component is set."""
        return ("components", component, "properties", name)

    def property_words(self, component: str, name: str) -> str:
        """How to call a property in a message."""
        parameter = f" (parameter {component}.{name})" if (component, name) in self._overridden else ""
        return f"property '{name}' of component '{component}'{parameter}"

    def _substituted(self, component: str, name: str, value: PropertyValue, folder: Path) -> PropertyValue:
        try:
            return substituted_property(name, value, folder=folder, model=self)
        except LookupError as error:
            what = f"bad {self.property_words(component, name)}"
            problem = self.problem(self.property_place(component, name), what, found=str(error.args[0]))
            raise ArchitectureFileError(self.path, [problem]) from None


def _owner_facts(location: Location) -> dict[str, str]:
    component, element = owner(location)
    return {"component": component, "element": element}


@dataclass(frozen=True, kw_only=True)
class Overrides:
    """What the command line says instead of the file, so that one file serves several robots.

    A relative path in an overriding property is relative to the current folder.
    """

    namespace: str = ""  # empty: as in the file
    peers: Sequence[str] | None = None  # None: as in the file
    properties: Mapping[tuple[str, str], PropertyValue] = field(
        default_factory=dict
    )  # by (component, property)


def load_architecture(
    path: str | Path, *, overrides: Overrides | None = None, runs_here: bool = True
) -> ArchitectureModel:
    """Read a file and check all of it that can be checked without plug-ins.

    `runs_here`: refuse CPUs that this computer does not have. Properties are checked by `build`, which knows
    the shells.

    Raises:
        ArchitectureFileError: with every problem found; `str()` tells of the first.
    """
    file = YamlFile(path)
    content = read_content(FileModel, file)
    model = ArchitectureModel(file, content, overrides or Overrides())
    problems = [
        *_override_problems(model, overrides or Overrides()),
        *element_problems(model, runs_here=runs_here),
        *_connection_problems(model),
        *_port_count_problems(model),
        *_value_name_problems(model),
    ]
    if problems:
        raise ArchitectureFileError(file.path, problems)
    return model


def online_cpus() -> frozenset[int]:
    """Numbers of the CPUs this machine has switched on."""
    try:
        text = Path("/sys/devices/system/cpu/online").read_text(encoding="ascii").strip()
        ranges = [part.partition("-") for part in text.split(",")]
        return frozenset(cpu for low, _, high in ranges for cpu in range(int(low), int(high or low) + 1))
    except (OSError, ValueError):
        return frozenset(range(os.cpu_count() or 1))


def element_problems(model: ArchitectureModel, *, runs_here: bool = True) -> Iterator[Problem]:
    """What is wrong with the executor, components and resources, each taken by itself."""
    if runs_here:
        yield from _cpu_problems(model, ("executor", "sender"), "executor's sender", model.sender.cpus)
        for name, component in model.components.items():
            yield from _cpu_problems(model, ("components", name), f"component '{name}'", component.cpus)
    yield from _component_problems(model)
    yield from _resource_problems(model)


def _override_problems(model: ArchitectureModel, overrides: Overrides) -> Iterator[Problem]:
    for component, name in overrides.properties:
        if component not in model.components:
            what = f"parameter '{component}.{name}' sets a property of an unknown component"
            remedy = did_you_mean(component, model.components)
            yield model.key_problem(("components",), what, remedy=remedy, code="unknown_component")


def _component_problems(model: ArchitectureModel) -> Iterator[Problem]:
    for name in model.components:
        if name in model.resources:
            what = f"'{name}' is the name of a component and of a resource"
            yield model.key_problem(("resources", name), what, remedy="rename one", code="duplicate_name")


def _cpu_problems(
    model: ArchitectureModel, location: Location, who: str, cpus: Sequence[int] | None
) -> Iterator[Problem]:
    online = online_cpus()
    for index, cpu in enumerate(cpus or ()):
        if cpu not in online:
            yield model.problem(
                (*location, "cpus", index),
                f"{who} asks for a CPU that this machine does not have",
                expected=f"one of {', '.join(str(cpu) for cpu in sorted(online))}",
                found=str(cpu),
                remedy="leave cpus out to allow every CPU",
                code="out_of_range",
            )


def _resource_problems(model: ArchitectureModel) -> Iterator[Problem]:
    for name, resource in model.resources.items():
        location = ("resources", name)
        kind = given_kinds().get(resource.kind)
        if kind is not None and kind.messages and resource.type not in ("", *kind.messages):
            what = f"resource '{name}' of kind {resource.kind} cannot be said by that message"
            expected = f"{', '.join(kind.messages)}, or none, which is the last"
            yield model.problem((*location, "type"), what, expected=expected, found=resource.type)
        if kind is not None and kind.type_kind and not resource.type:
            example = EXAMPLES_OF_TYPES[kind.type_kind]
            yield model.problem(location, f"resource '{name}' has no type", expected=f"e.g. {example}")
        yield from _binding_problems(model, name)
        yield from _service_problems(model, name)


def _binding_problems(model: ArchitectureModel, name: str) -> Iterator[Problem]:
    """A client has a service, and a server or client of an action an action; they have nothing else."""
    resource, location = model.resources[name], ("resources", name)
    kind = given_kinds().get(resource.kind)
    needed = needed_binding(kind)
    who = f"resource '{name}' of kind {resource.kind}"
    if needed and getattr(resource, needed) is None:
        yield model.problem(location, f"{who} has no {needed}", expected=f"{needed}: {{name: ...}}")
    for key in foreign_bindings(kind):
        if getattr(resource, key) is not None:
            of_kinds = [each.name for each in given_kinds().values() if needed_binding(each) == key]
            remedy = (
                f"bind it by {needed}" if needed else f"only resources of kind {listed(of_kinds)} have one"
            )
            yield model.key_problem((*location, key), f"{who} takes no {key}", remedy=remedy)


def _service_problems(model: ArchitectureModel, name: str) -> Iterator[Problem]:
    """A client calls a ROS service; any other resource may offer a call of its own as one."""
    resource, location = model.resources[name], ("resources", name)
    service, kind = resource.service, given_kinds().get(resource.kind)
    is_client = needed_binding(kind) == "service"
    if service is None or "service" in foreign_bindings(kind):
        return
    at = (*location, "service")
    if is_client and service.offers is not None:
        what = f"resource '{name}' of kind {resource.kind} cannot offer a service"
        yield model.key_problem((*at, "offers"), what, remedy="leave offers out; it calls the service")
    if not is_client and service.offers is None:
        what = f"resource '{name}' does not say which of its calls the ROS service is"
        yield model.problem(
            at, what, expected="offers: the name of a call", remedy="or kind: client, to call it"
        )
    if "timeout_ms" in service.given and not (kind is not None and has_key(kind, "service.timeout_ms")):
        what = f"resource '{name}' of kind {resource.kind} has no timeout_ms"
        remedy = f"only a {listed(given_kinds_with('service.timeout_ms'))} has one"
        yield model.key_problem((*at, "timeout_ms"), what, remedy=remedy)


def _connection_problems(model: ArchitectureModel) -> Iterator[Problem]:
    first: dict[tuple[str, str], int] = {}
    for connection in model.connections:
        at_port, at_service = (*connection.location, 0), (*connection.location, 1)
        if connection.component not in model.components:
            what = f"connection from unknown component '{connection.component}'"
            remedy = did_you_mean(connection.component, model.components)
            yield model.problem(at_port, what, remedy=remedy, code="unknown_component")
        if connection.resource not in model.resources:
            what = f"connection to unknown resource '{connection.resource}'"
            remedy = did_you_mean(connection.resource, model.resources)
            yield model.problem(at_service, what, remedy=remedy, code="unknown_resource")
        port = (connection.component, connection.port)
        line = model.file.position(connection.location)[0]
        if port in first:
            what = f"port '{connection.component}.{connection.port}' is connected twice"
            remedy = f"a port connects to one service; see line {first[port]}"
            yield model.problem(at_port, what, remedy=remedy, code="duplicate_name")
        first.setdefault(port, line)


def _value_name_problems(model: ArchitectureModel) -> Iterator[Problem]:
    """What is mirrored or recorded is a resource, or a port that is connected to one."""
    ports = {f"{each.component}.{each.port}" for each in model.connections}
    named = [("mirror", index, mirror.name) for index, mirror in enumerate(model.mirrors)]
    named += [("record", index, name) for index, name in enumerate(model.recorded)]
    for key, index, name in named:
        if name not in model.resources and name not in ports:
            yield model.problem(
                ("executor", key, index),
                f"there is no value '{name}'",
                expected="a resource, or component.port of a connection",
                remedy=did_you_mean(name, [*model.resources, *ports]),
            )


def _port_count_problems(model: ArchitectureModel) -> Iterator[Problem]:
    """Some kinds have one writer, a port or an incoming topic, or as many readers as a parameter says."""
    for name, resource in model.resources.items():
        kind = given_kinds().get(resource.kind)
        if kind is None:
            continue
        linked = [connection for connection in model.connections if connection.resource == name]
        writes = [connection.location for connection in linked if connection.service == "write"]
        if resource.topic is not None and resource.topic.direction == "subscribe":
            writes.insert(0, ("resources", name, "topic"))
        for location in writes[1:] if kind.has_one_writer else ():
            yield model.problem(
                (*location, 1),
                f"a second writer of resource '{name}' of kind {kind.name}",
                remedy=f"it has one; see line {model.file.position(writes[0])[0]}, or use shared_data",
                code="invalid_argument",
            )
        reads = [connection.location for connection in linked if connection.service == "read"]
        for limit in (parameter for parameter in kind.parameters if parameter.limits_readers):
            most = int(resource.parameters.get(limit.name, limit.initial))
            for location in reads[most:]:
                yield model.problem(
                    (*location, 1),
                    f"too many readers of resource '{name}' of kind {kind.name}",
                    expected=f"at most {most}",
                    found=str(len(reads)),
                    remedy=f"raise its {limit.name}",
                    code="invalid_argument",
                )
