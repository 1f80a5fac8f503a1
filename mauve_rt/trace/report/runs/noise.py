"""The noise of a run: how much a figure changes by chance, as the blocks of the run show it.

Releases that follow each other are alike, so single releases cannot be resampled. Each run is cut into blocks
of consecutive values, and whole blocks are resampled (block bootstrap: Kuensch 1989, The jackknife and the
bootstrap for general stationary observations). Rates of events are compared by the exact conditional test of
two Poisson counts (Przyborowski and Wilenski 1940), with Clopper and Pearson's interval.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from statistics import NormalDist
from typing import NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

RESAMPLES = 1_000
BLOCKS, LEAST_BLOCKS = 32, 20
"""Blocks of a run: more of them are shorter, and noise that lasts longer than a block is not seen."""
SIGNIFICANCE = 0.05
"""Chance that any figure of a page is marked though the runs are equal, at most."""
LEAST_BEYOND = 10
"""Values beyond a percentile without which the percentile is that of a few outliers."""
_BLOCK_VALUES = 25
_BLOCK_NS, _FEWEST_VALUES = 500_000_000, 5
_SEEDS = (1, 2)
_WHOLE, _EVEN, _ODD, _RESAMPLED = 0, 1, 2, 3
_GRID = np.concatenate([np.linspace(0, 0.95, 1_000), np.linspace(0.95, 1, 1_000)])
_BISECTIONS = 60

Values = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float64]


class Judged(NamedTuple):
    """A change with its interval, at 95 % for all figures of the page together."""

    value: float
    """B / A, or B - A."""
    low: float
    high: float
    is_ratio: bool
    differs: bool
    """The interval excludes no change, and the change exceeds the change between the halves of either run."""


class Comparable(Protocol):
    """A change that can be judged once the number of tested figures is known."""

    def judged(self, tested: int) -> Judged:
        """Return the change with its interval, where `tested` figures share the 5 % (Bonferroni)."""
        ...


@dataclass(frozen=True)
class Change:
    """How a figure of B differs from the figure of A."""

    value: float
    """log(B / A), or B - A."""
    error: float
    """Standard error of the value."""
    freedom: int
    """Degrees of freedom: blocks of the run with fewer blocks, minus 1."""
    halves: float
    """The larger change between the odd and the even blocks of one run."""
    is_ratio: bool

    def judged(self, tested: int) -> Judged:
        """Return the change with its interval."""
        reach = student_quantile(1 - SIGNIFICANCE / max(tested, 1) / 2, self.freedom) * self.error
        low, high = self.value - reach, self.value + reach
        differs = (low > 0 or high < 0) and abs(self.value) > self.halves
        ends = (self.value, low, high)
        value, low, high = (float(np.exp(end)) for end in ends) if self.is_ratio else ends
        return Judged(value, low, high, self.is_ratio, differs)


class Events(NamedTuple):
    """Events of one run, each at a release."""

    at: npt.NDArray[np.intp]
    """Number of the release, from 0."""
    sizes: Values
    """Of each event; 1, or how many instants were skipped or missed."""
    releases: int
    blocks: int
    """Of the run; see `block_count`."""

    @property
    def total(self) -> int:
        """All sizes together."""
        return int(self.sizes.sum())

    def per_block(self) -> Floats:
        """Sizes in each block."""
        block = self.at * self.blocks // max(self.releases, 1)
        return np.bincount(block, weights=self.sizes, minlength=self.blocks).astype(np.float64)


@dataclass(frozen=True)
class RateChange:
    """How often per release something happened in B and in A."""

    totals: tuple[int, int]
    releases: tuple[int, int]
    burst: float
    """Events that come together: so many count as one."""
    halves: float
    """The larger difference of rates between the odd and the even blocks of one run."""

    def judged(self, tested: int) -> Judged:
        """Return the ratio of rates with its interval; the ratio is infinite where A has no event."""
        (count_a, count_b), (releases_a, releases_b) = self.totals, self.releases
        single_a, single_b = (round(count / self.burst) for count in self.totals)
        significance = SIGNIFICANCE / max(tested, 1)
        low, high = (
            share / (1 - share) * releases_a / releases_b if share < 1 else np.inf
            for share in binomial_interval(single_b, single_a + single_b, significance)
        )
        rate_a, rate_b = count_a / releases_a, count_b / releases_b
        differs = (low > 1 or high < 1) and abs(rate_b - rate_a) > self.halves
        return Judged(rate_b / rate_a if count_a else np.inf, low, high, is_ratio=True, differs=differs)


def block_count(values: int, duration_ns: int) -> int:
    """Return into how many blocks a run is cut; 0 when it is too short to tell its noise.

    A block has at least 25 values; or it lasts 0.5 s, and has 5.
    """
    for blocks in (BLOCKS, LEAST_BLOCKS):
        each = values // blocks
        if each >= _BLOCK_VALUES or (each >= _FEWEST_VALUES and duration_ns // blocks >= _BLOCK_NS):
            return blocks
    return 0


def percentile_changes(
    a: Values, b: Values, blocks: tuple[int, int], shares: Sequence[float]
) -> list[Change | None]:
    """Return the change of each percentile; None where there are too few values beyond it.

    Args:
        a: values of A in the order of time, any unit.
        b: the same of B.
        blocks: of A and of B.
        shares: 0.5 for the median, and so on.
    """
    told = [min(len(a), len(b)) * (1 - share) >= LEAST_BEYOND for share in shares]
    both = [
        _percentiles(values, shares, _weights(count, seed))
        for values, count, seed in zip((a, b), blocks, _SEEDS, strict=True)
    ]
    return [
        _change(both[0][:, index], both[1][:, index], blocks) if enough else None
        for index, enough in enumerate(told)
    ]


def moment_changes(a: Floats, b: Floats, blocks: tuple[int, int]) -> tuple[Change, Change]:
    """Return the changes of the mean and of the root of the mean square, as differences; no value is NaN."""
    found: list[list[Floats]] = []
    for values, count, seed in zip((a, b), blocks, _SEEDS, strict=True):
        block = _blocks(len(values), count)
        weights = _weights(count, seed)
        number, total, squares = (
            weights @ np.bincount(block, weights=one, minlength=count)
            for one in (np.ones(len(values)), values, values**2)
        )
        found.append([total / number, np.sqrt(squares / number)])
    (mean_a, rms_a), (mean_b, rms_b) = found
    mean = _change(mean_a, mean_b, blocks, is_ratio=False)
    return mean, _change(rms_a, rms_b, blocks, is_ratio=False)


def rate_change(a: Events, b: Events) -> RateChange | None:
    """Return the change of a rate; None when there was no event, or a run is too short to tell bursts."""
    if not (a.blocks and b.blocks) or a.total + b.total == 0:
        return None
    sizes = np.concatenate([a.sizes, b.sizes]).astype(np.float64)
    bursts = [1.0, float((sizes**2).sum() / sizes.sum())]
    halves = 0.0
    for run in (a, b):
        per_block = run.per_block()
        if run.total:
            bursts.append(float(per_block.var(ddof=1) / per_block.mean()))
        difference = abs(per_block[0::2].sum() - per_block[1::2].sum())
        halves = max(halves, float(difference) / (run.releases / 2))
    return RateChange((a.total, b.total), (a.releases, b.releases), max(bursts), halves)


def student_quantile(share: float, freedom: int) -> float:
    """Quantile of Student's distribution (Abramowitz and Stegun 26.7.5; within 2 % from 19 degrees on)."""
    z = NormalDist().inv_cdf(share)
    terms = (
        z,
        (z**3 + z) / 4,
        (5 * z**5 + 16 * z**3 + 3 * z) / 96,
        (3 * z**7 + 19 * z**5 + 17 * z**3 - 15 * z) / 384,
        (79 * z**9 + 776 * z**7 + 1482 * z**5 - 1920 * z**3 - 945 * z) / 92_160,
    )
    return float(sum(term / freedom**power for power, term in enumerate(terms)))


