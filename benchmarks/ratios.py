"""What repeated, interleaved measurements on a noisy machine can be said to show.

(Not called `statistics`: a script's folder comes first on Python's path, and would hide the standard module.)
"""

from collections.abc import Sequence
from typing import Literal, NamedTuple

import numpy as np

Verdict = Literal["met", "missed", "undecided", "reported", "not available"]

MIN_ROUNDS = 10
"""Fewer rounds decide nothing."""
_RESAMPLES = 10_000
_CONFIDENCE = 0.95


class Interval(NamedTuple):
    """A median with its bootstrap interval of 95 %."""

    value: float
    low: float
    high: float


def median_interval(values: Sequence[float], *, seed: int = 0) -> Interval:
    """The median of values with its percentile bootstrap interval (Efron 1979).

    Raises:
        ValueError: no values.
    """
    if not len(values):
        raise ValueError("there is no median of no values")
    data = np.asarray(values, np.float64)
    random = np.random.default_rng(seed)
    medians = np.median(random.choice(data, size=(_RESAMPLES, len(data))), axis=1)
    tail = (1 - _CONFIDENCE) / 2
    low, high = np.quantile(medians, [tail, 1 - tail])
    return Interval(float(np.median(data)), float(low), float(high))


def ratio_interval(pairs: Sequence[tuple[float, float]], *, seed: int = 0) -> Interval:
    """The median of measured / reference over the pairs, with its interval.

    A pair is one round, both sides of which ran next to each other: what the machine did to both cancels out.

    Raises:
        ValueError: no pairs, or a reference that is not positive.
    """
    if any(reference <= 0 for _, reference in pairs):
        raise ValueError("a reference of a ratio must be positive")
    return median_interval([measured / reference for measured, reference in pairs], seed=seed)


def verdict(interval: Interval, limit: float, *, rounds: int) -> Verdict:
    """Whether the limit is kept: undecided while it lies inside the interval, or with too few rounds."""
    if rounds < MIN_ROUNDS:
        return "undecided"
    if interval.high <= limit:
        return "met"
    return "missed" if interval.low > limit else "undecided"


def percentile(values: Sequence[float], percent: float) -> float:
    """The smallest of the values with that share at or below it.

    Raises:
        ValueError: no values.
    """
    if not len(values):
        raise ValueError("there is no percentile of no values")
    return float(np.quantile(np.asarray(values, np.float64), percent / 100, method="inverted_cdf"))
