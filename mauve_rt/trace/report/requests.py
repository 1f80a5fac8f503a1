"""Who asked for a reconfiguration, and why: the executors' events, joined with what the trace measured."""

from bisect import bisect_left
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from mauve_rt.trace.reconfigurations import Reconfiguration

_REPLY_WITHIN_NS = 5_000_000_000  # the executor publishes its event after the reply


@dataclass(frozen=True, kw_only=True)
class Request:
    """What an executor told about a request that touched a component."""

    requested_by: str
    cause: str
    request: str
    from_core: str
    to_core: str
    prepare_ns: int | None


def join_requests(measured: Sequence[Reconfiguration], events: Iterable[Any]) -> list[Request | None]:
    """Return the request behind each reconfiguration; None where the bag does not tell.

    `events` are messages of type ReconfigurationEvent as `Trace.messages` gives them.
    """
    told = sorted((event for event in events if event.msg.success), key=_time_ns)
    return [_request_behind(one, told) for one in measured]


def _request_behind(one: Reconfiguration, told: Sequence[Any]) -> Request | None:
    for index in range(bisect_left(told, one.armed_ns, key=_time_ns), len(told)):
        event = told[index]
        if event.monotonic_ns - one.armed_ns > _REPLY_WITHIN_NS:
            break
        if _tells_of(event, one):
            return _request(event.msg, one)
    return None


def _time_ns(event: Any) -> int:
    return int(event.monotonic_ns)


def _tells_of(event: Any, one: Reconfiguration) -> bool:
    executor, _, component = one.component.rpartition("/")
    if executor and f"/{executor}/" not in event.topic:
        return False
    return any(step.component == component for step in event.msg.report)


def _request(event: Any, one: Reconfiguration) -> Request:
    component = one.component.rpartition("/")[2]
    step = next(step for step in event.report if step.component == component)
    return Request(
        requested_by=event.requested_by,
        cause=event.cause,
        request=event.request,
        from_core=event.from_core,
        to_core=event.to_core,
        prepare_ns=step.prepare_ns if step.prepare_ns > 0 else None,
    )
