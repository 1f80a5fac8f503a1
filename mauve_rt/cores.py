"""What the author of a core in Python needs.

    from mauve_rt.cores import Core

    class Hover(Core):
        def configure(self) -> None:
            self.height = self.shell.height.value

        def follow(self) -> None:                   # an action of the FSM
            pose = self.shell.pose.read()
            if pose.is_new:
                self.shell.target.write(Point(x=pose.value.x, y=pose.value.y, z=self.height))

        def has_goal(self) -> bool:                 # a guard of the FSM
            return self.shell.goal.read().status != "none"

A core has one method for every action and guard of its component's FSM; the kernel checks that when it
prepares the core. Its methods run on the component's thread, under the interpreter's lock: soft real time.
List it in the package's `mauve_rt_plugins` (see `mauve_rt.model.plugins`).
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal, Protocol

from rclpy.serialization import deserialize_message, serialize_message

from mauve_rt._kernel import PortDescription, PropertyDescription
from mauve_rt.model.message_types import message_class

__all__ = ["Core", "Property", "ReadPort", "Sample", "Shell", "ShellView", "WritePort"]

Status = Literal["none", "old", "new"]
_STATUSES: tuple[Status, Status, Status] = ("none", "old", "new")


class ShellView(Protocol):
    """What the kernel hands to a Python core: its component's shell, messages in serialized form."""

    def read(self, port: str) -> tuple[bytes, int, int]:
        """(message, 0 none - 1 old - 2 new, writer's time in ns)."""

    def write(self, port: str, data: bytes) -> object:
        """Write a serialized message to a port."""

    def property(self, name: str) -> bool | float | str:
        """The value in force."""

    def ports(self) -> list[PortDescription]:
        """The shell's ports."""

    def properties(self) -> list[PropertyDescription]:
        """The shell's properties."""

    def clock(self) -> int:
        """The component's logical clock, ns of CLOCK_MONOTONIC."""

    def period(self) -> int:
        """The component's period g in ns."""


@dataclass(frozen=True)
class Sample:
    """What a read found."""

    value: Any  # a ROS message; the type's zero when nothing was written yet
    status: Status  # none: nothing written yet, old: read before by this port, new: not yet
    time_ns: int  # the writer's clock, CLOCK_MONOTONIC

    @property
    def is_new(self) -> bool:
        """Whether this port had not read the value before."""
        return self.status == "new"

    def age_ns(self, now_ns: int) -> int:
        """Age against a later instant; 0 when nothing was written yet."""
        return 0 if self.status == "none" else now_ns - self.time_ns


class _Port:
    def __init__(self, view: ShellView, description: PortDescription) -> None:
        self._view = view
        self.name = description.name
        self.type = description.type

    @cached_property
    def message_class(self) -> Any:
        """The class of the port's messages.

        Raises:
            TypeError: the port's type is no installed ROS message; only C++ cores can use such a port.
        """
        found = message_class(self.type)
        if found is None:
            raise TypeError(
                f"port '{self.name}': type '{self.type}' is no installed ROS message; use a core in C++"
            )
        return found


class ReadPort(_Port):
    """A port to read from."""

    def read(self) -> Sample:
        """The present value. On the component's thread only."""
        data, status, time_ns = self._view.read(self.name)
        return Sample(deserialize_message(data, self.message_class), _STATUSES[status], time_ns)


class WritePort(_Port):
    """A port to write to."""

    def write(self, value: Any) -> bool:
        """Write a ROS message; False when there was no room. On the component's thread only.

        Raises:
            TypeError: a message of another type.
        """
        if not isinstance(value, self.message_class):
            raise TypeError(f"port '{self.name}' takes {self.type}, not {type(value).__name__}")
        return self._view.write(self.name, serialize_message(value)) is not False


class Property:
    """A property of the shell."""

    def __init__(self, view: ShellView, name: str) -> None:
        self._view = view
        self.name = name

    @property
    def value(self) -> Any:
        """The value in force since the component last left a wait."""
        return self._view.property(self.name)


class Shell:
    """A component's shell: every port and property by its name, and the component's clock."""

    def __init__(self, view: ShellView) -> None:
        self._view = view
        self._members: dict[str, ReadPort | WritePort | Property] = {
            description.name: Property(view, description.name) for description in view.properties()
        }
        for port in view.ports():
            if port.kind in ("read", "write"):
                self._members[port.name] = (ReadPort if port.kind == "read" else WritePort)(view, port)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        try:
            return self._members[name]
        except KeyError:
            known = ", ".join(self._members)
            raise AttributeError(f"the shell has no port or property '{name}'; it has {known}") from None

    @property
    def clock_ns(self) -> int:
        """The component's logical clock: the nominal instant of this execution, CLOCK_MONOTONIC."""
        return self._view.clock()

    @property
    def period_ns(self) -> int:
        """The component's period."""
        return self._view.period()


class Core:
    """Base of cores written in Python.

    A core may also have `adopt(old)`: called on the component's thread when it takes over from `old` (the
    other core object, None when that is written in C++); returning False leaves everything as it was.
    """

    def __init__(self, shell: Shell) -> None:
        self.shell = shell

    def configure(self) -> bool | None:
        """Get ready, on an ordinary thread. Return False or raise to refuse, with the reason."""

    def cleanup(self) -> None:
        """Let go of what configure() took, on an ordinary thread."""