def binomial_interval(hits: int, trials: int, significance: float) -> tuple[float, float]:
    """Return Clopper and Pearson's interval of a share, which misses the share with that chance at most."""
    if not trials:
        return 0.0, 1.0
    logs = np.concatenate([[0.0], np.cumsum(np.log(np.arange(1, trials + 1)))])

    def at_most(count: int, share: float) -> float:
        """Chance of so many hits or fewer."""
        k = np.arange(count + 1)
        choose = logs[trials] - logs[k] - logs[trials - k]
        return float(np.exp(choose + k * np.log(share) + (trials - k) * np.log1p(-share)).sum())

    low = _root(lambda share: 1 - at_most(hits - 1, share) < significance / 2) if hits else 0.0
    high = _root(lambda share: at_most(hits, share) > significance / 2) if hits < trials else 1.0
    return low, high


def _root(is_below: Callable[[float], bool]) -> float:
    """Where a condition on a share ends to hold."""
    low, high = 0.0, 1.0
    for _ in range(_BISECTIONS):
        middle = (low + high) / 2
        low, high = (middle, high) if is_below(middle) else (low, middle)
    return (low + high) / 2


def _change(a: Floats, b: Floats, blocks: tuple[int, int], *, is_ratio: bool | None = None) -> Change:
    """Compare a figure of both runs, each with those of its halves and of its resampled blocks."""
    if is_ratio is None:
        is_ratio = bool((a > 0).all() and (b > 0).all())
    if is_ratio:
        a, b = np.log(a), np.log(b)
    variance = sum(
        one[_RESAMPLED:].var() * count / (count - 1) for one, count in zip((a, b), blocks, strict=True)
    )
    halves = max(abs(float(one[_EVEN] - one[_ODD])) for one in (a, b))
    value = float(b[_WHOLE] - a[_WHOLE])
    return Change(value, float(np.sqrt(variance)), min(blocks) - 1, halves, is_ratio)


@cache
def _weights(blocks: int, seed: int) -> Floats:
    """How often each block is taken: all once, the even ones, the odd ones, then each resample."""
    even = np.arange(blocks) % 2 == 0
    shares = np.full(blocks, 1 / blocks)
    drawn = np.random.default_rng(seed).multinomial(blocks, shares, RESAMPLES)
    return np.vstack([np.ones(blocks), even, ~even, drawn]).astype(np.float64)


def _blocks(values: int, blocks: int) -> npt.NDArray[np.int64]:
    """Number of the block of each value."""
    return np.arange(values, dtype=np.int64) * blocks // max(values, 1)


def _percentiles(values: Values, shares: Sequence[float], weights: Floats) -> Floats:
    """Percentiles of weighted blocks, (weights, shares): the smallest value with that share at or below it.

    Values are counted in 2,000 intervals that are finest near the end; each stands for its largest value. The
    percentiles of the whole run are exact.
    """
    blocks = weights.shape[1]
    edges = np.unique(np.quantile(values, [*_GRID, *shares], method="inverted_cdf"))
    cell = _blocks(len(values), blocks) * len(edges) + np.searchsorted(edges, values)
    counts = np.bincount(cell, minlength=blocks * len(edges)).reshape(blocks, len(edges))
    below = weights @ counts.cumsum(axis=1)
    found = np.empty((len(weights), len(shares)))
    for index, share in enumerate(shares):
        wanted = np.ceil(share * below[:, -1] - 1e-9)
        found[:, index] = edges[np.count_nonzero(below < wanted[:, None], axis=1)]
    return found
