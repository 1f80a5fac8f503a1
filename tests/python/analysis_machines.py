"""Machines for tests of the analysis, in few words."""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

from mauve_rt.analysis.machines import Machine

MS = 1_000_000


def execution(
    name: str,
    *successors: str,
    bound_ms: float = 0.0,
    wcet_ms: float = 0.0,
    initial: bool = False,
    enforced: bool = False,
) -> SimpleNamespace:
    """As mauve_msgs/msg/StateInfo has it."""
    times = {"max_execution_ns": round(bound_ms * MS), "wcet_ns": round(wcet_ms * MS)}
    return _state(name, successors, is_initial=initial, wcet_enforced=enforced, **times)


def wait(
    name: str, *successors: str, ms: int, wcet_ms: float = 0.0, initial: bool = False
) -> SimpleNamespace:
    """For a time; `wcet_ms`: of its guards, one for each successor but the last."""
    times = {"duration_ns": ms * MS, "wcet_ns": round(wcet_ms * MS)}
    return _state(name, successors, is_wait=True, is_initial=initial, **times)


def event(name: str, *successors: str, least_ms: int, initial: bool = False) -> SimpleNamespace:
    """For an event."""
    told = {"is_wait": True, "is_event_wait": True, "duration_ns": 2**63 - 1, "is_initial": initial}
    return _state(name, successors, min_interarrival_ns=least_ms * MS, **told)


def _state(name: str, successors: tuple[str, ...], **told: Any) -> SimpleNamespace:
    usual = dict.fromkeys(("is_initial", "is_wait", "is_event_wait", "wcet_enforced"), False)
    numbers = ("duration_ns", "min_interarrival_ns", "max_execution_ns", "simulated_execution_ns", "wcet_ns")
    return SimpleNamespace(
        **{**usual, **dict.fromkeys(numbers, 0), "name": name, "successors": successors, **told}
    )


def connected(**longest_hold_ms: float) -> list[SimpleNamespace]:
    """Ports that are connected to resources, each with the longest time for which a user holds its lock."""
    return [
        SimpleNamespace(resource=resource, longest_hold_ns=round(hold_ms * MS))
        for resource, hold_ms in longest_hold_ms.items()
    ]


def machine(
    *states: SimpleNamespace,
    is_python: bool | None = False,
    kinds: Mapping[str, str] | None = None,
    **told: Any,
) -> Machine:
    """One that runs on CPU 0 with priority 50."""
    usual = {"name": "c", "cpus": [0], "priority": 50, "policy": "SCHED_FIFO", "period_ns": 0, "offset_ns": 0}
    component = SimpleNamespace(**{**usual, "deadline_ns": 0, "overrun": "skip", "states": states, **told})
    return Machine.of(component, is_python=is_python, kinds=kinds)
