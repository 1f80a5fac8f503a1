"""Bounds of the response times of an architecture's components, as far as all that delays them is known."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Self

from mauve_rt.analysis.critical_section import CriticalSection
from mauve_rt.analysis.digraph import START, DigraphTask, digraph_of, period_of
from mauve_rt.analysis.digraph_times import Component, DigraphTimes, JobTime, digraph_times
from mauve_rt.analysis.machines import FOREVER_NS, Machine, in_ms
from mauve_rt.analysis.obstacles import obstacles
from mauve_rt.analysis.offsets import Grid, times_with_offsets
from mauve_rt.analysis.time_limit import check_time_limit


@dataclass(frozen=True)
class Subject:
    """A component under analysis, or another thread."""

    machine: Machine
    task: DigraphTask
    obstacles: tuple[str, ...]
    """What keeps it from being proved."""

    @classmethod
    def of(
        cls, machine: Machine, others: Sequence[Machine] = (), *, overhead_ns: int = 0, overrun_ns: int = 0
    ) -> Self:
        """With its jobs, its period where it does not run yet, and what is missing.

        `others`: components and threads of the same architecture; the component may be among them.
        `overhead_ns`: what a release costs beside the states, on this computer. `overrun_ns`: CPU time that
        an execution uses beyond its enforced worst case before the watchdog ends it.
        """
        states = tuple(state.overrunning(overrun_ns) for state in machine.states)
        task = digraph_of(replace(machine, states=states), overhead_ns=overhead_ns)
        if not machine.period_ns and not any(state.is_event_wait for state in machine.states):
            machine = replace(machine, period_ns=period_of(task))
        return cls(machine, task, tuple(obstacles(machine, others)))

    @property
    def name(self) -> str:
        """The component's."""
        return self.machine.name

    @property
    def sections(self) -> tuple[CriticalSection, ...]:
        """Of a job: a component holds no lock for longer than a job takes."""
        longest_ns = max(self.task.largest_cost_ns or 0, 1) if self.machine.is_component else FOREVER_NS
        return tuple(
            CriticalSection(resource=hold.resource, length_ns=min(hold.longest_ns, longest_ns))
            for hold in self.machine.holds
        )


OFFSETS = "offsets"


@dataclass(frozen=True)
class Bound:
    """Of the jobs of a component."""

    response_ns: int | None
    """The longest: from an instant to the next wait; None: nothing is known."""
    deadline_ns: int
    """Of that job; of the first late one, where one is late."""
    reason: str = ""
    """Why there is no bound."""
    blocking_ns: int = 0
    """The part of it in which components of lower priority hold locks."""
    jobs: tuple[JobTime, ...] = field(default=(), compare=False)
    walls_ns: Mapping[str, int] = field(default_factory=dict, compare=False)
    """Of each execution state the longest time from its begin to its end."""
    too_long: tuple[str, ...] = ()
    """What may last beyond its wall-clock bound, in words."""
    by: str = ""
    """OFFSETS: it holds while components keep their offsets; empty: it holds for any offsets."""

    @property
    def how(self) -> str:
        """As ` (with offsets)`, to stand behind the bound."""
        return f" (with {self.by})" if self.by else ""

    @property
    def meets_deadline(self) -> bool:
        """Whether each job comes to its wait in time and no state is cut off, if the assumptions hold."""
        in_time = self.response_ns is not None and self.response_ns <= self.deadline_ns
        return in_time and not self.too_long


def jobs_by_waits(machine: Machine, bound: Bound) -> dict[tuple[str, str], JobTime]:
    """The jobs of a bound by the names that a trace has: of the wait before a job and of the wait after it.

    The first job after a start follows no wait: a trace names the initial state.
    """
    initial = next((state.name for state in machine.states if state.is_initial), "")
    return {(initial if one.job.after == START else one.job.after, one.job.until): one for one in bound.jobs}


def bounds_of(subjects: Sequence[Subject], *, wakeup_ns: int = 0) -> dict[str, Bound]:
    """The bound of each component; where a deadline would not be met without offsets, with them.

    `wakeup_ns`: how long after its instant a thread begins at the latest, on this computer.
    """
    times: dict[str, DigraphTimes] = {}
    levels: dict[str, list[Subject]] = {}
    for here in by_cpu(subjects):
        found = _times_of_cpu(tuple(here), wakeup_ns)
        times |= {subject.name: found[subject.name] for subject in here if subject.machine.is_component}
        levels |= {subject.name: here for subject in here}
    bounds: dict[str, Bound] = {}
    for subject in subjects:
        if not subject.machine.is_component:
            continue
        bound = bound_of(subject, subjects, times)
        if bound.response_ns is not None and not bound.meets_deadline:
            check_time_limit()
            shorter = _with_offsets(subject, tuple(levels[subject.name]), wakeup_ns)
            if shorter != times[subject.name]:
                bound = replace(bound_of(subject, subjects, {**times, subject.name: shorter}), by=OFFSETS)
        bounds[subject.name] = bound
    return bounds


_KEPT_CPUS = 64
"""Results of the last ones: a change that touches one CPU leaves the bounds of the others."""


@lru_cache(maxsize=_KEPT_CPUS)
def _times_of_cpu(here: tuple[Subject, ...], wakeup_ns: int) -> Mapping[str, DigraphTimes]:
    return digraph_times([component_of(subject, jitter_ns=wakeup_ns) for subject in here])


