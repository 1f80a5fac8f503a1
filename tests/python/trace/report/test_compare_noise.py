"""The noise of runs: correlation and more figures widen the intervals; a short run has none."""

import math

import numpy as np
import pytest

from mauve_rt.trace.report.runs.noise import (
    Change,
    Events,
    binomial_interval,
    block_count,
    moment_changes,
    percentile_changes,
    rate_change,
    student_quantile,
)


def test_more_tested_figures_widen_the_interval() -> None:
    change = Change(0.5, 0.15, 31, 0.1, is_ratio=False)
    assert change.judged(1).differs
    assert not change.judged(100).differs
    assert change.judged(100).low < change.judged(1).low


def test_a_change_within_the_halves_of_a_run_is_no_difference() -> None:
    assert not Change(0.5, 0.01, 31, 0.6, is_ratio=False).judged(1).differs


def test_correlation_widens_the_interval() -> None:
    noise = np.random.default_rng(3)
    alike = np.repeat(noise.gamma(4, 1e5, 64), 25).astype(np.int64)
    (together,) = percentile_changes(alike, alike, (32, 32), [0.5])
    apart = noise.permutation(alike)
    (single,) = percentile_changes(apart, apart, (32, 32), [0.5])
    assert together is not None
    assert single is not None
    assert together.error > 2 * single.error


def test_the_percentile_of_a_run_is_exact_and_that_of_few_values_is_not_told() -> None:
    values = np.random.default_rng(4).integers(1, 10**9, 5_000)
    half, tail = percentile_changes(values, 2 * values, (32, 32), [0.5, 0.99])
    assert tail is not None
    assert percentile_changes(values[:1_000], values, (32, 32), [0.99]) != [None]
    assert percentile_changes(values[:999], values, (32, 32), [0.99]) == [None]
    assert half is not None
    assert half.value == pytest.approx(math.log(2), rel=1e-3)


def test_a_mean_is_compared_by_its_difference() -> None:
    values = np.random.default_rng(5).normal(size=2_000)
    mean, rms = moment_changes(values, values + 3, (20, 32))
    assert mean.value == pytest.approx(3)
    assert (mean.freedom, mean.is_ratio) == (19, False)
    assert rms.value == pytest.approx(np.sqrt(np.mean((values + 3) ** 2)) - np.sqrt(np.mean(values**2)))


@pytest.mark.parametrize(
    ("values", "duration_ns", "blocks"),
    [
        (800, 1, 32),
        (799, 1, 20),
        (500, 1, 20),
        (499, 1, 0),
        (100, 10 * 10**9, 20),
        (99, 10**12, 0),
        (0, 0, 0),
    ],
)
def test_a_run_is_cut_into_blocks_of_enough_values_or_long_enough(
    values: int, duration_ns: int, blocks: int
) -> None:
    assert block_count(values, duration_ns) == blocks


# Percent points from published tables; R: qt, binom.test.
@pytest.mark.parametrize(
    ("share", "freedom", "expected"), [(0.975, 19, 2.0930), (0.975, 31, 2.0395), (0.9995, 19, 3.8834)]
)
def test_the_quantiles_of_student_s_distribution(share: float, freedom: int, expected: float) -> None:
    assert student_quantile(share, freedom) == pytest.approx(expected, rel=2e-3)


@pytest.mark.parametrize(
    ("hits", "trials", "low", "high"),
    [(0, 10, 0, 0.3085), (10, 10, 0.6915, 1), (7, 20, 0.1539, 0.5922), (0, 0, 0, 1)],
)
def test_the_interval_of_a_share(hits: int, trials: int, low: float, high: float) -> None:
    assert binomial_interval(hits, trials, 0.05) == pytest.approx((low, high), abs=1e-4)


def test_no_event_gives_no_rate() -> None:
    none = Events(np.array([], np.intp), np.array([], np.int64), 1_000, 32)
    assert rate_change(none, none) is None
