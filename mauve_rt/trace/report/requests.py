"""Who asked for a reconfiguration, and why: the executors' events, joined with what the trace measured."""

from bisect import bisect_left
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from mauve_rt.trace.reading.reconfigurations import Reconfiguration

_REPLY_WITHIN_NS = 5_000_000_000  # the executor publishes its event after the reply


@dataclass(frozen=True, kw_only=True)
class RequestTold:
    """What an executor told about a request that touched a component."""

    requested_by: str
    cause: str
    steps: str
    """Those about this component."""
    from_core: str
    """Of this component; empty when it kept its core."""
    to_core: str
    prepare_ns: int | None


def join_requests(measured: Sequence[Reconfiguration], events: Iterable[Any]) -> list[RequestTold | None]:
    """Return the request behind each reconfiguration; None where the bag does not tell.

    `events` are messages of type ReconfigurationEvent as `Trace.messages` gives them.
    """
    told = sorted((event for event in events if event.msg.success), key=_time_ns)
    return [_request_behind(one, told) for one in measured]


def _request_behind(one: Reconfiguration, told: Sequence[Any]) -> RequestTold | None:
    """Return the one that tells of it, by its blackout; where that is not measured, the first soon after.

    Components of merged traces are named <bag>/<component>. Where the executor's topics do not have the name
    of the bag, an event is taken only when no other one could be meant.
    """
    begin, end = (
        bisect_left(told, limit_ns, key=_time_ns)
        for limit_ns in (one.armed_ns, one.armed_ns + _REPLY_WITHIN_NS + 1)
    )
    owner, _, component = one.component.rpartition("/")
    found = [event for event in told[begin:end] if _tells_of(event, component)]
    if owner:
        own = [event for event in found if f"/{owner}/" in event.topic]
        found = own or (found if len(found) == 1 else [])
    found.sort(key=lambda event: not _has_measured(event.msg, component, one.blackout_ns))
    return _request(found[0].msg, component) if found else None


def _time_ns(event: Any) -> int:
    return int(event.monotonic_ns)


def _tells_of(event: Any, component: str) -> bool:
    return any(step.component == component for step in event.msg.report)


def _has_measured(event: Any, component: str, blackout_ns: int) -> bool:
    return any(step.component == component and step.blackout_ns == blackout_ns for step in event.report)


def _request(event: Any, component: str) -> RequestTold:
    steps = [step for step in event.report if step.component == component]
    prepare_ns = sum(step.prepare_ns for step in steps)
    # A bag may be of a time when reports did not name the cores.
    replacing = next((step for step in reversed(steps) if getattr(step, "to_core", "")), None)
    return RequestTold(
        requested_by=event.requested_by,
        cause=event.cause,
        steps=", ".join(step.step for step in steps),
        from_core="" if replacing is None else replacing.from_core,
        to_core="" if replacing is None else replacing.to_core,
        prepare_ns=prepare_ns if prepare_ns > 0 else None,
    )
