"""The drawing of an architecture, as Fig. 1 of the paper: components by CPU, resources, ports as arrows."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from mauve_rt.counts import duration
from mauve_rt.graph.drawing import HIGH, Drawing, Edge, Node, merged

_HIGH_LOAD = 0.7
ROS_SIDES = ("publishes", "subscribes", "calls", "offers")  # fields of mauve_msgs/msg/ResourceInfo


@dataclass(frozen=True)
class Measured:
    """Facts of a recorded run about one component."""

    load: float
    """Share of the recorded time in execution states."""
    text: str
    """As it is written."""


def architecture_drawing(
    title: str,
    components: Iterable[Any],
    resources: Iterable[Any] = (),
    *,
    measured: Mapping[str, Measured] | None = None,
) -> Drawing:
    """Return the drawing of components and resources.

    Args:
        title: of the drawing.
        components: trace.reading's ComponentInfo, or descriptions with its fields. A period or CPUs of None
            are not known.
        resources: ResourceInfo messages, or descriptions with the same fields. Others have their name only.
        measured: facts of a recorded run by component.
    """
    found = list(components)
    known = {one.name: one for one in resources}
    for one in found:
        known |= {port.resource: None for port in one.ports if port.resource and port.resource not in known}
    nodes = [_component(one, (measured or {}).get(one.name)) for one in found]
    nodes += [_resource(name, one, found) for name, one in known.items()]
    edges = merged(_edge(one, port) for one in found for port in one.ports if port.resource)
    return Drawing(title=title, nodes=tuple(nodes), edges=edges)


def component_key(name: str) -> str:
    """The key of a component's node."""
    return f"component {name}"


def resource_key(name: str) -> str:
    """The key of a resource's node."""
    return f"resource {name}"


def takes_values(port: Any) -> bool:
    """Whether a component takes values from the resource of a port, rather than gives some to it."""
    return port.kind in ("read", "event") or port.service.startswith(("read", "get"))


def frames_text(described: Any) -> str:
    """`in map`, `in odom, of base`; empty: a port or a resource declares no frame."""
    frame, child_frame = (getattr(described, key, "") for key in ("frame", "child_frame"))
    parts = [f"in {frame}" if frame else "", f"of {child_frame}" if child_frame else ""]
    return ", ".join(filter(None, parts))


def cpus_text(cpus: Iterable[int] | None) -> str:
    """`CPU 0, 2`, or `any CPU`: the frame in which components of the same CPUs stand; empty: not known."""
    if cpus is None:
        return ""
    return f"CPU {', '.join(map(str, sorted(cpus)))}" if cpus else "any CPU"


def _component(described: Any, measured: Measured | None) -> Node:
    rate = (
        duration(described.period_ns)
        if described.period_ns
        else "on events"
        if described.period_ns == 0
        else ""
    )
    facts = [rate, f"priority {described.priority}" if described.priority else ""]
    lines = [described.name, described.core.rpartition("/")[2], ", ".join(filter(None, facts))]
    if measured is not None:
        lines.append(f"load {measured.text}")
    if lonely := [port.name for port in described.ports if not port.resource]:
        lines.append(f"not connected: {', '.join(lonely)}")
    properties = map(_property, getattr(described, "properties", ()))
    parts = {"shell": described.shell, "core": described.core, "fsm": described.fsm}
    return Node(
        key=component_key(described.name),
        kind="component",
        lines=tuple(filter(None, lines)),
        cluster=cpus_text(described.cpus),
        classes=(HIGH,) if measured is not None and measured.load > _HIGH_LOAD else (),
        tip="\n".join([described.name, *(f"{kind} {name}" for kind, name in parts.items() if name)]),
        details={
            **{kind: name for kind, name in parts.items() if kind != "core"},
            **dict(properties),
            "state": str(getattr(described, "state", "")),
        },
    )


def _property(described: Any) -> tuple[str, str]:
    """Name and value: a message has them as one text."""
    name, _, value = (
        described.partition("=") if isinstance(described, str) else (described.name, "", str(described.value))
    )
    return name, value


def _resource(name: str, described: Any, components: Iterable[Any]) -> Node:
    users = {cpus_text(one.cpus) for one in components for port in one.ports if port.resource == name}
    names = [(side, getattr(described, side, "")) for side in ROS_SIDES]
    lines = [name.rpartition("/")[2], *(f"{side} {ros_name}" for side, ros_name in names if ros_name)]
    details = {"kind": described.kind, "type": described.type} if described is not None else {}
    if frames := frames_text(described):
        lines.append(frames)
    return Node(
        key=resource_key(name),
        kind="resource",
        lines=tuple(lines),
        cluster=users.pop() if len(users) == 1 else "",
        tip="\n".join([f"resource {name}", *(f"{fact} {value}" for fact, value in details.items() if value)]),
        details=details,
    )


def _edge(component: Any, port: Any) -> Edge:
    """Along the data: a component takes values from a resource, or gives some to it."""
    ends = [component_key(component.name), resource_key(port.resource)]
    start, end = reversed(ends) if takes_values(port) else ends
    tip = f"{component.name}.{port.name} ({port.kind}), {port.resource}.{port.service}"
    lines = [port.name] if port.name != port.resource.rpartition("/")[2] else []
    return Edge(
        start=start,
        end=end,
        kind="data",
        lines=tuple(filter(None, [*lines, frames_text(port)])),
        tip=f"{tip}, {port.type}" if port.type else tip,
    )
