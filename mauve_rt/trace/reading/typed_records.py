"""Trace records as typed values, for who walks through them one by one. All times in ns of CLOCK_MONOTONIC.

For millions of them the arrays (`Trace.of`) and the data frames (`Trace.frames`) are the way.
"""

from collections.abc import Callable, Iterator
from heapq import merge
from typing import Any, NamedTuple

import numpy as np

from mauve_rt.trace.format.records import Kind, ReconfigurationPhase
from mauve_rt.trace.reading.facts import Deployment
from mauve_rt.trace.reading.trace import Trace


class Deployed(NamedTuple):
    """A component joined its grid."""

    time_ns: int
    component: str
    grid: Deployment


class Started(NamedTuple):
    """A component was started."""

    time_ns: int
    component: str
    first_nominal_ns: int


class Stopped(NamedTuple):
    """A component parked for a stop."""

    time_ns: int
    component: str
    before_state: str
    pending_ns: int
    """The instant it would have been released at; 0 when it was in no wait."""


class Faulted(NamedTuple):
    """User code threw, or ran too long."""

    time_ns: int
    component: str
    state: str


class Released(NamedTuple):
    """The end of a wait."""

    time_ns: int
    component: str
    wait: str
    nominal_ns: int
    actual_ns: int

    @property
    def wakeup_ns(self) -> int:
        """Wake-up latency."""
        return self.actual_ns - self.nominal_ns


class StateBegun(NamedTuple):
    """An execution state begins."""

    time_ns: int
    component: str
    state: str


class StateEnded(NamedTuple):
    """An execution state ends."""

    time_ns: int
    component: str
    state: str


class Waited(NamedTuple):
    """A wait was entered, at or before the instant of its end."""

    time_ns: int
    component: str
    wait: str
    until_ns: int


class Overrun(NamedTuple):
    """A wait was entered after the instant of its end."""

    time_ns: int
    component: str
    wait: str
    missed_ns: int
    now_ns: int
    skipped: int
    """Instants left out by the policy."""


class Parked(NamedTuple):
    """A component parked in its wait for a commit."""

    time_ns: int
    component: str
    wait: str
    pending_ns: int


class Armed(NamedTuple):
    """A parked component goes on."""

    time_ns: int
    component: str
    wait: str
    pending_ns: int
    committed: bool
    """False: refused by adopt, or called off; everything is as before."""
    lost: int = 0
    """Instants that passed since it was parked: the change's own, not overruns."""


class ServiceBegun(NamedTuple):
    """A call of a resource's service begins."""

    time_ns: int
    component: str
    service: str
    """resource.service"""


class ServiceEnded(NamedTuple):
    """A call of a resource's service ends."""

    time_ns: int
    component: str
    service: str


class Contended(NamedTuple):
    """A lock that another thread held was waited for."""

    time_ns: int
    component: str
    resource: str
    holder_tid: int
    waited_ns: int


class Reconfigured(NamedTuple):
    """A phase of a commit."""

    time_ns: int
    component: str
    what: str
    phase: ReconfigurationPhase
    duration_ns: int
    instant_ns: int = 0
    """T: the component executes with the change from this instant on. 0: of an adopt, or of a fallback."""


class Marked(NamedTuple):
    """A user's own record."""

    time_ns: int
    component: str
    word: str
    a: int
    b: int
    c: int


class Told(NamedTuple):
    """A record of a kind that came after this reader, as the bag's table names it."""

    time_ns: int
    component: str
    kind: str
    word: str
    """What `name` stands for; empty when the kind has none."""
    figures: dict[str, int]
    """a, b, c by what they are called."""


Record = (
    Deployed | Started | Stopped | Faulted | Released | StateBegun | StateEnded | Waited | Overrun | Parked
    | Armed | ServiceBegun | ServiceEnded | Contended | Reconfigured | Marked | Told
)  # fmt: skip

_MAKE: dict[int, Callable[[int, str, str, int, int, int], Record]] = {
    Kind.DEPLOYMENT: lambda t, who, _, a, b, c: Deployed(t, who, Deployment(t, a, b, c)),
    Kind.START: lambda t, who, _, a, _b, _c: Started(t, who, a),
    Kind.STOP: lambda t, who, name, a, _b, _c: Stopped(t, who, name, a),
    Kind.FAULT: lambda t, who, name, _a, _b, _c: Faulted(t, who, name),
    Kind.RELEASE: lambda t, who, name, a, b, _c: Released(t, who, name, a, b),
    Kind.STATE_BEGIN: lambda t, who, name, _a, _b, _c: StateBegun(t, who, name),
    Kind.STATE_END: lambda t, who, name, _a, _b, _c: StateEnded(t, who, name),
    Kind.WAIT: lambda t, who, name, a, _b, _c: Waited(t, who, name, a),
    Kind.OVERRUN: Overrun,
    Kind.PARKED: lambda t, who, name, a, _b, _c: Parked(t, who, name, a),
    Kind.ARMED: lambda t, who, name, a, b, c: Armed(t, who, name, a, b == 1, c),
    Kind.SERVICE_BEGIN: lambda t, who, name, _a, _b, _c: ServiceBegun(t, who, name),
    Kind.SERVICE_END: lambda t, who, name, _a, _b, _c: ServiceEnded(t, who, name),
    Kind.CONTENDED: lambda t, who, name, a, b, _c: Contended(t, who, name, a, b),
    Kind.RECONFIGURATION: lambda t, who, name, a, b, c: Reconfigured(
        t, who, name, ReconfigurationPhase(a), b, c
    ),
    Kind.MARK: Marked,
}


def typed_records(trace: Trace, *components: str) -> Iterator[Record]:
    """Yield the records of these components (all when none is named) by time. Kinds not told of are left out.

    Raises:
        TraceError: there is no such component in the trace.

    """
    sources = [_of_component(trace, name) for name in components or trace.components]
    return merge(*sources, key=lambda record: record.time_ns)


def _of_component(trace: Trace, component: str) -> Iterator[Record]:
    rows: Any = trace.of(component)
    rows = rows[np.argsort(rows["time_ns"], kind="stable")]  # a release is stamped by its actual time
    for row in rows:
        kind, time_ns, word = int(row["kind"]), int(row["time_ns"]), trace.name(int(row["name"]))
        make, told = _MAKE.get(kind), trace.kinds.get(kind)
        if make is not None:
            yield make(time_ns, component, word, int(row["a"]), int(row["b"]), int(row["c"]))
        elif told is not None:
            figures = {name: int(row[field]) for field, name in told.figures.items()}
            yield Told(time_ns, component, told.name, word if "name" in told.fields else "", figures)
