"""Threads of an executor that are no components, as the analysis takes them: each is a `Machine`, too.

A real-time thread waits for an event and executes. An ordinary thread never takes the CPU from a component,
but the lock of a resource.
"""

from collections.abc import Iterable, Iterator, Sequence
from typing import Any

from mauve_rt.analysis.machines import FOREVER_NS, ExecutionTime, Hold, Machine, State

WATCHDOG = "watchdog"
"""Name of the thread that ends executions which are too long."""
_REMEDIES = {
    "topics_out": "declare wcet_ns and min_interarrival_ns of executor.sender, or lower its priority",
    "stops_out": "declare wcet_ns and min_interarrival_ns of executor.sender, or lower its priority",
    "trace": "give components a priority of 2 or more",
}
_OTHER = "nothing says how often it runs, and for how long"


def machines_of(threads: Iterable[Any], components: Sequence[Machine]) -> Iterator[Machine]:
    """The threads that can delay a component.

    Args:
        threads: with the fields of mauve_msgs/msg/TaskInfo.
        components: whose holds say for how long a lock is held.

    """
    holds = {hold.resource: hold for one in components for hold in one.holds}
    undeclared = {resource for one in components for resource in one.undeclared_locks}
    for told in threads:
        if told.priority:
            yield _real_time(told)
        elif told.resource in holds:
            yield _ordinary(told, holds=(holds[told.resource],))
        elif told.resource in undeclared:
            yield _ordinary(told, undeclared_locks=(told.resource,))


def _real_time(told: Any) -> Machine:
    separation_ns = int(told.min_interarrival_ns) or FOREVER_NS
    is_known = told.wcet_ns and told.min_interarrival_ns
    free = ExecutionTime(0, "without a guard")
    wait = State("Wait", True, True, separation_ns, FOREVER_NS, True, ("Work",), free)
    cost = ExecutionTime(int(told.wcet_ns), "declared") if is_known else ExecutionTime()
    work = State("Work", False, False, 0, 0, False, ("Wait",), cost)
    return _machine(told, states=(wait, work), remedy=_REMEDIES.get(told.name, _OTHER))


def _ordinary(told: Any, *, holds: tuple[Hold, ...] = (), undeclared_locks: tuple[str, ...] = ()) -> Machine:
    return _machine(told, holds=holds, undeclared_locks=undeclared_locks)


def _machine(told: Any, **more: Any) -> Machine:
    facts = {"states": (), "period_ns": 0, "offset_ns": 0, "deadline_ns": FOREVER_NS, "overrun": "catch_up"}
    return Machine(
        name=told.name,
        cpus=tuple(int(cpu) for cpu in told.cpus),
        priority=int(told.priority),
        policy="SCHED_FIFO" if told.priority else "SCHED_OTHER",
        is_component=False,
        **{**facts, **more},
    )
