"""Reaction times and data ages of a chain of components, by the jobs in a trace.

A trace has no record of a read or a write. So a job counts as if it read all its input when it begins and
wrote all its output when it comes to its next wait. A value goes from one component to the next by the first
job that begins after the job before it has finished. A component that really reads later or writes earlier
gets a newer value: a measured time is at least the real one. It is never above the bound of a true model.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from mauve_rt.trace.format.records import Kind, Records
from mauve_rt.trace.reading.pairs import following, gaps
from mauve_rt.trace.reading.statistics import Distribution, Values, distribution

_ALWAYS = np.iinfo(np.int64)
_BREAKS = (Kind.START, Kind.STOP, Kind.FAULT, Kind.PARKED)


@dataclass(frozen=True)
class Jobs:
    """Of one component, in order."""

    begins_ns: Values
    ends_ns: Values
    unknown_ns: npt.NDArray[np.int64]
    """(n, 2): from the last known finish to the next known begin, where jobs may be missing."""


@dataclass(frozen=True)
class ChainTimes:
    """What a trace shows of a chain."""

    reaction: Distribution
    """From the begin of a job of the first component, which just misses a change, to the first finish of the
    last component that shows the change."""
    data_age: Distribution
    """Of the value that a job of the last component replaces, at its finish, from its first begin on."""


def jobs_of(records: Records) -> Jobs:
    """The jobs of one component: from its release to its next wait."""
    then, unless = (Kind.WAIT, Kind.OVERRUN), (Kind.RELEASE, *_BREAKS)
    releases, waits = following(records, Kind.RELEASE, then, unless)
    begins_ns = np.asarray(records["b"][releases], np.int64)
    ends_ns = np.asarray(records["time_ns"][waits], np.int64)
    (breaks,) = np.nonzero(gaps(records) | np.isin(records["kind"], _BREAKS))
    before = np.concatenate([[_ALWAYS.min], ends_ns])
    after = np.concatenate([begins_ns, [_ALWAYS.max]])
    unknown = [(_ALWAYS.min, after[0]), (before[-1], _ALWAYS.max)]
    unknown += zip(
        before[np.searchsorted(waits, breaks, "right")], after[np.searchsorted(releases, breaks)], strict=True
    )
    return Jobs(begins_ns, ends_ns, np.unique(np.array(unknown, np.int64), axis=0))


def chain_times(jobs: Sequence[Jobs]) -> ChainTimes:
    """The times of a chain of components; what spans a gap, a stop, a fault or a change is left out."""
    return ChainTimes(distribution(reactions_ns(jobs)), distribution(data_ages_ns(jobs)))


def reactions_ns(jobs: Sequence[Jobs]) -> Values:
    """For each job of the first component: the reaction to a change just after its begin."""
    if not len(jobs[0].begins_ns):
        return np.empty(0, np.int64)
    since, ends = jobs[0].begins_ns[:-1], jobs[0].ends_ns[1:]
    for each in jobs[1:]:
        found = np.searchsorted(each.begins_ns, ends)
        known = found < len(each.begins_ns)
        since, ends = since[known], each.ends_ns[found[known]]
    return _known(jobs, since, ends)


def data_ages_ns(jobs: Sequence[Jobs]) -> Values:
    """For each job of the last component: the age that its output replaces."""
    if not len(jobs[-1].begins_ns):
        return np.empty(0, np.int64)
    begins, until = jobs[-1].begins_ns[:-1], jobs[-1].ends_ns[1:]
    for each in reversed(jobs[:-1]):
        found = np.searchsorted(each.ends_ns, begins, "right") - 1
        known = found >= 0
        begins, until = each.begins_ns[found[known]], until[known]
    return _known(jobs, begins, until)


def _known(jobs: Sequence[Jobs], begins_ns: Values, ends_ns: Values) -> Values:
    """The lengths of the intervals in which no job of any component may be missing."""
    clear = np.ones(len(begins_ns), np.bool_)
    for each in jobs:
        for begin_ns, end_ns in each.unknown_ns:
            clear &= (ends_ns <= begin_ns) | (begins_ns >= end_ns)
    lengths: Values = (ends_ns - begins_ns)[clear]
    return lengths
