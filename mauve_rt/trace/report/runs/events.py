"""Decisions and reconfigurations of two runs: how often, how fast, in what order, and only in which run."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from mauve_rt.trace.reading.decisions import DECISION_TYPE, executors
from mauve_rt.trace.reading.reconfigurations import Reconfiguration
from mauve_rt.trace.reading.trace import Trace
from mauve_rt.trace.report.requests import join_requests

EVENT_TYPE = "mauve_msgs/msg/ReconfigurationEvent"
_ACTS = ("do", "undo")


@dataclass(frozen=True)
class Act:
    """A rule acted: do or undo."""

    time_ns: int
    rule: str
    """Of a supervisor: `rule (node)`."""
    decision: str
    delay_ns: int | None
    """From the cause to the act; None where the bag does not tell."""


@dataclass(frozen=True, order=True)
class CoreChange:
    """What a reconfiguration changed."""

    component: str
    from_core: str
    """Empty where the bag does not name cores."""
    to_core: str
    """The new core; where the bag does not name cores, what was committed."""


@dataclass(frozen=True)
class Cost:
    """What the reconfigurations of one kind cost in one run."""

    blackouts_ns: tuple[int, ...] = ()
    missed_releases: int = 0

    @property
    def count(self) -> int:
        """How many there were."""
        return len(self.blackouts_ns)


def acts_of(trace: Trace) -> list[Act]:
    """Return when rules of the executor and of supervisors acted, by time.

    Raises:
        TraceError: the bag's messages cannot be read.

    """
    found = [
        Act(one.time_ns, one.rule, one.decision, max(one.time_ns - one.cause_ns, 0) if one.cause_ns else None)
        for one in trace.decisions
        if one.decision in _ACTS
    ]
    own = {f"{node}/decisions" for node in executors(trace)} if trace.decisions else set()
    others = [
        topic for topic, (kind, _) in trace.topics.items() if kind == DECISION_TYPE and topic not in own
    ]
    if others:
        found += _of_supervisors(trace.messages(*others))
    return sorted(found, key=lambda act: act.time_ns)


def _of_supervisors(messages: Iterable[Any]) -> list[Act]:
    """Acts by messages alone; what a `done` tells of the delay belongs to the act before it."""
    found: list[Act] = []
    last: dict[tuple[str, str], int] = {}
    for message in messages:
        decision, node = str(message.msg.decision), message.topic.removesuffix("/decisions")
        rule = f"{message.msg.rule} ({node})"
        if decision in _ACTS:
            last[rule, decision] = len(found)
            found.append(Act(int(message.monotonic_ns), rule, decision, None))
        elif decision == "done" and message.msg.took_s >= 0 and (rule, message.msg.act) in last:
            at = last.pop((rule, message.msg.act))
            took_ns = round(message.msg.took_s * 1e9)
            found[at] = Act(found[at].time_ns, rule, found[at].decision, took_ns)
    return found


def costs_of(trace: Trace, measured: Sequence[Reconfiguration]) -> dict[CoreChange, Cost]:
    """Return what the committed reconfigurations cost, per component and change of core.

    Raises:
        TraceError: the bag's messages cannot be read.

    """
    told = any(kind == EVENT_TYPE for kind, _ in trace.topics.values())
    requests = join_requests(measured, trace.messages(EVENT_TYPE) if told else ())
    found: dict[CoreChange, Cost] = {}
    for one, request in zip(measured, requests, strict=True):
        if not one.committed:
            continue
        from_core, to_core = (request.from_core, request.to_core) if request else ("", "")
        change = CoreChange(one.component, from_core, to_core or one.what)
        before = found.get(change, Cost())
        missed = before.missed_releases + (one.missed_releases or 0)
        found[change] = Cost((*before.blackouts_ns, one.blackout_ns), missed)
    return found


def order_in_words(a: Sequence[Act], b: Sequence[Act]) -> str:
    """Return how the order of the acts of B differs from the order of A, in one sentence."""
    if not a and not b:
        return "No rule acted in either run."
    orders = [[f"{act.rule}: {act.decision}" for act in run] for run in (a, b)]
    if orders[0] == orders[1]:
        return "The rules acted in the same order in both runs."
    shared = min(map(len, orders))
    at = next((index for index in range(shared) if orders[0][index] != orders[1][index]), shared)
    told = [f"“{order[at]}”" if at < len(order) else "no act" for order in orders]
    return f"The order of the acts differs from act {at + 1} on: {told[0]} in A, {told[1]} in B."
