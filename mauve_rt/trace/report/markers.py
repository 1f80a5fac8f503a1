"""Single events on a component's row: overruns, faults, stops, starts, marks, jobs above a bound, lines."""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from mauve_rt.trace.format.records import Kind, Records
from mauve_rt.trace.reading.log_lines import WARN, LogLine
from mauve_rt.trace.reading.violations import Violation
from mauve_rt.trace.report.cycles import Array

MARKER = np.dtype(
    [("time_ns", "<i8"), ("number", "<i8"), ("name", "<i8"), ("value", "<i8"), ("skipped", "<i8")]
)
"""value: how late in ns, of a mark the user's a, of a log line its level. Merged: worst value, sum of
skipped.
"""

KINDS = {
    Kind.OVERRUN: "overrun",
    Kind.FAULT: "fault",
    Kind.STOP: "stop",
    Kind.START: "start",
    Kind.MARK: "mark",
}
VIOLATION = "violation"
"""Kind of the jobs above their bound."""
LOG, WARNING = "log", "warning"
"""Kinds of log lines, below WARN and from it on."""
MOST_TEXTS = 5_000
"""Log lines whose text the page has, of all components."""
MOST = 20_000
"""Markers of one kind in a row; more are merged, far below what a screen could tell apart."""
NO_NAME = -1
_LARGEST = 2**53


class Markers(NamedTuple):
    """Of one kind in one row."""

    kind: str
    entries: Array


class Text(NamedTuple):
    """A log line, with the number of its text among the page's names."""

    line: LogLine
    name: int


def markers_of(
    records: Records, violations: Iterable[Violation] = (), log: Sequence[Text] = ()
) -> list[Markers]:
    """Markers of a component by kind; kinds without one are left out."""
    found = [Markers(word, _entries(records[records["kind"] == kind], kind)) for kind, word in KINDS.items()]
    found.append(Markers(VIOLATION, _above_bound([*violations])))
    found.append(Markers(LOG, _written([one for one in log if one.line.level < WARN])))
    found.append(Markers(WARNING, _written([one for one in log if one.line.level >= WARN])))
    return [one for one in found if len(one.entries)]


def numbered(log: Iterable[LogLine], first: int) -> tuple[list[Text], list[str]]:
    """Return the lines with numbers of texts from `first` on, and the texts."""
    lines = [*log]
    texts = list(dict.fromkeys(line.text for line in lines))[:MOST_TEXTS]
    numbers = {text: first + place for place, text in enumerate(texts)}
    return [Text(line, numbers.get(line.text, NO_NAME)) for line in lines], texts


def _written(log: list[Text]) -> Array:
    entries = np.zeros(len(log), MARKER)
    entries["time_ns"] = [one.line.time_ns for one in log]
    entries["number"] = 1
    entries["value"] = [one.line.level for one in log]
    entries["name"] = [one.name for one in log]
    return entries if len(entries) <= MOST else _merged(entries)


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
