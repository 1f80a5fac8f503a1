"""Ports and properties of shells. A port's methods are for the component's thread, in actions and guards.

A component is configured only with its ports connected, but for those declared `optional`: unconnected, one
reads its default and writes nowhere. Call ports are always required.
"""

import copy
from collections.abc import Collection
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Generic, Literal, ParamSpec, TypeVar

from mauve_rt._kernel import Duration, ShellBuilder, ShellView
from mauve_rt.parts import messages
from mauve_rt.parts.message_types import service_class

__all__ = [
    "CallPort",
    "EventPort",
    "Member",
    "OutputPolicy",
    "Property",
    "ReadPort",
    "RequestPort",
    "Sample",
    "Status",
    "WritePort",
]

Status = Literal["none", "old", "new"]
OutputPolicy = Literal["hold", "set_zero"]
PartName = Literal["shell", "core", "fsm"]
_STATUSES: tuple[Status, Status, Status] = ("none", "old", "new")

T = TypeVar("T")
V = TypeVar("V", bound=bool | int | float | str)
P = ParamSpec("P")
R = TypeVar("R")


@dataclass(frozen=True)
class Sample(Generic[T]):
    """What a read found."""

    value: T  # the port's default when nothing was written yet
    status: Status  # none: nothing written yet, old: read before by this port, new: not yet
    time_ns: int  # the writer's clock, CLOCK_MONOTONIC

    @property
    def is_new(self) -> bool:
        """Whether this port had not read the value before."""
        return self.status == "new"

    def age_ns(self, now_ns: int) -> int:
        """Age against a later instant; 0 when nothing was written yet."""
        return 0 if self.status == "none" else now_ns - self.time_ns


class Member:
    """What a shell is made of: a name, and the component's shell once there is one."""

    def __init__(self) -> None:
        self.name = ""
        self._view: ShellView | None = None

    def __set_name__(self, _owner: type, name: str) -> None:
        self.name = name

    def declare(self, builder: ShellBuilder) -> None:
        """Tell the kernel."""
        raise NotImplementedError

    def bind(self, view: ShellView) -> None:
        """Take the component's shell."""
        self._view = view

    @property
    def _shell(self) -> ShellView:
        if self._view is None:
            raise RuntimeError(f"'{self.name}' belongs to no component yet")
        return self._view


class _DataPort(Member, Generic[T]):
    def __init__(
        self,
        type: type[T] | str,  # noqa: A002 - the word of the field
        *,
        optional: bool,
        frame: str,
        child_frame: str,
    ) -> None:
        super().__init__()
        self.type = messages.type_name(type)
        self.optional = optional
        self.frame = frame
        self.child_frame = child_frame

    @cached_property
    def message_class(self) -> Any:
        """The class of the port's messages.

        Raises:
            TypeError: the port's type is no installed ROS message; only C++ cores can use such a port.
        """
        found = messages.message_class(self.type)
        if found is None:
            raise TypeError(
                f"port '{self.name}': type '{self.type}' is no installed ROS message; use a core in C++"
            )
        return found


class ReadPort(_DataPort[T]):
    """A port to read from."""

    def __init__(
        self,
        type: type[T] | str,  # noqa: A002
        default: T | None = None,
        *,
        optional: bool = False,
        frame: str = "",
        child_frame: str = "",
    ) -> None:
        super().__init__(type, optional=optional, frame=frame, child_frame=child_frame)
        self._default = default

    def declare(self, builder: ShellBuilder) -> None:
        """Tell the kernel."""
        builder.read_port(
            self.name,
            self.type,
            messages.zero(self.type),
            optional=self.optional,
            frame=self.frame,
            child_frame=self.child_frame,
        )

    def read(self) -> Sample[T]:
        """The present value, its status and the writer's time."""
        data, status, time_ns = self._shell.read(self.name)
        if status == 0 and self._default is not None:
            return Sample(copy.deepcopy(self._default), "none", time_ns)
        return Sample(messages.deserialize(data, self.message_class), _STATUSES[status], time_ns)


