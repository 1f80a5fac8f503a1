"""What took the time in the cycles that overran: a state, or a wake-up that came late already."""

from typing import NamedTuple

import numpy as np

from mauve_rt.trace.format.records import Kind, Records
from mauve_rt.trace.report.analysis import Analysis


class LateCycles(NamedTuple):
    """The cycles that overran, row by row: the records that they began and ended with."""

    released: Records
    overran: Records


class Culprit(NamedTuple):
    """What took longest in cycles that ended late."""

    state: str
    """Empty: the wake-up latency."""
    overruns: int
    """In so many it took longest."""
    longest_ns: int
    """What it took in the worst of them, preemption included."""


def culprits(analysis: Analysis, component: str) -> list[Culprit]:
    """What took longest, by in how many overruns of the component; empty when the trace does not tell."""
    released, overran = late_cycles(analysis, component)
    if not len(overran):
        return []
    states = analysis.slices[component]
    begin_ns, end_ns = released["time_ns"], overran["time_ns"]
    took = np.zeros((len(states) + 1, len(overran)), np.int64)
    took[-1] = released["b"] - released["a"]
    for index, slices in enumerate(states.values()):
        total = np.concatenate([[0], np.cumsum(slices["busy_ns"])])
        first, last = (np.searchsorted(slices["begin_ns"], time_ns) for time_ns in (begin_ns, end_ns))
        took[index] = total[last] - total[first]
    longest = np.where(took.max(axis=0) > 0, took.argmax(axis=0), -1)
    found = [
        Culprit(state, int(mine.sum()), int(took[index][mine].max()))
        for index, state in enumerate([*states, ""])
        if (mine := longest == index).any()
    ]
    return sorted(found, key=lambda one: -one.overruns)


def late_cycles(analysis: Analysis, component: str) -> LateCycles:
    """Return the cycles that overran, but for one whose release is not in the trace."""
    records = analysis.trace.of(component)
    (late,) = np.nonzero(records["kind"] == Kind.OVERRUN)
    (released,) = np.nonzero(records["kind"] == Kind.RELEASE)
    before = np.searchsorted(released, late) - 1
    late, before = late[before >= 0], before[before >= 0]
    return LateCycles(records[released[before]], records[late])