@lru_cache(maxsize=_KEPT_CPUS)
def _with_offsets(subject: Subject, here: tuple[Subject, ...], wakeup_ns: int) -> DigraphTimes:
    without = _times_of_cpu(here, wakeup_ns)[subject.name]
    components = {each.name: component_of(each, jitter_ns=wakeup_ns) for each in here}
    limits_ns = {state.name: state.limit_ns for state in subject.machine.states}
    own = components[subject.name]
    states = [state for state in own.states if 0 < limits_ns[state[0]] < without.walls_ns[state[0]]]
    components[subject.name] = own = replace(own, states=tuple(states))  # the bounds of others do
    grids = {each.name: grid for each in here if (grid := grid_of(each.machine)) is not None}
    return times_with_offsets(own, [*components.values()], grids, without)


def grid_of(machine: Machine) -> Grid | None:
    """At which instants its jobs arrive; None: no grid has them all."""
    if not machine.is_component or not machine.period_ns:
        return None
    waits = [state for state in machine.states if state.is_wait]
    spacings_ns = [wait.separation_ns for wait in waits if wait.separation_ns != FOREVER_NS]
    if any(wait.is_event_wait for wait in waits) or any(ns % machine.period_ns for ns in spacings_ns):
        return None
    return Grid(machine.period_ns, machine.offset_ns)


def component_of(subject: Subject, *, jitter_ns: int) -> Component:
    """As the analysis of response times takes it."""
    machine = subject.machine
    return Component(
        subject.task,
        machine.priority,
        jitter_ns=jitter_ns,
        sections=subject.sections,
        waits_for_services=bool(machine.clients),
        states=tuple((state.name, state.time.ns or 0) for state in machine.states if not state.is_wait),
    )


def by_cpu(subjects: Sequence[Subject]) -> list[list[Subject]]:
    """Those without obstacles: components of each CPU, and threads that may run there."""
    known = [subject for subject in subjects if not subject.obstacles]
    cpus = sorted({subject.machine.cpus for subject in known if subject.machine.is_component})
    return [[subject for subject in known if _runs_on(subject.machine, each)] for each in cpus]


def _runs_on(machine: Machine, cpus: tuple[int, ...]) -> bool:
    """Whether a component runs on these CPUs, or another thread may."""
    if machine.is_component:
        return machine.cpus == cpus
    return not machine.cpus or bool({*machine.cpus} & {*cpus})


def delaying(subject: Subject, subjects: Sequence[Subject]) -> list[Subject]:
    """Those that may delay it and of which something is missing."""
    return [other for other in subjects if other.obstacles and _may_delay(other, subject, among=subjects)]


def bound_of(subject: Subject, subjects: Sequence[Subject], times: Mapping[str, DigraphTimes]) -> Bound:
    """Of a component, by the times of its CPU."""
    deadline_ns = min((job.deadline_ns for job in subject.task.jobs), default=0)
    if subject.obstacles:
        return Bound(None, deadline_ns, "it is not provable")
    unknown = [other.name for other in delaying(subject, subjects)]
    if unknown:
        return Bound(None, deadline_ns, f"{', '.join(unknown)} may delay it, and nothing is proved of that")
    found = times[subject.name]
    caller = _blocked_caller(subject, subjects, times)
    if caller is not None:
        names = ", ".join(caller.clients)
        reason = f"a lock may block {caller.name} again after each wait for a service ({names})"
        return Bound(None, deadline_ns, reason)
    if found.reason:
        return Bound(None, deadline_ns, found.reason, found.blocking_ns)
    if not found.jobs:
        return Bound(0, 0)
    late = [one for one in found.jobs if one.response_ns > one.job.deadline_ns]
    shown = max(late or found.jobs, key=lambda one: (one.response_ns, -one.job.deadline_ns))
    return Bound(
        shown.response_ns,
        shown.job.deadline_ns,
        blocking_ns=found.blocking_ns,
        jobs=found.jobs,
        walls_ns=found.walls_ns,
        too_long=tuple(_too_long(subject.machine, found.walls_ns)),
    )


def _blocked_caller(
    subject: Subject, subjects: Sequence[Subject], times: Mapping[str, DigraphTimes]
) -> Machine | None:
    """A component that waits for services and that locks may block: the subject, or one that may delay it.

    While it waits, one of lower priority may lock again: `blocking_ns` covers only one such section.
    """
    here = subject.machine
    callers = (other.machine for other in subjects if other.machine.clients and other.name in times)
    blocked = [
        one
        for one in callers
        if one.cpus == here.cpus and one.priority >= here.priority and times[one.name].blocking_ns
    ]
    return here if here in blocked else next(iter(blocked), None)


def _too_long(machine: Machine, walls_ns: Mapping[str, int]) -> Iterator[str]:
    for state in machine.states:
        wall_ns = walls_ns.get(state.name, 0)
        if state.limit_ns and wall_ns > state.limit_ns:
            yield (
                f"{state.name} may last {in_ms(wall_ns)}, preemption and blocking included, and its "
                f"max_execution_ns is {in_ms(state.limit_ns)}"
            )


def _may_delay(other: Subject, subject: Subject, *, among: Sequence[Subject]) -> bool:
    """Whether it may run on the subject's CPU, with a priority of its own or an inherited one."""
    if other is subject:
        return False
    cpus = {*other.machine.cpus}
    meet = not cpus or bool(cpus & {*subject.machine.cpus})
    sharing = (each.machine for each in among if each.machine.locks & other.machine.locks)
    highest = max(other.machine.priority, *(machine.priority for machine in sharing), 0)
    return meet and highest >= subject.machine.priority
