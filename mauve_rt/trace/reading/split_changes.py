"""Changes that were split: a release on the wrong side of the instant T of its component's change.

A component executes with its old parts before T, and with the change from T on. Each take record tells T, and
each release record its own instant. So a bag alone shows whether the changes in it kept to this rule.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from mauve_rt.trace.format.records import Kind, ReconfigurationPhase, Records

_LATEST = np.iinfo(np.int64).max


class SplitChange(NamedTuple):
    """A release that ran with the wrong parts. Instants in ns of the component's clock."""

    instant_ns: int
    """T of the change."""
    release_ns: int
    """Nominal instant of the release: of several the one that is farthest from T."""
    is_new: bool
    """The release ran with new parts, although it was before T; else with old parts, at T or later."""


def split_changes(rows: Records) -> list[SplitChange]:
    """Return what was split of a component's changes; its records are in the order of their sequence."""
    takes = _takes(rows)
    takes = takes[rows["c"][takes] > 0]
    if not len(takes):
        return []
    (releases,) = np.nonzero(rows["kind"] == Kind.RELEASE)
    clocks = rows["a"][releases]
    latest = np.concatenate(([0], np.maximum.accumulate(clocks)))
    earliest = np.concatenate((np.minimum.accumulate(clocks[::-1])[::-1], [_LATEST]))
    before = np.searchsorted(releases, takes)  # how many releases come before each take
    found = [
        SplitChange(int(rows["c"][take]), int(edge), is_new)
        for is_new, edges, is_split in (
            (False, latest[before], latest[before] >= rows["c"][takes]),
            (True, earliest[before], earliest[before] < rows["c"][takes]),
        )
        for take, edge in zip(takes[is_split], edges[is_split], strict=True)
    ]
    return sorted(set(found))  # a change of several parts has a take record of each


def has_takes_without_instant(rows: Records) -> bool:
    """Whether a change of these records does not tell T: its take record follows that of its adopt."""
    takes = _takes(rows)
    takes = takes[(takes > 0) & (rows["c"][takes] == 0)]
    before = rows[takes - 1]
    is_adopt = (before["kind"] == Kind.RECONFIGURATION) & (before["a"] == ReconfigurationPhase.ADOPT)
    return bool(np.any(is_adopt))  # a fallback is taken without an adopt


def _takes(rows: Records) -> npt.NDArray[np.intp]:
    (takes,) = np.nonzero((rows["kind"] == Kind.RECONFIGURATION) & (rows["a"] == ReconfigurationPhase.TAKE))
    return takes
