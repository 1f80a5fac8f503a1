"""Reconfigurations as Perfetto shows them: from the request to the parked slice to what came next."""

from collections.abc import Iterable
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from mauve_rt.trace.format.records import IN_VAIN, Kind, ReconfigurationPhase
from mauve_rt.trace.reading.facts import Message
from mauve_rt.trace.reading.pairs import gaps
from mauve_rt.trace.reading.trace import Trace

_EVENT_TYPE = "mauve_msgs/msg/ReconfigurationEvent"
_ANSWERED_WITHIN_NS = 5_000_000_000  # where the report does not tell the blackout: simulated time


@dataclass(eq=False)
class Swap:
    """A component was parked and armed again."""

    component: str
    parked: int
    """Index of the record."""
    armed: int
    resumed: int | None
    """Its next release, or the state it began first; None when that is not in the trace."""
    parked_ns: int
    armed_ns: int
    what: str
    figures: dict[str, int | bool]
    request: "RequestSlice | None" = None
    flow: int = 0
    """The number of its flow; 0 when it has none, having nothing to flow from or to."""


@dataclass(eq=False)
class RequestSlice:
    """What somebody asked of the executor, from its preparation to its answer."""

    message: Message
    begin_ns: int
    swaps: list[Swap] = field(default_factory=list)

    @property
    def end_ns(self) -> int:
        """When the executor told of it."""
        return self.message.monotonic_ns


def find_swaps(trace: Trace, component: str) -> list[Swap]:
    """Parks of a component with their ends; those that lost records cut, or that were in vain, are none."""
    rows = trace.of(component)
    kinds, part = rows["kind"], np.cumsum(gaps(rows))
    (marks,) = np.nonzero(np.isin(kinds, (Kind.PARKED, Kind.ARMED)))
    (nexts,) = np.nonzero(
        np.isin(kinds, (Kind.RELEASE, Kind.STATE_BEGIN, Kind.STOP, Kind.PARKED, Kind.FAULT))
    )
    found = []
    for parked, armed in pairwise(marks.tolist()):
        if kinds[parked] != Kind.PARKED or kinds[armed] != Kind.ARMED or part[parked] != part[armed]:
            continue
        if rows["b"][armed] == IN_VAIN:
            continue
        after = int(np.searchsorted(nexts, armed))
        resumed = int(nexts[after]) if after < len(nexts) else -1
        goes_on = (
            resumed >= 0
            and kinds[resumed] in (Kind.RELEASE, Kind.STATE_BEGIN)
            and part[resumed] == part[armed]
        )
        phases = rows[parked:armed]
        phases = phases[phases["kind"] == Kind.RECONFIGURATION]
        steps = dict.fromkeys(trace.name(int(name)) for name in phases["name"])
        found.append(
            Swap(
                component=component,
                parked=parked,
                armed=armed,
                resumed=resumed if goes_on else None,
                parked_ns=int(rows["time_ns"][parked]),
                armed_ns=int(rows["time_ns"][armed]),
                what=", ".join(steps),
                figures={
                    "committed": bool(rows["b"][armed]),
                    "adopt_ns": int(phases["b"][phases["a"] == ReconfigurationPhase.ADOPT].sum()),
                    "take_ns": int(phases["b"][phases["a"] == ReconfigurationPhase.TAKE].sum()),
                    "pending_ns": int(rows["a"][parked]),
                },
            )
        )
    return found


def find_requests(trace: Trace, swaps: Iterable[Swap]) -> list[RequestSlice]:
    """What the executor told of requests, each with the swaps that its report names, which are told of it."""
    unasked = sorted(swaps, key=lambda swap: swap.armed_ns)
    requests = []
    for message in trace.messages(_EVENT_TYPE):
        request = RequestSlice(message, message.monotonic_ns)
        for step in message.msg.report:
            match = _swap_of(step, message.monotonic_ns, unasked)
            if match is not None and match.request is None:
                match.request = request
                request.swaps.append(match)
                request.begin_ns = min(request.begin_ns, match.parked_ns - max(0, int(step.prepare_ns)))
        unasked = [swap for swap in unasked if swap.request is None]
        requests.append(request)
    return requests


def _swap_of(step: object, told_ns: int, swaps: list[Swap]) -> Swap | None:
    """The newest swap that the step of a report tells of, by its component and its blackout."""
    component, blackout_ns = getattr(step, "component", ""), int(getattr(step, "blackout_ns", -1))
    for swap in reversed(swaps):
        if swap.component != component or swap.armed_ns > told_ns:
            continue
        if blackout_ns < 0:
            return swap if told_ns - swap.armed_ns <= _ANSWERED_WITHIN_NS else None
        if swap.armed_ns - swap.parked_ns == blackout_ns:
            return swap
    return None


def number_flows(swaps: Iterable[Swap], first: int) -> int:
    """Give every swap that flows from a request or into something its number; returns the next free one."""
    for swap in swaps:
        if swap.request is not None or swap.resumed is not None:
            swap.flow, first = first, first + 1
    return first
