"""The newest values of resources, for those who look from outside. Knows nothing of ROS."""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

from mauve_rt._kernel import ComponentDescription, MessageShape, ResourceDescription
from mauve_rt.control.runtime import Runtime
from mauve_rt.errors import MauveError
from mauve_rt.file_schema.words import did_you_mean, listed
from mauve_rt.model.message_text import message_text

MOST_VALUES = 256
"""Of one request."""
_KINDS = ("read", "write", "event")  # of ports that have a value; a call has none


class Value(NamedTuple):
    """The newest value of a resource, as one poll found it."""

    resource: ResourceDescription
    data: bytes
    """CDR; before the first write the type's default."""
    writes: int
    """Since the start, this one included."""
    time_ns: int
    """The writer's, CLOCK_MONOTONIC; 0 before the first write."""


class Values:
    """The values of one runtime. Any thread; no component waits for a poll longer than for another reader."""

    def __init__(self, runtime: Runtime) -> None:
        self._runtime = runtime

    def read(self, names: Sequence[str]) -> list[Value | MauveError]:
        """The value of each resource or COMPONENT.PORT; an error where there is none, which says why.

        Names beyond the first 256 get an error.
        """
        beyond = MauveError(
            f"a request reads at most {MOST_VALUES} values; ask for the others in another one"
        )
        return [*self._read_some(names[:MOST_VALUES]), *(beyond for _ in names[MOST_VALUES:])]

    def _read_some(self, names: Sequence[str]) -> list[Value | MauveError]:
        resources = {resource.name: resource for resource in self._runtime.described_resources()}
        components = self._runtime.components() if any(name not in resources for name in names) else []
        found: list[Value | MauveError] = []
        for name in names:
            try:
                found.append(self._read(find_resource(name, resources.values(), components)))
            except MauveError as error:
                found.append(error)
        return found

    def find(self, name: str) -> Value:
        """The value of one.

        Raises:
            MauveError: there is none, and why.
        """
        (found,) = self.read([name])
        if isinstance(found, MauveError):
            raise found
        return found

    def _read(self, resource: ResourceDescription) -> Value:
        data, writes, time_ns = self._runtime.host.read_resource(resource.name)
        if not data:
            raise MauveError(
                f"resource {resource.name} is of kind {resource.kind}, which has no value to show; "
                "choose a shared_data, latest_value, ring_buffer or event"
            )
        return Value(resource, data, writes, time_ns)


def find_resource(
    name: str, resources: Iterable[ResourceDescription], components: Iterable[ComponentDescription]
) -> ResourceDescription:
    """The resource of this name, or the one that the port COMPONENT.PORT is connected to.

    Raises:
        MauveError: there is none, and which name is like it.
    """
    by_name = {resource.name: resource for resource in resources}
    if name in by_name:
        return by_name[name]
    ports = {f"{component.name}.{port.name}": port for component in components for port in component.ports}
    port = ports.get(name)
    if port is None:
        shown = [each for each, port in ports.items() if port.kind in _KINDS]
        raise MauveError(f"no resource or port is named '{name}'; {did_you_mean(name, [*by_name, *shown])}")
    if port.kind not in _KINDS:
        raise MauveError(f"{name} is a {port.kind} port, which has no value; choose a {listed(_KINDS)} port")
    if port.resource not in by_name:
        raise MauveError(f"port {name} is connected to no resource, so it has no value; connect it first")
    return by_name[port.resource]


def definition_of(resource: ResourceDescription) -> str:
    """The .msg text of a resource's values: of the message that is installed, else of its C++ struct.

    Raises:
        MauveError: the type is neither a registered C++ struct nor an installed message.
    """
    return message_text(resource.type, read_shapes(resource))


def read_shapes(resource: ResourceDescription) -> list[MessageShape]:
    """The C++ structs that the resource's ports read."""
    return [shape for service in resource.services if service.kind == "read" for shape in service.messages]
