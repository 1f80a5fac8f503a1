"""The jobs of a component as a digraph task.

A vertex is a job: what a component executes from the end of one wait to the next one. An edge is the wait in
between: the least time from the release of the one to the release of the other. Which way a component takes,
its guards decide as it runs; the digraph has all of them.

Source: Stigge, Ekberg, Guan, Yi: The Digraph Real-Time Task Model, RTAS 2011.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from math import gcd

import networkx as nx

from mauve_rt.analysis.machines import FOREVER_NS, Machine, State

START = ""
"""What releases the first job of a machine whose initial state is an execution."""


@dataclass(frozen=True)
class Job:
    """What is executed between two waits, by the costliest way from the one to the other."""

    after: str
    """The wait whose end releases it; START."""
    states: tuple[str, ...]
    cost_ns: int | None
    """None: a state on some way has no known time."""
    until: str
    """The wait that it comes to."""
    separation_ns: int
    """The least time from its release to the next one; FOREVER_NS: none follows."""
    deadline_ns: int
    """From its release, to have come to its wait."""
    release_cost_ns: int | None = 0
    """The part of `cost_ns` before the first state: the wake-up, and the guards of the wait."""


@dataclass(frozen=True)
class DigraphTask:
    """A component's jobs; a job is followed by any that its wait releases."""

    name: str
    jobs: tuple[Job, ...]

    def after(self, job: Job) -> tuple[Job, ...]:
        """Which may be released next, `separation_ns` after this one at the earliest."""
        return tuple(next_ for next_ in self.jobs if next_.after == job.until)

    @property
    def shortest_separation_ns(self) -> int:
        """From any release to the next."""
        return min((job.separation_ns for job in self.jobs), default=FOREVER_NS)

    @property
    def largest_cost_ns(self) -> int | None:
        """Of a job; None: one is not known."""
        costs = [job.cost_ns for job in self.jobs if job.cost_ns is not None]
        return None if len(costs) < len(self.jobs) else max(costs, default=0)


def period_of(task: DigraphTask) -> int:
    """The greatest common divisor of its cycles' lengths, which the kernel calls g; 0: it has no cycle.

    Of a component without waits for events: there no instants lie on a grid.
    """
    graph: nx.DiGraph[str] = nx.DiGraph()
    for job in task.jobs:
        if job.separation_ns != FOREVER_NS:
            graph.add_edge(job.after, job.until, length=job.separation_ns)
    period = 0
    for waits in nx.strongly_connected_components(graph):
        inside = graph.subgraph(waits)
        at_ns = nx.single_source_dijkstra_path_length(inside, min(waits), weight="length")
        for before, after in inside.edges:
            period = gcd(period, at_ns[before] + inside.edges[before, after]["length"] - at_ns[after])
    return period


def digraph_of(machine: Machine, *, overhead_ns: int = 0) -> DigraphTask:
    """The jobs of a machine that its initial state leads to; each release costs `overhead_ns`."""
    states = {state.name: state for state in machine.states}
    initial = next((state for state in machine.states if state.is_initial), None)
    if initial is None:
        return DigraphTask(machine.name, ())
    ways = _Ways(states, overhead_ns)
    jobs: list[Job] = []
    waits = [initial.name] if initial.is_wait else [*ways.to_waits(initial.name)]
    if not initial.is_wait:
        jobs += ways.jobs(START, initial.name, machine.deadline_ns)
    for wait in waits:  # grows while it is looked through
        for successor in states[wait].successors:
            jobs += ways.jobs(wait, successor, machine.deadline_ns)
            waits += [other for other in ways.to_waits(successor) if other not in waits]
    return DigraphTask(machine.name, tuple(_costliest(jobs)))


class _Ways:
    """The ways through execution states: they have no loop without a wait, which the kernel refuses."""

    def __init__(self, states: dict[str, State], overhead_ns: int) -> None:
        self._states = states
        self._overhead_ns = overhead_ns
        self.to_waits = cache(self._to_waits)

    def jobs(self, after: str, first: str, deadline_ns: int) -> Iterator[Job]:
        """One for each wait that the state leads to."""
        guards_ns = self._states[after].time.ns if after else 0
        release_ns = None if guards_ns is None else guards_ns + self._overhead_ns
        for until, (cost_ns, way) in self.to_waits(first).items():
            separation_ns = self._states[until].separation_ns
            whole_ns = None if cost_ns is None or release_ns is None else cost_ns + release_ns
            deadline = deadline_ns or separation_ns
            yield Job(after, way, whole_ns, until, separation_ns, deadline, release_ns)

    def _to_waits(self, name: str) -> dict[str, tuple[int | None, tuple[str, ...]]]:
        """The costliest way from a state to each wait: its cost, and the states on it."""
        state = self._states[name]
        if state.is_wait:
            return {name: (0, ())}
        found: dict[str, tuple[int | None, tuple[str, ...]]] = {}
        for successor in state.successors:
            for wait, (rest_ns, way) in self.to_waits(successor).items():
                is_known = rest_ns is not None and state.time.ns is not None
                cost_ns = rest_ns + state.time.ns if is_known else None  # type: ignore[operator]
                if wait not in found or _is_costlier(cost_ns, found[wait][0]):
                    found[wait] = (cost_ns, (name, *way))
        return found


def _costliest(jobs: list[Job]) -> list[Job]:
    """Of jobs between the same two waits one."""
    best: dict[tuple[str, str], Job] = {}
    for job in jobs:
        known = best.get((job.after, job.until))
        if known is None or _is_costlier(job.cost_ns, known.cost_ns):
            best[job.after, job.until] = job
    return [*best.values()]


def _is_costlier(cost_ns: int | None, than_ns: int | None) -> bool:
    """One that is not known may be any."""
    return than_ns is not None and (cost_ns is None or cost_ns > than_ns)
