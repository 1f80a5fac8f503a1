"""Moments at which several components woke late together while none of them was executing.

Then it was not one of them that kept the others waiting, but the machine, its host, or another program.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from mauve_rt.trace.format.records import Kind
from mauve_rt.trace.report.analysis import Analysis
from mauve_rt.trace.report.cycles import Times, next_of

_LATE_NS = 1_000_000
"""Wake-up latencies below are not looked at."""
_TOGETHER = 3
_IDLE = 0.1
"""Up to this share of a moment the components may have executed."""
_MOST = 20_000
"""Late wake-ups that are looked at, the worst ones."""


class Stall(NamedTuple):
    """One moment."""

    begin_ns: int
    end_ns: int
    """While all of them waited."""
    components: int
    latency_ns: int
    """The worst of their wake-up latencies."""


def stalls(analysis: Analysis) -> list[Stall]:
    """Return the moments by time; each late wake-up is part of one at most."""
    late = [releases[releases["wakeup_ns"] >= _LATE_NS] for releases in analysis.releases.values()]
    begin_ns = np.concatenate([np.empty(0, np.int64), *(one["begin_ns"] for one in late)])
    latency_ns = np.concatenate([np.empty(0, np.int64), *(one["wakeup_ns"] for one in late)])
    worst = np.argsort(-latency_ns)[:_MOST]
    order = worst[np.argsort(begin_ns[worst], kind="stable")]
    begin_ns, latency_ns = begin_ns[order], latency_ns[order]
    end_ns = begin_ns + latency_ns
    (apart,) = np.nonzero(begin_ns[1:] > np.maximum.accumulate(end_ns)[:-1])
    groups = np.split(np.arange(len(order)), apart + 1)
    found = [_deepest(begin_ns[group], end_ns[group]) for group in groups if len(group) >= _TOGETHER]
    together = [one for one in found if one.components >= _TOGETHER]
    executed = list(_executed(analysis)) if together else []
    return [one for one in together if _busy_share(executed, one) <= _IDLE]


def _executed(analysis: Analysis) -> Iterator[tuple[Times, Times]]:
    """Begins and ends of executions; those without an end last until the next record, or the trace's end."""
    for component, states in analysis.slices.items():
        for slices in states.values():
            yield slices["begin_ns"], slices["begin_ns"] + slices["extent_ns"]
        records = analysis.trace.of(component)
        (begun,) = np.nonzero(records["kind"] == Kind.STATE_BEGIN)
        ends = next_of(records, begun, (Kind.STATE_END,), unless=(Kind.STATE_BEGIN,))
        opened = begun[ends < 0]
        until_ns = np.append(records["time_ns"], analysis.end_ns)[opened + 1]
        yield records["time_ns"][opened], until_ns


def _deepest(begin_ns: Times, end_ns: Times) -> Stall:
    """Where most of these intervals overlap. Those of one component never do."""
    times = np.concatenate([end_ns, begin_ns])  # at equal times ends come first
    steps = np.repeat([-1, 1], len(begin_ns))
    order = np.argsort(times, kind="stable")
    depth = np.cumsum(steps[order])
    at = int(np.argmax(depth))
    begin, end = int(times[order[at]]), int(times[order[at + 1]])
    inside = (begin_ns <= begin) & (end_ns >= end)
    return Stall(begin, end, int(depth[at]), int((end_ns - begin_ns)[inside].max()))


def _busy_share(executed: list[tuple[Times, Times]], one: Stall) -> float:
    """Share of the moment in which components executed, all states added up."""
    busy_ns = 0
    for begins_ns, ends_ns in executed:
        inside = slice(np.searchsorted(ends_ns, one.begin_ns), np.searchsorted(begins_ns, one.end_ns))
        overlap = np.minimum(ends_ns[inside], one.end_ns) - np.maximum(begins_ns[inside], one.begin_ns)
        busy_ns += int(np.clip(overlap, 0, None).sum())
    return busy_ns / max(one.end_ns - one.begin_ns, 1)
