"""Bounds of the response times of an architecture's components, as far as all that delays them is known."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from mauve_rt.analysis.digraph import DigraphTask
from mauve_rt.analysis.digraph_times import Component, DigraphTimes, digraph_times
from mauve_rt.analysis.machines import Machine


@dataclass(frozen=True)
class Bound:
    """Of the job of a component that comes closest to its deadline."""

    response_ns: int | None
    """From its instant to the next wait at the latest; None: nothing is known."""
    deadline_ns: int
    reason: str = ""
    """Why there is no bound."""

    @property
    def meets_deadline(self) -> bool:
        """Whether each job comes to its wait in time, as far as the assumptions hold."""
        return self.response_ns is not None and self.response_ns <= self.deadline_ns


def bounds_of(
    found: Sequence[tuple[Machine, DigraphTask, Sequence[str]]], *, wakeup_ns: int = 0
) -> dict[str, Bound]:
    """The bound of each component; `found`: with what keeps it from being proved (`obstacles`).

    `wakeup_ns`: how long after its instant a thread begins at the latest, on this machine.
    """
    proved = [
        (machine, Component(task, machine.priority))
        for machine, task, not_provable in found
        if not not_provable
    ]
    times: dict[str, DigraphTimes] = {}
    for cpus in {machine.cpus for machine, _ in proved}:
        here = [component for machine, component in proved if machine.cpus == cpus]
        times |= digraph_times(here, jitter_ns=wakeup_ns)
    machines = [machine for machine, _, _ in found]
    return {machine.name: _bound(machine, task, machines, times) for machine, task, _ in found}


def _bound(
    machine: Machine, task: DigraphTask, machines: Sequence[Machine], times: Mapping[str, DigraphTimes]
) -> Bound:
    deadline_ns = min((job.deadline_ns for job in task.jobs), default=0)
    if machine.name not in times:
        return Bound(None, deadline_ns, "it is not provable")
    unknown = [
        other.name
        for other in machines
        if other.name not in times and other.priority >= machine.priority and _may_run_on(other, machine.cpus)
    ]
    if unknown:
        return Bound(None, deadline_ns, f"{', '.join(unknown)} may delay it, and nothing is proved of that")
    found = times[machine.name]
    if found.reason:
        return Bound(None, deadline_ns, found.reason)
    closest = min(found.jobs, key=lambda one: one.job.deadline_ns - one.response_ns)
    return Bound(closest.response_ns, closest.job.deadline_ns)


def _may_run_on(machine: Machine, cpus: tuple[int, ...]) -> bool:
    return not machine.cpus or bool({*machine.cpus} & {*cpus})
