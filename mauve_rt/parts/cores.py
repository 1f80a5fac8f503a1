"""Cores written in Python.

    from mauve_rt.api import Core

    class Hover(Core[HoverShell]):
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
What they raise is a fault of the component, with its traceback; all others run on. A core for a shell in C++
is a plain `Core`; list it in the package's `mauve_rt_plugins` (see `mauve_rt.model.plugins`).
"""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, ClassVar, Generic, get_args

from mauve_rt._kernel import Log, PartFactory, ShellView
from mauve_rt.errors import PortTypeError
from mauve_rt.parts.message_types import is_message
from mauve_rt.parts.part import Configurable, implementation_name
from mauve_rt.parts.ports import Property, ReadPort, Sample, WritePort
from mauve_rt.parts.shells import Shell, shell_of

if TYPE_CHECKING:
    from typing_extensions import TypeVar

    ShellT = TypeVar("ShellT", bound=Shell, default=Any)
else:
    from typing import TypeVar

    ShellT = TypeVar("ShellT")

__all__ = ["Core", "Property", "ReadPort", "Sample", "Shell", "ShellT", "WritePort", "core_factory"]


class Core(Configurable, Generic[ShellT]):
    """Base of cores written in Python, for a shell: `class Hover(Core[HoverShell])`."""

    budget_ns: ClassVar[int] = 0
    """The time that adopt and take need together. A change with less left before the next release waits for
    the next wait. An adopt that takes longer is refused. After a longer adopt and take the component is
    FAULTED. 0: none is declared, and no time is checked."""

    state_fields: ClassVar[Mapping[str, str]] = {}
    """Attributes that a core which replaces this one takes over, with types: {"integral": "float64"}. Each is
    copied before take, where the other core, in Python or C++, has a field of the same name and type."""

    wcet_ns: ClassVar[Mapping[str, int]] = {}
    """Worst-case execution times of actions and guards for the timing analysis: {"follow": us_to_ns(200)}.
    An execution state takes that of its action and of the guards asked after it, and `enforce_wcet` enforces
    the sum."""

    _shell_class: ClassVar[type[Any]] = Shell

    def __init__(self, shell: ShellT) -> None:
        self.shell = shell

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        for base in getattr(cls, "__orig_bases__", ()):
            shells = [shell for shell in get_args(base)[:1] if isinstance(shell, type)]
            if shells and issubclass(shells[0], Shell):
                cls._shell_class = shells[0]

    def log(self) -> Log:
        """Lines for the console, /rosout and the bag: `self.log().warn("tracking error {} m", error)`."""
        log: Log = self.shell.log()
        return log

    def adopt(self, old: Any) -> bool | None:
        """Look whether to take over from `old`, and copy what is small; False or raising refuses.

        Called on the component's own thread inside its wait. `old` is the other core object, None when that
        is written in C++. In a change of several components the old core may run on between adopt and take.
        After a refusal the old core goes on as if nothing had been asked: leave it as it is.
        """

    def take(self, old: Any) -> None:
        """Move data over from `old`, after adopt(): bulk, and what may have changed since adopt().

        The change is decided by then: what is raised here is a fault of this core at its first action.
        """

    @classmethod
    def _part(cls) -> PartFactory:
        return PartFactory("core", implementation_name(cls), cls._make, dict(cls.wcet_ns))

    @classmethod
    def _make(cls, view: ShellView) -> "Core[Any]":
        shell: Any = shell_of(view)
        if not isinstance(shell, cls._shell_class):
            raise TypeError(
                f"the core was written for another shell: {cls.__qualname__} is for "
                f"{cls._shell_class.__qualname__}, found {view.implementation()}"
            )
        require_served(view, cls.__qualname__)
        return cls(shell)


def require_served(view: ShellView, core: str) -> None:
    """Whether a core in Python can use every port of a shell; unconnected optional ones aside.

    Raises:
        PortTypeError: a port's type has no class in Python.
    """
    for port in view.ports():
        if port.kind not in ("read", "write") or not (port.required or port.resource):
            continue
        if not is_message(port.type):
            raise PortTypeError(port.name, port.type, core=core)


def core_factory(core_class: Any) -> Callable[[ShellView], object]:
    """What `PluginRegistry.add_python_core` takes; also of a class that only looks like a Core."""
    if isinstance(core_class, type) and issubclass(core_class, Core):
        return core_class._make

    def make(view: ShellView) -> object:
        require_served(view, getattr(core_class, "__qualname__", repr(core_class)))
        return core_class(shell_of(view))

    return make
