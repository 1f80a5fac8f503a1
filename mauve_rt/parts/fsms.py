"""State machines written in Python, declared with the words of C++.

    class HoverFsm(Fsm[HoverShell, HoverCore]):
        def define(self) -> None:
            follow = self.execution("Follow", HoverCore.follow)
            rest = self.wait("Rest", ms_to_ns(20))
            self.set_initial(follow)
            self.next(follow, rest)
            self.next(rest, follow)

The machine is run by the kernel, on the component's grid; only actions and guards are in Python. Methods are
found in the core by name, which a core in C++ does not offer: an fsm in Python needs a core in Python.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Generic

from mauve_rt._kernel import Duration, FsmBuilder, PartFactory, ShellView
from mauve_rt.parts.cores import Core, ShellT
from mauve_rt.parts.part import Configurable, implementation_name
from mauve_rt.parts.ports import Property, ReadPort
from mauve_rt.parts.shells import shell_of

if TYPE_CHECKING:
    from typing_extensions import TypeVar

    CoreT = TypeVar("CoreT", bound=Core[Any], default=Any)
else:
    from typing import TypeVar

    CoreT = TypeVar("CoreT")

__all__ = ["Duration", "Fsm", "PeriodicFsm", "State", "times"]


def times(factor: int, property: Property[int]) -> Duration:  # noqa: A002 - the word of the shell
    """A number of times an int property whose unit is ns, us, ms or s; its text is `5 * unit_ms`.

        self.wait("W5", times(5, self.shell.unit_ms))

    Raises:
        MauveError: invalid_argument (no such property), out_of_range (longer than a time can be).
    """
    return property.times(factor)


@dataclass(frozen=True)
class State:
    """A state of a machine."""

    name: str


class Fsm(Configurable, Generic[ShellT, CoreT]):
    """Base of state machines written in Python. All but define() and the hooks is called in define()."""

    _builder: FsmBuilder | None = None

    def __init__(self, shell: ShellT) -> None:
        self.shell = shell

    def define(self) -> None:
        """Declare states and transitions; the shell's properties are set by then."""
        raise NotImplementedError(f"{type(self).__qualname__} lacks define()")

    def execution(
        self,
        name: str,
        method: str | Callable[[CoreT], object],
        *,
        max_execution_ns: int = 0,
        simulated_execution_ns: int = 0,
        wcet_ns: int = 0,
    ) -> State:
        """A state that runs a method of the core, given by its name or as `HoverCore.follow`.

        `max_execution_ns` is its bound, which the watchdog enforces, 0: none; `simulated_execution_ns` is
        what it takes in virtual time; `wcet_ns` is its worst-case execution time, which the timing analysis
        takes and `enforce_wcet` enforces, 0: not declared.
        """
        times = (max_execution_ns, simulated_execution_ns, wcet_ns)
        self._machine.execution(name, _method_name(method), *times)
        return State(name)

    def wait(self, name: str, duration_ns: int | Duration) -> State:
        """A state that advances the component's clock by a duration > 0 and sleeps until then.

        `FOREVER`: until the component is stopped; such a state leads nowhere, and needs no next().
        """
        self._machine.wait(name, _duration(duration_ns))
        return State(name)

    def wait_event(
        self,
        name: str,
        port: ReadPort[Any] | str,
        timeout_ns: int | Duration,
        min_interarrival_ns: int | Duration,
    ) -> State:
        """A state that waits for a write to the resource that a read port is connected to.

        The clock goes on to the event's time, but by `min_interarrival_ns` at least; or by the timeout when
        no event comes. Both > 0. A machine with such a state is sporadic: it has no period.
        """
        port_name = port if isinstance(port, str) else port.name
        durations = (_duration(timeout_ns), _duration(min_interarrival_ns))
        self._machine.wait_event(name, port_name, *durations)
        return State(name)

    def set_initial(self, state: State) -> None:
        """Where the component starts, on its grid."""
        self._machine.set_initial(state.name)

    def next(self, state: State, to: State) -> None:
        """Where a state goes when no transition's guard holds. Every state needs one."""
        self._machine.next(state.name, to.name)

    def transition(self, state: State, guard: str | Callable[[CoreT], bool], to: State) -> None:
        """Go to `to` when the guard holds after the state, of a wait when it has ended.

        Guards are asked in the order of declaration.
        """
        self._machine.transition(state.name, _method_name(guard), to.name)

    @property
    def _machine(self) -> FsmBuilder:
        if self._builder is None:
            raise RuntimeError("states are declared in define() only")
        return self._builder

    def _define(self, builder: FsmBuilder) -> None:
        self._builder = builder
        try:
            self.define()
        finally:
            self._builder = None

    @classmethod
    def _part(cls) -> PartFactory:
        return PartFactory("fsm", implementation_name(cls), cls._make)

    @classmethod
    def _make(cls, view: ShellView) -> "Fsm[Any, Any]":
        return cls(shell_of(view))


class PeriodicFsm(Fsm[ShellT, CoreT], Generic[ShellT, CoreT]):
    """A machine that executes one state in each period, as in C++ (Fig. 2 of the paper).

    A state S becomes an execution state S and a wait "AwaitS" of one period before it: guards are asked right
    after the action, and what they choose is executed one period later.
    """

    _period = Duration(0)

    def period(self, period_ns: int | Duration) -> None:
        """The one period of all states. Called once, before the first state."""
        self._period = _duration(period_ns)
        self._machine.divisor(self._period.ns)

    def periodic_state(
        self, name: str, method: str | Callable[[CoreT], object], *, max_execution_ns: int = 0
    ) -> State:
        """A state that runs a method of the core. Where no guard holds and next() says nothing, it stays.

        Raises:
            RuntimeError: period() was not called.
        """
        if self._period.ns == 0:
            raise RuntimeError("the period is not given; call period() before the first state")
        state, release = State(name), self.wait(_release_of(name), self._period)
        self.execution(name, method, max_execution_ns=max_execution_ns)
        super().next(release, state)
        super().next(state, release)
        return state

    def next(self, state: State, to: State) -> None:
        """Where a state goes when no transition's guard holds."""
        super().next(state, State(_release_of(to.name)))

    def transition(self, state: State, guard: str | Callable[[CoreT], bool], to: State) -> None:
        """Go to `to` when the guard holds after the action; guards are asked in the order of declaration."""
        super().transition(state, guard, State(_release_of(to.name)))


def _release_of(name: str) -> str:
    """The wait before an action."""
    return f"Await{name}"


def _method_name(method: str | Callable[..., object]) -> str:
    return method if isinstance(method, str) else method.__name__


def _duration(length: int | Duration) -> Duration:
    return length if isinstance(length, Duration) else Duration(length)
