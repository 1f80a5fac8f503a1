"""Which declared time a job exceeded that took longer than its bound: the terms of its busy window, compared.

The trace has wall-clock times. Under SCHED_FIFO they give the CPU time of each execution: its length without
the jobs of higher priority on the same CPU, and without waits for locks. A thread that is no component leaves
no record: where one preempts a state, its time counts as that of the state.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import IntEnum
from typing import NamedTuple

from mauve_rt.analysis.machines import Machine, in_ms


class Term(IntEnum):
    """What a bound consists of; numbers of mauve_msgs/msg/BoundViolation."""

    EXECUTION = 0
    GUARD = 1
    BLOCKING = 2
    WAKE_UP = 3
    REST = 4


class Interval(NamedTuple):
    """From an instant to another one, in ns."""

    begin_ns: int
    end_ns: int


@dataclass
class TracedJob:
    """A job as the trace has it. Instants in ns."""

    component: str
    after: str
    """The wait that it follows; of the first job after a start the initial state."""
    instant_ns: int
    ready_ns: int
    """Its instant, or the end of the component's job before it, which came later."""
    begin_ns: int
    end_ns: int
    executions: list[tuple[str, Interval]] = field(default_factory=list)
    lock_waits: list[tuple[str, Interval]] = field(default_factory=list)
    """By resource."""


class Excess(NamedTuple):
    """A term that took longer than declared."""

    term: Term
    element: str
    """COMPONENT.STATE, COMPONENT.WAIT or a resource; empty: none."""
    took_ns: int
    declared_ns: int

    @property
    def excess_ns(self) -> int:
        """By how much."""
        return self.took_ns - self.declared_ns

    @property
    def text(self) -> str:
        """In words."""
        figures = f"took {in_ms(self.took_ns)} ({in_ms(self.declared_ns)} declared)"
        match self.term:
            case Term.EXECUTION:
                return f"execution of {self.element} {figures}, or a thread outside the model had its CPU"
            case Term.GUARD:
                return f"guards of {self.element} {figures}"
            case Term.BLOCKING:
                return f"waiting for the lock of {self.element} {figures}"
            case Term.WAKE_UP:
                return f"wake-up of {self.element} {figures}"
        took = f"a foreign thread or overhead took {in_ms(self.took_ns)}"
        return f"{took}: no component exceeded its declared times by as much"


def largest_excess(
    job: TracedJob,
    jobs: Sequence[TracedJob],
    machines: Mapping[str, Machine],
    *,
    bound_ns: int,
    wakeup_ns: int,
) -> Excess:
    """The term of a job that exceeded its declared time by most.

    Args:
        job: the one above its bound.
        jobs: all jobs while it lasted, of all components.
        machines: the components, by name.
        bound_ns: of the job.
        wakeup_ns: as for `bounds_of`.

    """
    found = [one for one in _excesses(job, jobs, machines, wakeup_ns) if one.excess_ns > 0]
    known_ns = sum(one.excess_ns for one in found)
    rest_ns = job.end_ns - job.instant_ns - bound_ns - known_ns
    return max([*found, Excess(Term.REST, "", rest_ns, 0)], key=lambda one: one.excess_ns)


def _excesses(
    job: TracedJob, jobs: Sequence[TracedJob], machines: Mapping[str, Machine], wakeup_ns: int
) -> Iterator[Excess]:
    own = machines[job.component]
    here = [each for each in jobs if each.component in machines and machines[each.component].cpus == own.cpus]
    urgent = _intervals(here, machines, from_priority=own.priority, but=job.component)
    late_ns = _free_ns(Interval(job.ready_ns, job.begin_ns), urgent)
    yield Excess(Term.WAKE_UP, job.component, late_ns, wakeup_ns)
    for each in here:
        machine = machines[each.component]
        is_level = each.component == job.component or machine.priority >= own.priority
        if is_level and each.begin_ns < job.end_ns and each.end_ns > job.instant_ns:
            above = _intervals(here, machines, from_priority=machine.priority + 1, but=each.component)
            yield from _excesses_of(each, machine, above)


def _excesses_of(job: TracedJob, machine: Machine, above: Sequence[Interval]) -> Iterator[Excess]:
    """`above`: when components of higher priority had the CPU."""
    declared_ns = {state.name: state.time.ns or 0 for state in machine.states}
    elsewhere = [*above, *(waited for _, waited in job.lock_waits)]
    first_ns = job.executions[0][1].begin_ns if job.executions else job.end_ns
    guards_ns = _free_ns(Interval(job.begin_ns, first_ns), elsewhere)
    yield Excess(Term.GUARD, f"{job.component}.{job.after}", guards_ns, declared_ns.get(job.after, 0))
    for state, interval in job.executions:
        took_ns = _free_ns(interval, elsewhere)
        yield Excess(Term.EXECUTION, f"{job.component}.{state}", took_ns, declared_ns.get(state, 0))
    holds_ns = {hold.resource: hold.longest_ns for hold in machine.holds}
    for resource in dict.fromkeys(name for name, _ in job.lock_waits):
        waits = [waited for name, waited in job.lock_waits if name == resource]
        waited_ns = sum(_free_ns(waited, above) for waited in waits)
        yield Excess(Term.BLOCKING, resource, waited_ns, holds_ns.get(resource, 0))


def _intervals(
    jobs: Iterable[TracedJob], machines: Mapping[str, Machine], *, from_priority: int, but: str
) -> list[Interval]:
    """When components of this priority or a higher one had the CPU, without waits for locks."""
    found: list[Interval] = []
    for job in jobs:
        if job.component == but or machines[job.component].priority < from_priority:
            continue
        begin_ns = job.begin_ns
        for _, waited in sorted(job.lock_waits, key=lambda one: one[1]):
            found.append(Interval(begin_ns, waited.begin_ns))
            begin_ns = waited.end_ns
        found.append(Interval(begin_ns, job.end_ns))
    return found


def _free_ns(interval: Interval, taken: Iterable[Interval]) -> int:
    """How long an interval is without the others, which may overlap."""
    free_ns, at_ns = 0, interval.begin_ns
    for begin_ns, end_ns in sorted(taken):
        free_ns += max(0, min(begin_ns, interval.end_ns) - at_ns)
        at_ns = max(at_ns, end_ns)
    return free_ns + max(0, interval.end_ns - at_ns)
