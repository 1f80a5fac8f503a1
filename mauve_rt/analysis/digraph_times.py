"""Response times of digraph tasks on one CPU under SCHED_FIFO: each job of each path in a busy window.

A sporadic task is a digraph with one vertex. Where the paths of all tasks that delay a job are few, each
combination of them is tried: exact. Else of each such task the most that it can ask for counts, which may be
of one path at one instant and of another at the next: sound, and more than one run can show.

Time 0 is the start of the busy window. Intervals of execution are half-open: a job that finishes at F
occupied [0, F), and a job of higher priority that is released at F itself does not delay it. Intervals
before a start are closed: a job that starts at S has waited for all jobs of higher and equal priority
released in [0, S].

Under SCHED_FIFO, a job of equal priority that is released later does not preempt. That does not make jobs
first in, first out: the kernel queues threads, and a thread keeps its place until it sleeps. A thread with
a backlog goes on with jobs that are released after those of the threads behind it. So all jobs of equal
priority released up to the start count, not only those released up to the job's own release.

Components share resources, whose mutexes inherit priorities: `blocking` bounds how long components of lower
priority run in a busy window. A thread that waits for a lock or for a ROS service leaves the kernel's queue,
so for a component that does so all others of its priority count as higher.

An execution state is bounded as well, from its begin to its end: by the same demands.

Sources: Lehoczky, "Fixed priority scheduling of periodic task sets with arbitrary deadlines", RTSS 1990
(busy window, every job of it); Tindell, Burns, Wellings, "An extendible approach for analyzing fixed
priority hard real-time tasks", Real-Time Systems 6, 1994 (release jitter, blocking); Stigge, Yi,
"Combinatorial Abstraction Refinement for Feasibility Analysis of Static Priorities", Real-Time Systems 51,
2015: its abstract test and its exact one, without the refinement between the two.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field
from fractions import Fraction
from itertools import product, takewhile
from typing import Protocol

from mauve_rt.analysis.blocking import blocking_ns, shares_a_resource
from mauve_rt.analysis.critical_section import CriticalSection
from mauve_rt.analysis.demand import Demand, Path, Staircase, cost_of, paths, utilization_of
from mauve_rt.analysis.digraph import DigraphTask, Job
from mauve_rt.analysis.errors import AnalysisError
from mauve_rt.analysis.fixed_point import UnboundedError, least_time_ns
from mauve_rt.analysis.time_limit import check_time_limit

_MOST_COMBINATIONS = 64


@dataclass(frozen=True)
class Component:
    """A digraph task, the cost of each job known, with a thread of its own.

    Raises:
        AnalysisError: a section is inside a resource that no section of the component is of.

    """

    task: DigraphTask
    priority: int
    _: KW_ONLY
    jitter_ns: int = 0
    """The longest delay from the arrival of a job to its release."""
    sections: tuple[CriticalSection, ...] = ()
    """Of any of its jobs."""
    waits_for_services: bool = False
    """Its jobs wait for ROS services: these waits are in their costs."""
    states: tuple[tuple[str, int], ...] = ()
    """Name and cost of those to bound each by itself."""

    def __post_init__(self) -> None:
        locked = {section.resource for section in self.sections}
        for section in self.sections:
            if section.inside and section.inside not in locked:
                raise AnalysisError(
                    f"component {self.name}, section of {section.resource}",
                    "inside",
                    expected="a resource that the component locks",
                    found=section.inside,
                    remedy=f"Add the section of {section.inside}",
                )

    @property
    def name(self) -> str:
        """The task's."""
        return self.task.name


@dataclass(frozen=True)
class JobTime:
    """The bound of one kind of job, from its arrival to its finish."""

    job: Job
    response_ns: int


@dataclass(frozen=True)
class DigraphTimes:
    """The bounds of one component."""

    jobs: tuple[JobTime, ...] = ()
    reason: str = ""
    """Why there are none."""
    blocking_ns: int = 0
    """For how long components of lower priority run in a busy window, as far as they hold locks."""
    walls_ns: Mapping[str, int] = field(default_factory=dict)
    """Of each state the longest time from its begin to its end; none where there is no bound."""

    @property
    def response_ns(self) -> int | None:
        """The longest."""
        return None if self.reason else max((one.response_ns for one in self.jobs), default=0)


def digraph_times(components: Sequence[Component]) -> dict[str, DigraphTimes]:
    """The bounds of all components of one CPU, by name.

    Raises:
        AnalysisError: as for `ceilings`.

    """
    demands = {one.name: Demand(one.task, jitter_ns=one.jitter_ns) for one in components}
    loads = {one.name: utilization_of(one.task) for one in components}
    return {one.name: _times(one, components, demands, loads) for one in components}


