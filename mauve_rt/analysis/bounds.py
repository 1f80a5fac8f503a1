"""Bounds of the response times of an architecture's components, as far as all that delays them is known."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Self

from mauve_rt.analysis.digraph import DigraphTask, digraph_of, period_of
from mauve_rt.analysis.digraph_times import Component, DigraphTimes, digraph_times
from mauve_rt.analysis.machines import Machine
from mauve_rt.analysis.obstacles import obstacles
from mauve_rt.analysis.task import CriticalSection


@dataclass(frozen=True)
class Subject:
    """A component under analysis."""

    machine: Machine
    task: DigraphTask
    obstacles: tuple[str, ...]
    """What keeps it from being proved."""

    @classmethod
    def of(cls, machine: Machine, others: Sequence[Machine] = ()) -> Self:
        """With its jobs, its period where it does not run yet, and what is missing.

        `others`: components of the same architecture; the component may be among them.
        """
        task = digraph_of(machine)
        if not machine.period_ns and not any(state.is_event_wait for state in machine.states):
            machine = replace(machine, period_ns=period_of(task))
        return cls(machine, task, tuple(obstacles(machine, others)))

    @property
    def name(self) -> str:
        """The component's."""
        return self.machine.name

    @property
    def sections(self) -> tuple[CriticalSection, ...]:
        """Of a job: no lock is held for longer than a job takes."""
        longest_ns = max(self.task.largest_cost_ns or 0, 1)
        return tuple(
            CriticalSection(resource=hold.resource, length_ns=min(hold.longest_ns, longest_ns))
            for hold in self.machine.holds
        )


@dataclass(frozen=True)
class Bound:
    """Of the job of a component that comes closest to its deadline."""

    response_ns: int | None
    """From its instant to the next wait at the latest; None: nothing is known."""
    deadline_ns: int
    reason: str = ""
    """Why there is no bound."""
    blocking_ns: int = 0
    """The part of it in which components of lower priority hold locks."""

    @property
    def meets_deadline(self) -> bool:
        """Whether each job comes to its wait in time, as far as the assumptions hold."""
        return self.response_ns is not None and self.response_ns <= self.deadline_ns


def bounds_of(subjects: Sequence[Subject], *, wakeup_ns: int = 0) -> dict[str, Bound]:
    """The bound of each component.

    `wakeup_ns`: how long after its instant a thread begins at the latest, on this machine.
    """
    times: dict[str, DigraphTimes] = {}
    for here in by_cpu(subjects):
        components = [Component(subject.task, subject.machine.priority, subject.sections) for subject in here]
        times |= digraph_times(components, jitter_ns=wakeup_ns)
    return {subject.name: _bound(subject, subjects, times) for subject in subjects}


def by_cpu(subjects: Sequence[Subject]) -> list[list[Subject]]:
    """Those without obstacles, each of which runs on one CPU."""
    known = [subject for subject in subjects if not subject.obstacles]
    cpus = sorted({subject.machine.cpus for subject in known})
    return [[subject for subject in known if subject.machine.cpus == each] for each in cpus]


def _bound(subject: Subject, subjects: Sequence[Subject], times: Mapping[str, DigraphTimes]) -> Bound:
    deadline_ns = min((job.deadline_ns for job in subject.task.jobs), default=0)
    if subject.obstacles:
        return Bound(None, deadline_ns, "it is not provable")
    unknown = [
        other.name for other in subjects if other.obstacles and _may_delay(other, subject, among=subjects)
    ]
    if unknown:
        return Bound(None, deadline_ns, f"{', '.join(unknown)} may delay it, and nothing is proved of that")
    found = times[subject.name]
    if subject.machine.clients and found.blocking_ns:
        names = ", ".join(subject.machine.clients)
        return Bound(None, deadline_ns, f"after each wait for a service ({names}) a lock may block it anew")
    if found.reason:
        return Bound(None, deadline_ns, found.reason, found.blocking_ns)
    closest = min(found.jobs, key=lambda one: one.job.deadline_ns - one.response_ns, default=None)
    if closest is None:
        return Bound(0, 0)
    return Bound(closest.response_ns, closest.job.deadline_ns, blocking_ns=found.blocking_ns)


def _may_delay(other: Subject, subject: Subject, *, among: Sequence[Subject]) -> bool:
    """Whether it may run on the subject's CPU, with a priority of its own or an inherited one."""
    cpus = {*other.machine.cpus}
    meet = not cpus or bool(cpus & {*subject.machine.cpus})
    sharing = (each.machine for each in among if each.machine.resources & other.machine.resources)
    highest = max(other.machine.priority, *(machine.priority for machine in sharing), 0)
    return meet and highest >= subject.machine.priority