class WritePort(_DataPort[T]):
    """A port to write to."""

    def __init__(
        self,
        type: type[T] | str,  # noqa: A002
        *,
        on_commit: OutputPolicy = "hold",
        on_stop: OutputPolicy = "set_zero",
        optional: bool = False,
        frame: str = "",
        child_frame: str = "",
    ) -> None:
        super().__init__(type, optional=optional, frame=frame, child_frame=child_frame)
        self.on_commit = on_commit
        self.on_stop = on_stop

    def declare(self, builder: ShellBuilder) -> None:
        """Tell the kernel."""
        zero = messages.zero(self.type)
        builder.write_port(
            self.name,
            self.type,
            zero,
            on_commit=self.on_commit,
            on_stop=self.on_stop,
            optional=self.optional,
            frame=self.frame,
            child_frame=self.child_frame,
        )

    def write(self, value: T) -> bool:
        """Write a ROS message; False when there was no room for it, or it is in another frame.

        A message without a frame gets the one that is declared; `value` stays as it is.

        Raises:
            TypeError: a message of another type.
        """
        if not isinstance(value, self.message_class):
            raise TypeError(f"port '{self.name}' takes {self.type}, not {type(value).__name__}")
        if messages.frame_ids(self.message_class):
            value = messages.in_frames(value, *self._shell.frames(self.name))
        return self._shell.write(self.name, messages.serialize(value))


class CallPort(Member, Generic[P, R]):
    """A port that calls a service of a resource written in Python."""

    def __init__(self, type: str) -> None:  # noqa: A002
        super().__init__()
        self.type = type

    def declare(self, builder: ShellBuilder) -> None:
        """Tell the kernel."""
        builder.call_port(self.name, self.type)

    def __call__(self, *args: P.args, **kwargs: P.kwargs) -> R:
        """Call the service, traced.

        Raises:
            MauveError: not connected.
        """
        answer: R = self._shell.call(self.name, *args, **kwargs)
        return answer


class RequestPort(Member):
    """A port that calls a service of a resource written in C++, by the messages of a ROS service."""

    def __init__(self, service: Any) -> None:
        super().__init__()
        self.service: Any = (service_class(service) or service) if isinstance(service, str) else service
        self.type = messages.service_name(self.service)

    def declare(self, builder: ShellBuilder) -> None:
        """Tell the kernel."""
        builder.request_port(self.name, self.type)

    def __call__(self, request: Any) -> Any:
        """Call the service, traced; the response.

        Raises:
            MauveError: not connected, or not answered.
            TypeError: a request of another type.
        """
        if not isinstance(request, self.service.Request):
            raise TypeError(f"port '{self.name}': expected {self.type}.Request, found {request!r}")
        return self.call_through(self._shell, request)

    def call_through(self, view: ShellView, request: Any) -> Any:
        """Call the service by the port of this name in a component's shell; the response.

        Raises:
            MauveError: not connected, or not answered.
        """
        return messages.deserialize(
            view.request(self.name, messages.serialize(request)), self.service.Response
        )


class EventPort(Member):
    """A port that raises an event of a resource."""

    def __init__(self, *, optional: bool = False) -> None:
        super().__init__()
        self.optional = optional

    def declare(self, builder: ShellBuilder) -> None:
        """Tell the kernel."""
        builder.event_port(self.name, optional=self.optional)

    def raise_(self) -> None:
        """Say that it happened, at the component's clock (C++: `raise`, a word that Python keeps)."""
        self._shell.raise_event(self.name)


class Property(Member, Generic[V]):
    """A property of a shell."""

    def __init__(
        self,
        initial: V,
        *,
        unit: str = "",
        description: str = "",
        minimum: float | None = None,
        maximum: float | None = None,
        structural: PartName | Collection[PartName] = (),
    ) -> None:
        super().__init__()
        self.initial = initial
        self.unit = unit
        self.description = description
        self.minimum = minimum
        self.maximum = maximum
        self.structural: list[str] = [structural] if isinstance(structural, str) else list(structural)

    def declare(self, builder: ShellBuilder) -> None:
        """Tell the kernel."""
        builder.property(
            self.name,
            self.initial,
            unit=self.unit,
            description=self.description,
            minimum=self.minimum,
            maximum=self.maximum,
            structural=self.structural,
        )

    @property
    def value(self) -> V:
        """The value in force since the component last left a wait."""
        value: V = self._shell.property(self.name)
        return value

    def times(self, factor: int) -> Duration:
        """A number of times its value, as `mauve_rt.api.times` describes it."""
        return self._shell.times(factor, self.name)
