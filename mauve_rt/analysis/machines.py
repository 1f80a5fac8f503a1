"""A component as the analysis takes it: its machine of states, and how its thread is scheduled."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Self

FOREVER_NS = 2**63 - 1
"""Of a wait that only an event or a stop ends."""


@dataclass(frozen=True)
class ExecutionTime:
    """How long an execution state takes at most, and who says so."""

    ns: int | None = None
    origin: str = "missing"
    why_missing: str = ""
    """Empty: nothing declares a part of it."""
    is_measured: bool = False
    """Whether it is the longest of a recording: a longer one may come."""

    def __str__(self) -> str:
        """As `0.200 ms, declared`."""
        return self.origin if self.ns is None else f"{in_ms(self.ns)}, {self.origin}"


@dataclass(frozen=True)
class State:
    """A state of the machine: an execution, a wait for a time, or a wait for an event."""

    name: str
    is_initial: bool
    is_wait: bool
    separation_ns: int
    """Of a wait: the least time from the release before it to that at its end; FOREVER_NS: none comes."""
    latest_ns: int
    """Of a wait: the longest such time; of a wait for an event its timeout."""
    is_event_wait: bool
    successors: tuple[str, ...]
    time: ExecutionTime = ExecutionTime()
    """Of an execution state; of a wait that of all guards that are asked at its end."""
    limit_ns: int = 0
    """Of an execution state: its wall-clock bound, above which the watchdog faults the component; 0: none."""
    is_enforced: bool = False
    """Whether an execution that uses more CPU time than `time` faults the component."""

    @classmethod
    def of(cls, told: Any) -> Self:
        """Of a mauve_msgs/msg/StateInfo, or what has the same fields."""
        return cls(
            name=told.name,
            is_initial=bool(told.is_initial),
            is_wait=bool(told.is_wait),
            separation_ns=int(told.min_interarrival_ns if told.is_event_wait else told.duration_ns),
            latest_ns=int(told.duration_ns),
            is_event_wait=bool(told.is_event_wait),
            successors=tuple(told.successors),
            time=_declared_time(told),
            limit_ns=int(told.max_execution_ns),
            is_enforced=bool(getattr(told, "wcet_enforced", False)),
        )

    @property
    def is_watched(self) -> bool:
        """Whether the watchdog faults the component for an execution that is too long."""
        return bool(self.limit_ns) or self.is_enforced

    def overrunning(self, overrun_ns: int) -> Self:
        """The same, with the CPU time that an execution can use before the watchdog ends it.

        `overrun_ns`: beyond an enforced worst case; not beyond the wall-clock bound.
        """
        if not self.is_enforced or self.time.ns is None:
            return self
        most_ns = self.time.ns + overrun_ns
        if self.limit_ns:
            most_ns = min(most_ns, max(self.limit_ns, self.time.ns))
        return replace(self, time=replace(self.time, ns=most_ns))


def _declared_time(told: Any) -> ExecutionTime:
    """The worst case, which a bag of an earlier version lacks; else the bound that is enforced.

    Only a DescribedState names the core that declares it; a StateInfo has the time alone. A wait asks a guard
    for each successor but the last.
    """
    if told.is_wait and len(told.successors) < _TWO:
        return ExecutionTime(0, "without a guard")
    core = getattr(told, "wcet_core", "")
    if wcet_ns := int(getattr(told, "wcet_ns", 0)):
        return ExecutionTime(wcet_ns, f"declared by core {core}" if core else "declared")
    if bound_ns := int(told.max_execution_ns):
        return ExecutionTime(bound_ns, "declared (its bound)")
    if methods := getattr(told, "methods_without_wcet", ()):
        return ExecutionTime(why_missing=f"core {core} declares no time of {', '.join(methods)}")
    return ExecutionTime()


_TWO = 2


@dataclass(frozen=True)
class Hold:
    """A resource whose lock the component holds for a time, and who says so."""

    resource: str
    longest_ns: int
    """Execution of one user, from lock to unlock."""
    origin: str = "declared"
    is_measured: bool = False

    def __str__(self) -> str:
        """As `map up to 2.000 ms, declared`."""
        return f"{self.resource} up to {in_ms(self.longest_ns)}, {self.origin}"


_CLIENT = "client"
"""Kind of a resource whose calls a ROS service answers: the caller waits for it, for no other component."""
_SERVICE = "/srv/"
"""In the type of a port that calls one; of a resource of unknown kind that says what it is."""
_WITHOUT_LOCK = ("latest_value", _CLIENT)
"""Kinds of resources: users do not wait for each other."""


@dataclass(frozen=True)
class Machine:
    """One component, or another thread that takes a CPU or a lock. Times in ns."""

    name: str
    cpus: tuple[int, ...]
    """That its thread may run on; none: any."""
    priority: int
    policy: str
    """As read back from the thread; empty: it does not run yet."""
    period_ns: int
    """g; 0: it waits for events, or does not run yet."""
    offset_ns: int
    """Of its instants, from the epoch on."""
    deadline_ns: int
    """From a release to the next wait; 0: the next instant."""
    overrun: str
    states: tuple[State, ...]
    is_python: bool | None = None
    """Whether it runs under the interpreter's lock; None: nobody knows."""
    holds: tuple[Hold, ...] = ()
    """Of the resources that its ports are connected to, those that declare for how long a lock is held."""
    undeclared_locks: tuple[str, ...] = ()
    """The others of these resources, as far as they have a lock."""
    clients: tuple[str, ...] = ()
    """Resources through which it calls ROS services and waits for their answers, as far as is known."""
    is_component: bool = True
    remedy: str = ""
    """Of another thread whose times are unknown: what to declare."""

    @classmethod
    def of(
        cls,
        told: Any,
        *,
        states: Sequence[Any] | None = None,
        is_python: bool | None = None,
        kinds: Mapping[str, str] | None = None,
    ) -> Self:
        """Of a mauve_msgs/msg/ComponentInfo, or what has the same fields.

        `kinds`: of resources, by name; each resource of an unknown kind has a lock, but for wait-free ports.
        """
        ports = [port for port in getattr(told, "ports", ()) if port.resource]
        locking = [port for port in ports if not getattr(port, "wait_free", False)]
        times = {port.resource: int(getattr(port, "longest_hold_ns", 0)) for port in locking}
        of_services = {port.resource: _CLIENT for port in locking if _SERVICE in getattr(port, "type", "")}
        kind_of = {**of_services, **(kinds or {})}
        return cls(
            name=told.name,
            cpus=tuple(int(cpu) for cpu in told.cpus),
            priority=int(told.priority),
            policy=told.policy,
            period_ns=int(told.period_ns),
            offset_ns=int(told.offset_ns),
            deadline_ns=int(told.deadline_ns),
            overrun=told.overrun,
            states=tuple(State.of(state) for state in (told.states if states is None else states)),
            is_python=is_python,
            holds=tuple(Hold(resource, time_ns) for resource, time_ns in sorted(times.items()) if time_ns),
            undeclared_locks=tuple(
                resource
                for resource, time_ns in sorted(times.items())
                if not time_ns and kind_of.get(resource) not in _WITHOUT_LOCK
            ),
            clients=tuple(resource for resource in sorted(times) if kind_of.get(resource) == _CLIENT),
        )

    def with_budgets(self, budgets: Mapping[str, ExecutionTime]) -> Self:
        """The same, with these times by state where it has none."""
        states = (
            state if state.time.ns is not None else replace(state, time=budgets.get(state.name, state.time))
            for state in self.states
        )
        return replace(self, states=tuple(states))

    def with_holds(self, times: Mapping[str, ExecutionTime]) -> Self:
        """The same, with these times by resource for locks of which no time is declared."""
        known = {name: times[name] for name in self.undeclared_locks if name in times and times[name].ns}
        added = (Hold(name, time.ns or 0, time.origin, time.is_measured) for name, time in known.items())
        holds = sorted((*self.holds, *added), key=lambda hold: hold.resource)
        rest = tuple(name for name in self.undeclared_locks if name not in known)
        return replace(self, holds=tuple(holds), undeclared_locks=rest)

    def without_locks(self, resources: Collection[str]) -> Self:
        """The same, without undeclared locks of these resources."""
        rest = tuple(name for name in self.undeclared_locks if name not in resources)
        return replace(self, undeclared_locks=rest)

    @property
    def resources(self) -> set[str]:
        """Those whose locks it holds for a time."""
        return {hold.resource for hold in self.holds}

    @property
    def locks(self) -> set[str]:
        """Resources whose locks it takes."""
        return {*self.resources, *self.undeclared_locks}

    @property
    def missing(self) -> tuple[str, ...]:
        """States whose time is not known: executions, and waits with guards."""
        return tuple(state.name for state in self.states if state.time.ns is None)

    @property
    def is_enforced(self) -> bool:
        """Whether the worst case of each execution is enforced."""
        executions = [state for state in self.states if not state.is_wait]
        return bool(executions) and all(state.is_enforced for state in executions)

    @property
    def has_guarded_waits(self) -> bool:
        """Whether guards decide where a wait leads."""
        return any(state.is_wait and len(state.successors) > 1 for state in self.states)

    @property
    def measured(self) -> tuple[str, ...]:
        """States and locks whose times are measured."""
        states = (state.name for state in self.states if state.time.is_measured)
        return (*states, *(hold.resource for hold in self.holds if hold.is_measured))


def in_ms(time_ns: int) -> str:
    """As `0.200 ms`."""
    return f"{time_ns / 1e6:,.3f} ms"
