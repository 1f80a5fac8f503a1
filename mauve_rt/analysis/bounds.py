"""Bounds of the response times of an architecture's components, as far as all that delays them is known.

Each component stands as a sporadic task: the costliest of its jobs, at their shortest distance. That is never
less than what its digraph asks for.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from mauve_rt.analysis.digraph import DigraphTask
from mauve_rt.analysis.fixed_priority import response_times
from mauve_rt.analysis.machines import FOREVER_NS, Machine
from mauve_rt.analysis.task import Task


@dataclass(frozen=True)
class Bound:
    """Of one component."""

    response_ns: int | None
    """From a release to the next wait at the latest; None: nothing is known."""
    deadline_ns: int
    """The shortest of its jobs."""
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
    tasks = {
        machine.name: _sporadic(machine, task, wakeup_ns)
        for machine, task, not_provable in found
        if not not_provable and task.jobs
    }
    bounds = response_times([task for task in tasks.values() if task is not None])
    responses = {bound.task.name: (bound.response_ns, bound.reason) for bound in bounds}
    return {
        machine.name: _bound(machine, task, [one for one, _, _ in found], tasks, responses)
        for machine, task, _ in found
    }


def _bound(
    machine: Machine,
    task: DigraphTask,
    machines: Sequence[Machine],
    tasks: Mapping[str, Task | None],
    responses: Mapping[str, tuple[int | None, str]],
) -> Bound:
    deadline_ns = min((job.deadline_ns for job in task.jobs), default=0)
    if machine.name not in responses:
        costs_nothing = machine.name in tasks
        return Bound(0 if costs_nothing else None, deadline_ns, "" if costs_nothing else "see why not")
    unknown = [
        other.name
        for other in machines
        if other.name not in tasks and other.priority >= machine.priority and _may_run_on(other, machine.cpus)
    ]
    if unknown:
        return Bound(None, deadline_ns, f"{', '.join(unknown)} may delay it, and nothing is proved of that")
    response_ns, reason = responses[machine.name]
    return Bound(response_ns, deadline_ns, reason)


def _may_run_on(machine: Machine, cpus: tuple[int, ...]) -> bool:
    return not machine.cpus or bool({*machine.cpus} & {*cpus})


def _sporadic(machine: Machine, task: DigraphTask, wakeup_ns: int) -> Task | None:
    """None: it executes nothing."""
    cost_ns = task.largest_cost_ns or 0
    if not cost_ns:
        return None
    separation_ns = min(task.shortest_separation_ns, FOREVER_NS)
    return Task(
        name=machine.name,
        cpu=machine.cpus[0],
        priority=machine.priority,
        separation_ns=separation_ns,
        cost_ns=cost_ns,
        deadline_ns=min(job.deadline_ns for job in task.jobs),
        jitter_ns=wakeup_ns,
    )
