"""Shells: ports and properties, the only part of a component that is visible from outside."""

import copy
from typing import Any, Self

from mauve_rt._kernel import NO_LOG, Log, PartFactory, ShellBuilder, ShellView, monotonic_ns
from mauve_rt.parts.part import Configurable, implementation_name
from mauve_rt.parts.ports import CallPort, EventPort, Member, Property, ReadPort, WritePort

__all__ = ["NativeShell", "Shell", "shell_of"]


class Shell(Configurable):
    """Base of shells written in Python.

    Ports and properties are attributes of the class (see `mauve_rt.parts.declarations`), or of the object
    when `__init__` sets them. Every component has an object of its own.
    """

    _view: ShellView | None = None

    def __init__(self) -> None:
        """One without arguments is what the kernel makes."""

    def __new__(cls, *_args: Any, **_kwargs: Any) -> Self:
        """Give the object its own copy of what the class declares."""
        shell = super().__new__(cls)
        for base in reversed(cls.__mro__):
            for name, attribute in vars(base).items():
                if isinstance(attribute, Member):
                    shell.__dict__[name] = copy.copy(attribute)
                else:
                    shell.__dict__.pop(name, None)
        return shell

    @property
    def clock_ns(self) -> int:
        """The component's logical clock: the nominal instant of this execution, CLOCK_MONOTONIC."""
        return monotonic_ns() if self._view is None else self._view.clock()

    @property
    def period_ns(self) -> int:
        """The component's period; 0 before it is configured."""
        return 0 if self._view is None else self._view.period()

    def log(self) -> Log:
        """Lines for the console, /rosout and the bag: `self.log().warn("tracking error {} m", error)`."""
        return NO_LOG if self._view is None else self._view.log()

    @classmethod
    def _part(cls) -> PartFactory:
        return PartFactory("shell", implementation_name(cls), cls)

    def _members(self) -> list[Member]:
        return [member for member in vars(self).values() if isinstance(member, Member)]

    def _declare(self, builder: ShellBuilder) -> None:
        for name, member in vars(self).items():
            if isinstance(member, Member):
                member.name = name
                member.declare(builder)

    def _bind(self, view: ShellView) -> None:
        self._view = view
        for member in self._members():
            member.bind(view)


class NativeShell(Shell):
    """A shell written in C++, as a core or an fsm in Python has it: every port and property by its name."""

    def __init__(self, view: ShellView) -> None:
        self._view = view
        self._by_name: dict[str, Member] = {}
        for description in view.properties():
            self._by_name[description.name] = Property(description.value)
        for port in view.ports():
            self._by_name[port.name] = _port(port.kind, port.type)
        for name, member in self._by_name.items():
            member.name = name
            member.bind(view)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        try:
            return self._by_name[name]
        except KeyError:
            known = ", ".join(self._by_name)
            raise AttributeError(f"the shell has no port or property '{name}'; it has {known}") from None


def _port(kind: str, type_name: str) -> Member:
    if kind == "read":
        return ReadPort[Any](type_name)
    if kind == "write":
        return WritePort[Any](type_name)
    return EventPort() if kind == "event" else CallPort[..., Any](type_name)


def shell_of(view: ShellView) -> Any:
    """The object that stands for a component's shell: the shell itself when it is written in Python."""
    found = view.python()
    return NativeShell(view) if found is None else found
