"""Which records of one component belong together. What is lost in between parts them: no pair spans a gap."""

import numpy as np
import numpy.typing as npt

from mauve_rt.trace.format.records import Kind, Records

Indices = npt.NDArray[np.intp]


def gaps(records: Records) -> npt.NDArray[np.bool_]:
    """Tell of each record whether others are missing before it. The first has nothing before it."""
    found = np.zeros(len(records), np.bool_)
    sequence = np.ascontiguousarray(records["sequence"])
    found[1:] = sequence[1:] != sequence[:-1] + np.uint64(1)
    return found


def following(
    records: Records, first: Kind, then: tuple[Kind, ...], unless: tuple[Kind, ...]
) -> tuple[Indices, Indices]:
    """Each record of kind `first` with the next of kind `then`, unless `unless` or a gap is in between."""
    kinds = np.ascontiguousarray(records["kind"])
    (starts,) = np.nonzero(kinds == first)
    (ends,) = np.nonzero(np.isin(kinds, then))
    passed = np.cumsum(np.isin(kinds, unless) | gaps(records))
    found = np.searchsorted(ends, starts)
    starts, found = starts[found < len(ends)], found[found < len(ends)]
    matches = ends[found]
    clear = passed[matches] == passed[starts]
    return starts[clear], matches[clear]


def nested(records: Records, begin: Kind, end: Kind) -> tuple[Indices, Indices]:
    """Each begin with its own end, others of the same kinds within it or not; in the order of the begins.

    A start or a fault ends what went before it: what was begun then has no end.
    """
    kinds = records["kind"]
    opens = kinds == begin
    (marks,) = np.nonzero(opens | (kinds == end))
    opens = opens[marks]
    part = np.cumsum(gaps(records) | np.isin(kinds, (Kind.START, Kind.FAULT)))[marks]
    # A begin and its end are on one level, and nothing of that level is between them.
    level = np.cumsum(np.where(opens, 1, -1)) + ~opens
    order = np.lexsort((marks, level, part))
    one, other = order[:-1], order[1:]
    names = records["name"][marks]
    match = opens[one] & ~opens[other] & (names[one] == names[other])
    match &= (level[one] == level[other]) & (part[one] == part[other])
    begins, ends = marks[one[match]], marks[other[match]]
    by_begin = np.argsort(begins)
    return begins[by_begin], ends[by_begin]
