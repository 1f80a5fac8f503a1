"""How a shell in Python declares its ports and properties, with the names and options of C++.

    class HoverShell(Shell):
        pose = read_port(Pose)
        measured = read_port(PoseStamped, frame="map")    # connected to no resource in another frame
        target = write_port(Point, on_commit="hold", on_stop="set_zero")
        advice = read_port(Point, optional=True)    # all others are to be connected
        height = property(1.0, unit="m", minimum=0.0)

A type is a class of ROS messages, or a name such as "geometry_msgs/msg/Point".
"""

from collections.abc import Callable, Collection
from typing import Any, Concatenate, ParamSpec, TypeVar, overload

from mauve_rt.parts.action_ports import ActionClientPorts, ActionServerPorts, ActionType
from mauve_rt.parts.ports import (
    CallPort,
    EventPort,
    OutputPolicy,
    PartName,
    Property,
    ReadPort,
    RequestPort,
    WritePort,
)
from mauve_rt.parts.resources import service_type
from mauve_rt.parts.transformed_ports import TransformedReadPort

__all__ = [
    "action_client",
    "action_server",
    "call_port",
    "event_port",
    "property",
    "read_port",
    "request_port",
    "transformed_read_port",
    "write_port",
]

T = TypeVar("T")
V = TypeVar("V", bound=bool | int | float | str)
P = ParamSpec("P")
R = TypeVar("R")
F = TypeVar("F")
G = TypeVar("G")


def read_port(
    type: type[T] | str,  # noqa: A002
    default: T | None = None,
    *,
    optional: bool = False,
    frame: str = "",
    child_frame: str = "",
) -> ReadPort[T]:
    """A port to read from; `default` is what it yields before anything was written, or unconnected.

    Its values are in `frame`; poses and transforms are those of `child_frame`.
    """
    return ReadPort(type, default, optional=optional, frame=frame, child_frame=child_frame)


def write_port(
    type: type[T] | str,  # noqa: A002
    *,
    on_commit: OutputPolicy = "hold",
    on_stop: OutputPolicy = "set_zero",
    optional: bool = False,
    frame: str = "",
    child_frame: str = "",
) -> WritePort[T]:
    """A port to write to, and what the kernel writes while the component is replaced or does not run.

    `frame`, `child_frame`: as of `read_port`.
    """
    return WritePort(
        type,
        on_commit=on_commit,
        on_stop=on_stop,
        optional=optional,
        frame=frame,
        child_frame=child_frame,
    )


def action_server(action: ActionType[G, R, F]) -> ActionServerPorts[G, R, F]:
    """The ports of a component that executes goals of a ROS action, such as `DriveTo`.

    Of an attribute `drive` they are drive_status, drive_goal, drive_decide, drive_feedback and drive_result.
    """
    return ActionServerPorts(action)


def action_client(action: ActionType[G, R, F]) -> ActionClientPorts[G, R, F]:
    """The ports of a component that sends goals; named as those of `action_server`."""
    return ActionClientPorts(action)


@overload
def call_port(service: Callable[Concatenate[Any, P], R]) -> CallPort[P, R]: ...
@overload
def call_port(service: str) -> CallPort[..., Any]: ...
def call_port(service: Callable[..., Any] | str) -> CallPort[..., Any]:
    """A port that calls a service of a resource in Python: the service's type, or the method that is one."""
    return CallPort(service if isinstance(service, str) else service_type(service))


def transformed_read_port(
    type: type[T] | str,  # noqa: A002
    *,
    to: str,
    lookup: RequestPort,
    frame: str = "",
    latest: bool = False,
    optional: bool = False,
) -> TransformedReadPort[T]:
    """A port to read from whose values are in its own frame, `to`.

    `lookup`: the shell's `request_port(LookupTransform)`. `frame`: that of values without a
    header, or with an empty frame_id. `latest`: by the latest transform, in the place of that at the time at
    which the value was written.
    """
    return TransformedReadPort(type, to=to, lookup=lookup, frame=frame, latest=latest, optional=optional)


def request_port(service: Any) -> RequestPort:
    """A port that calls a service of a resource in C++: a class of a ROS service, or its name."""
    return RequestPort(service)


def event_port(*, optional: bool = False) -> EventPort:
    """A port that raises an event."""
    return EventPort(optional=optional)


def property(  # noqa: A001 - its name in C++
    initial: V,
    *,
    unit: str = "",
    description: str = "",
    minimum: float | None = None,
    maximum: float | None = None,
    structural: PartName | Collection[PartName] = (),
) -> Property[V]:
    """A property: bool, int, float or str, by its initial value.

    `structural`: the parts, "shell", "core" or "fsm", that read it in configure or define, such as the length
    of a wait or a size. Once the component is configured it is set only beside their replacement.
    """
    return Property(
        initial,
        unit=unit,
        description=description,
        minimum=minimum,
        maximum=maximum,
        structural=structural,
    )
