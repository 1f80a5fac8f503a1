"""Single events on a component's row: overruns, faults, stops, starts, marks, jobs above a bound."""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from mauve_rt.trace.format.records import Kind, Records
from mauve_rt.trace.reading.violations import Violation
from mauve_rt.trace.report.cycles import Array

MARKER = np.dtype(
    [("time_ns", "<i8"), ("number", "<i8"), ("name", "<i8"), ("value", "<i8"), ("skipped", "<i8")]
)
"""value: how late in ns, of a mark the user's a. Merged: worst value, sum of skipped."""

KINDS = {
    Kind.OVERRUN: "overrun",
    Kind.FAULT: "fault",
    Kind.STOP: "stop",
    Kind.START: "start",
    Kind.MARK: "mark",
}
VIOLATION = "violation"
"""Kind of the jobs above their bound."""
MOST = 20_000
"""Markers of one kind in a row; more are merged, far below what a screen could tell apart."""
NO_NAME = -1
_LARGEST = 2**53


class Markers(NamedTuple):
    """Of one kind in one row."""

    kind: str
    entries: Array


def markers_of(records: Records, violations: Iterable[Violation] = ()) -> list[Markers]:
    """Markers of a component by kind; kinds without one are left out. `violations`: of the component."""
    found = [Markers(word, _entries(records[records["kind"] == kind], kind)) for kind, word in KINDS.items()]
    found.append(Markers(VIOLATION, _above_bound([*violations])))
    return [one for one in found if len(one.entries)]


def _above_bound(violations: list[Violation]) -> Array:
    entries = np.zeros(len(violations), MARKER)
    entries["time_ns"] = [one.end_ns for one in violations]
    entries["number"] = [one.jobs for one in violations]
    entries["value"] = [one.excess_ns for one in violations]
    entries["name"] = NO_NAME
    return entries if len(entries) <= MOST else _merged(entries)


def _entries(rows: Records, kind: Kind) -> Array:
    entries = np.zeros(len(rows), MARKER)
    entries["time_ns"] = rows["time_ns"]
    entries["number"] = 1
    entries["name"] = rows["name"]
    if kind == Kind.OVERRUN:
        entries["value"] = rows["b"] - rows["a"]
        entries["skipped"] = rows["c"]
    elif kind == Kind.MARK:
        entries["value"] = np.clip(rows["a"], -_LARGEST, _LARGEST)
    return entries if len(entries) <= MOST else _merged(entries)


def _merged(entries: Array) -> Array:
    time_ns = entries["time_ns"]
    bucket_ns = max(1, int(time_ns[-1] - time_ns[0]) // MOST + 1)
    (starts,) = np.nonzero(np.diff((time_ns - time_ns[0]) // bucket_ns, prepend=-1))
    merged = entries[starts].copy()
    merged["number"] = np.add.reduceat(entries["number"], starts)
    merged["value"] = np.maximum.reduceat(entries["value"], starts)
    merged["skipped"] = np.add.reduceat(entries["skipped"], starts)
    return merged
