"""Levels of detail: what a page keeps in full and what it merges when a trace has more than fits.

Everything is kept around the instants that a person will look at (reconfigurations, overruns, faults, the
worst latencies, the begin, the end); elsewhere executions of a state and releases that begin in the same
interval become one entry, which still tells how many they were and how long they took together.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from mauve_rt.trace.report.cycles import Array, Times

BUDGET = 600_000
"""Entries (executions and releases) in a page: about 4 MB."""
_KEPT_SHARE = 0.7
_WIDEST_NS = 4_000_000_000
_NARROWEST_NS = 1_000


@dataclass(frozen=True)
class Detail:
    """Which intervals are kept in full, and the length of those into which all else is merged."""

    kept_ns: npt.NDArray[np.int64]
    """(n, 2): begin and end, in order, apart from each other."""
    bucket_ns: int
    """0: everything is kept."""

    @property
    def full(self) -> bool:
        """Nothing is merged."""
        return self.bucket_ns == 0

    def thinned(self, entries: Array) -> Array:
        """Return entries with those outside of the kept intervals merged."""
        if self.full or not len(entries):
            return entries
        begin_ns = entries["begin_ns"]
        region = np.searchsorted(self.kept_ns.ravel(), begin_ns, side="right")
        bucket = begin_ns // self.bucket_ns
        alone = region % 2 == 1
        new = np.ones(len(entries), np.bool_)
        new[1:] = alone[1:] | (np.diff(region) != 0) | (np.diff(bucket) != 0)
        (starts,) = np.nonzero(new)
        lasts = np.append(starts[1:], len(entries)) - 1
        merged = entries[starts].copy()
        end_ns = begin_ns[lasts] + entries["extent_ns"][lasts]
        merged["extent_ns"] = end_ns - merged["begin_ns"]
        names = entries.dtype.names or ()
        for name in names:
            if name in ("busy_ns", "number"):
                merged[name] = np.add.reduceat(entries[name], starts)
            elif name in ("wakeup_ns", "response_ns"):
                merged[name] = np.maximum.reduceat(entries[name], starts)
            elif name in ("low", "high"):  # the NaN among them count only where all are
                merged[name] = (np.fmin if name == "low" else np.fmax).reduceat(entries[name], starts)
        return merged


def choose_detail(tracks: Sequence[Array], instants_ns: Times, *, budget: int = BUDGET) -> Detail:
    """Return what to keep of these tracks so that `budget` entries remain, or little more.

    `instants_ns` are the interesting ones; the intervals around them are as wide as the budget allows.
    """
    total = sum(map(len, tracks))
    if total <= budget:
        return Detail(np.empty((0, 2), np.int64), 0)
    half_ns = _WIDEST_NS
    kept = _around(instants_ns, half_ns)
    while half_ns > _NARROWEST_NS and _entries_within(tracks, kept) > _KEPT_SHARE * budget:
        half_ns //= 2
        kept = _around(instants_ns, half_ns)
    begins = [int(track["begin_ns"][0]) for track in tracks if len(track)]
    ends = [int(track["begin_ns"][-1]) for track in tracks if len(track)]
    buckets = max(1, int((1 - _KEPT_SHARE) * budget / len(begins)))
    return Detail(kept, max(1, (max(ends) - min(begins)) // buckets))


def _around(instants_ns: Times, half_ns: int) -> npt.NDArray[np.int64]:
    """Intervals around instants, those that overlap joined."""
    ordered = np.unique(instants_ns)
    if not len(ordered):
        return np.empty((0, 2), np.int64)
    (apart,) = np.nonzero(np.diff(ordered) > 2 * half_ns)
    first = ordered[np.append(0, apart + 1)] - half_ns
    last = ordered[np.append(apart, len(ordered) - 1)] + half_ns
    return np.stack([first, last], axis=1)


def _entries_within(tracks: Sequence[Array], kept_ns: npt.NDArray[np.int64]) -> int:
    edges = kept_ns.ravel()
    counts = (np.searchsorted(track["begin_ns"], edges) for track in tracks)
    return sum(int((at[1::2] - at[::2]).sum()) for at in counts)
