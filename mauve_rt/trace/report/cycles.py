"""A component's executions of states and its releases as arrays that can be drawn, merged, searched."""

import numpy as np
import numpy.typing as npt

from mauve_rt.trace.format.records import Kind, Records
from mauve_rt.trace.reading.pairs import gaps
from mauve_rt.trace.reading.statistics import state_spans
from mauve_rt.trace.reading.trace import Trace

SLICE = np.dtype([("begin_ns", "<i8"), ("extent_ns", "<i8"), ("busy_ns", "<i8"), ("number", "<i8")])
"""One execution of a state, or several of the same state merged: then busy is less than the extent."""

RELEASE = np.dtype(
    [
        ("begin_ns", "<i8"),
        ("extent_ns", "<i8"),
        ("number", "<i8"),
        ("wakeup_ns", "<i8"),
        ("response_ns", "<i8"),
    ]
)
"""One release by its nominal instant, or several merged: with their worst latency and response time."""

UNKNOWN = -1
"""A response time that the trace does not tell: a stop, a gap or the end came first."""

Array = npt.NDArray[np.void]
Times = npt.NDArray[np.int64]


def slices_by_state(trace: Trace, component: str) -> dict[str, Array]:
    """Executions of each state of a component, states in the order in which they first ran."""
    spans = state_spans(trace.of(component))
    names, first = np.unique(spans["name"], return_index=True)
    found: dict[str, Array] = {}
    for name in names[np.argsort(first)]:
        of_state = spans[spans["name"] == name]
        slices = np.zeros(len(of_state), SLICE)
        slices["begin_ns"] = of_state["begin_ns"]
        slices["extent_ns"] = of_state["end_ns"] - of_state["begin_ns"]
        slices["busy_ns"] = slices["extent_ns"]
        slices["number"] = 1
        found[trace.name(int(name))] = _by_begin(slices)
    return found


def releases_of(records: Records) -> Array:
    """Releases of a component, in order."""
    (at,) = np.nonzero(records["kind"] == Kind.RELEASE)
    rows = records[at]
    found = np.zeros(len(rows), RELEASE)
    found["begin_ns"] = rows["a"]
    found["number"] = 1
    found["wakeup_ns"] = rows["b"] - rows["a"]
    ends = next_of(records, at, (Kind.WAIT, Kind.OVERRUN), unless=(Kind.RELEASE, Kind.STOP))
    found["response_ns"] = np.where(ends >= 0, records["time_ns"][ends] - rows["a"], UNKNOWN)
    return _by_begin(found)


def _by_begin(entries: Array) -> Array:
    """Return them sorted, as those who search them need it; records nearly always are already."""
    begin_ns = entries["begin_ns"]
    return entries if (begin_ns[1:] >= begin_ns[:-1]).all() else entries[np.argsort(begin_ns, kind="stable")]


def next_of(records: Records, at: Times, kinds: tuple[Kind, ...], *, unless: tuple[Kind, ...]) -> Times:
    """Index of the next record of these kinds after each of `at`; -1 when `unless` or a gap is before it."""
    (ends,) = np.nonzero(np.isin(records["kind"], kinds))
    if not len(ends):
        return np.full(len(at), -1, np.int64)
    passed = np.cumsum(np.isin(records["kind"], unless) | gaps(records))
    found = np.searchsorted(ends, at, side="right")
    there = found < len(ends)
    index = ends[np.minimum(found, len(ends) - 1)]
    return np.where(there & (passed[index] == passed[at]), index, -1).astype(np.int64)
