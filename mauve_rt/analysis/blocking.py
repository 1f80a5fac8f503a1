"""How long tasks of lower priority can hold up a task, where mutexes inherit priorities.

Source: Sha, Rajkumar, Lehoczky, "Priority Inheritance Protocols", IEEE Transactions on Computers 39(9),
1990. Under the basic priority inheritance protocol, a job is blocked by at most one critical section of
each task of lower priority, and by at most one critical section of each semaphore that can block. Both hold
at once, because each blocking section was entered before the busy window began: a task is in one outermost
section, and a resource has one holder. So the bound is the heaviest matching between tasks of lower
priority and resources, which is never above the smaller one of the two sums of the paper.
"""

from collections.abc import Iterable, Sequence
from graphlib import CycleError, TopologicalSorter
from typing import Protocol

import networkx as nx

from mauve_rt.analysis.critical_section import CriticalSection
from mauve_rt.analysis.errors import AnalysisError


class LockUser(Protocol):
    """A task that locks resources: a component of `digraph_times`."""

    @property
    def name(self) -> str:
        """Unique on its CPU."""

    @property
    def priority(self) -> int:
        """As for SCHED_FIFO."""

    @property
    def sections(self) -> tuple[CriticalSection, ...]:
        """The critical sections of a job."""


def shares_a_resource(task: LockUser, tasks: Iterable[LockUser]) -> bool:
    """Whether another task locks a resource that the task locks: its thread can then leave the queue."""
    own = {section.resource for section in task.sections}
    others = (section.resource for other in tasks if other is not task for section in other.sections)
    return any(resource in own for resource in others)


def ceilings(tasks: Iterable[LockUser]) -> dict[str, int]:
    """The highest priority that a holder of each resource can inherit.

    That is the highest priority of the tasks that lock the resource. A resource that is locked inside
    another one also has the ceiling of the outer one: the holder of the outer one passes its inherited
    priority on.

    Args:
        tasks: all tasks of one CPU.

    Raises:
        AnalysisError: two resources are locked inside each other, which can deadlock.

    """
    found: dict[str, int] = {}
    outer: dict[str, set[str]] = {}
    for task in tasks:
        for section in task.sections:
            found[section.resource] = max(found.get(section.resource, 0), task.priority)
            outer.setdefault(section.resource, set())
            if section.inside:
                outer[section.resource].add(section.inside)
    try:
        for resource in TopologicalSorter(outer).static_order():  # outer resources first
            found[resource] = max(found[name] for name in (resource, *outer[resource]))
    except CycleError as error:
        raise AnalysisError(
            f"resource {error.args[1][0]}",
            "order of locks",
            expected="no cycle",
            found=" inside ".join(error.args[1]),
            remedy="Lock these resources in the same order everywhere",
        ) from error
    return found


def blocking_ns(task: LockUser, tasks: Sequence[LockUser]) -> int:
    """The longest time (ns) for which tasks of lower priority run in one busy window of a task.

    A section blocks if its task has a lower priority and its resource a ceiling of at least the task's
    priority. The section counts whole, though a part of at least one nanosecond lies before the busy
    window.

    Args:
        task: the task under analysis.
        tasks: all tasks of its CPU.

    Raises:
        AnalysisError: as for `ceilings`.

    """
    ceiling = ceilings(tasks)
    longest: dict[tuple[str, str], int] = {}
    for lower in tasks:
        for section in lower.sections:
            if lower.priority < task.priority <= ceiling[section.resource]:
                edge = (lower.name, section.resource)
                longest[edge] = max(longest.get(edge, 0), section.length_ns)
    holders, resources = {edge[0] for edge in longest}, {edge[1] for edge in longest}
    if len(holders) <= 1 or len(resources) <= 1:
        return max(longest.values(), default=0)
    graph: nx.Graph[tuple[str, str]] = nx.Graph()
    for (holder, resource), length_ns in longest.items():
        graph.add_edge(("task", holder), ("resource", resource), weight=length_ns)
    return sum(graph.edges[edge]["weight"] for edge in nx.max_weight_matching(graph))