def _times(
    one: Component,
    components: Sequence[Component],
    demands: Mapping[str, Demand],
    loads: Mapping[str, Fraction],
) -> DigraphTimes:
    check_time_limit()
    higher, equal = level_of(one, components)
    level = (one, *higher, *equal)
    load = sum((loads[each.name] for each in level), start=Fraction(0))
    blocked_ns = blocking_ns(one, components)
    has_more = blocked_ns > 0 or any(each.jitter_ns for each in level)
    if reason := overload(load, has_more=has_more):
        return DigraphTimes(reason=reason, blocking_ns=blocked_ns)
    try:
        window = _Window(
            demands[one.name],
            [demands[other.name] for other in higher],
            [demands[other.name] for other in equal],
            blocking_ns=blocked_ns,
        )
        longest: dict[Job, int] = {}
        for path in _within(one.task, window.length_ns + one.jitter_ns):
            arrival_ns = path.release_ns - one.jitter_ns
            response_ns = window.finish_ns(path) - arrival_ns
            longest[path.job] = max(response_ns, longest.get(path.job, 0))
        walls_ns = {name: window.wall_ns(cost_ns) for name, cost_ns in one.states}
    except UnboundedError as error:
        return DigraphTimes(reason=str(error), blocking_ns=blocked_ns)
    jobs = tuple(JobTime(job, longest[job]) for job in one.task.jobs)
    return DigraphTimes(jobs, blocking_ns=blocked_ns, walls_ns=walls_ns)


def level_of(
    one: Component, components: Sequence[Component]
) -> tuple[Sequence[Component], Sequence[Component]]:
    """Which others count as of higher priority, and which as of equal priority."""
    higher = [other for other in components if other.priority > one.priority]
    equal = [other for other in components if other.priority == one.priority and other is not one]
    if one.waits_for_services or shares_a_resource(one, components):
        return [*higher, *equal], []
    return higher, equal


def overload(load: Fraction, *, has_more: bool) -> str:
    """Why there is no bound at this load; empty: there may be one. `has_more`: blocking or late wake-ups."""
    if load < 1 or (load == 1 and not has_more):
        return ""
    more = "" if load > 1 else ", and blocking or late wake-ups come on top"
    return f"the utilization at this priority is {float(load):.4g}{more}: nothing is left"


def _within(task: DigraphTask, end_ns: int) -> Iterator[Path]:
    """The paths whose last job is released before the window can end."""
    return takewhile(lambda path: path.release_ns < end_ns, paths(task))


class _Window:
    """The longest busy window of a task, and what delays its jobs there."""

    def __init__(
        self, own: Demand, higher: Sequence[Demand], equal: Sequence[Demand], *, blocking_ns: int
    ) -> None:
        self.length_ns = window_ns((own, *higher, *equal), blocking_ns)
        self._most = Delay(higher, equal, blocking_ns)
        each = _of_each_path((*higher, *equal), self.length_ns)
        self._delays = [Delay(one[: len(higher)], one[len(higher) :], blocking_ns) for one in each]

    def finish_ns(self, path: Path) -> int:
        """When the last job of a path is done at the latest, from the window's start on."""
        return max(delay.finish_ns(path) for delay in self._delays)

    def wall_ns(self, cost_ns: int) -> int:
        """How long an execution can last."""
        return self._most.wall_ns(cost_ns)


def _of_each_path(demands: Sequence[Demand], until_ns: int) -> list[tuple[Staircase, ...]]:
    """Combinations of paths of these tasks; where they are too many, the one of all that each can ask for."""
    found: list[list[Staircase]] = []
    left = _MOST_COMBINATIONS
    for demand in demands:
        ways = demand.of_each_path(until_ns, most=left)
        if ways is None:
            return [tuple(demands)]
        found.append(ways)
        left //= max(len(ways), 1)
    return [*product(*found)]


class Work(Protocol):
    """What a task asks for."""

    def in_ns(self, length_ns: int) -> int:
        """In a half-open interval of this length."""

    def until_ns(self, instant_ns: int) -> int:
        """In the closed [0, instant]."""


def window_ns(everything: Sequence[Work], blocking_ns: int) -> int:
    """The longest busy window: the least L > 0 with blocking + the demand of all in [0, L) <= L."""
    return least_time_ns(lambda length_ns: blocking_ns + sum(one.in_ns(length_ns) for one in everything), 1)


@dataclass(frozen=True)
class Delay:
    """The jobs of other tasks, and those of lower priority that block."""

    higher: Sequence[Work]
    equal: Sequence[Work]
    blocking_ns: int

    def finish_ns(self, path: Path) -> int:
        """When the last job of a path is done at the latest, from the window's start on."""
        equal_ns = 0
        if self.equal:
            before_ns = self.blocking_ns + path.work_ns - cost_of(path.job)
            others = (*self.higher, *self.equal)
            start_ns = least_time_ns(
                lambda time_ns: before_ns + sum(one.until_ns(time_ns) for one in others), before_ns
            )
            equal_ns = sum(one.until_ns(start_ns) for one in self.equal)
        return self.wall_ns(path.work_ns + equal_ns)

    def wall_ns(self, cost_ns: int) -> int:
        """How long an execution can last: the least w with cost + blocking + the higher demand in w <= w.

        It has begun, so no component of equal priority goes first.
        """
        fixed_ns = self.blocking_ns + cost_ns
        return least_time_ns(
            lambda time_ns: fixed_ns + sum(one.in_ns(time_ns) for one in self.higher), fixed_ns
        )
