"""Timing of two runs: percentiles of each component that both have, and how often it was late."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from mauve_rt.trace.format.records import Kind, Records
from mauve_rt.trace.reading.reconfigurations import Reconfiguration
from mauve_rt.trace.reading.trace import Trace
from mauve_rt.trace.report.cycles import UNKNOWN, releases_of, slices_by_state
from mauve_rt.trace.report.runs.noise import (
    Comparable,
    Events,
    Judged,
    Values,
    block_count,
    percentile_changes,
    rate_change,
)

TOO_SHORT = "too short to tell"
ONE_VALUE = "a single value"
NONE = "none"
_STATISTICS = (("p50", 0.5), ("p99", 0.99))


@dataclass(frozen=True)
class Figure:
    """One figure of both runs."""

    subject: str
    """The component; or topic and field."""
    measure: str
    statistic: str
    """p50, p99, max; count; mean, rms."""
    a: float
    """In ns; a count; or in the unit of the field."""
    b: float
    is_time: bool = False
    change: Comparable | None = None
    remark: str = ""
    """Why the figure has no interval."""
    judged: Judged | None = None

    @property
    def name(self) -> str:
        """Measure and statistic."""
        return self.measure if self.statistic == "count" else f"{self.measure} {self.statistic}"

    @property
    def differs(self) -> bool:
        """Return whether the difference is larger than the noise."""
        return self.judged is not None and self.judged.differs


class Series(NamedTuple):
    """Values of one measure of a component, by time; ns."""

    begin_ns: Values
    values: Values

    @property
    def blocks(self) -> int:
        """Into how many blocks it is cut; 0: too short."""
        return block_count(len(self.values), int(np.ptp(self.begin_ns)) if len(self.begin_ns) else 0)


@dataclass(frozen=True)
class ComponentRun:
    """What a component did in one run."""

    series: dict[str, Series]
    """Per measure: wake-up latency, response time, execution of each state."""
    releases: int
    counts: dict[str, Events]
    """Per count: overruns, skipped instants, missed releases, faults."""

    @property
    def is_simulated(self) -> bool:
        """Return whether each wake-up came exactly on time, as only simulated time has it."""
        wakeups = self.series["wake-up latency"].values
        return bool(len(wakeups)) and not wakeups.any()


def component_run(trace: Trace, component: str, measured: Sequence[Reconfiguration]) -> ComponentRun:
    """Measure a component; `measured` are all reconfigurations of the trace."""
    records = trace.of(component)
    releases = releases_of(records)
    begin_ns = np.asarray(releases["begin_ns"], np.int64)
    response = np.asarray(releases["response_ns"], np.int64)
    known = response != UNKNOWN
    series = {
        "wake-up latency": Series(begin_ns, np.asarray(releases["wakeup_ns"], np.int64)),
        "response time": Series(begin_ns[known], response[known]),
    }
    for state, slices in slices_by_state(trace, component).items():
        extent = np.asarray(slices["extent_ns"], np.int64)
        series[f"execution of {state}"] = Series(np.asarray(slices["begin_ns"], np.int64), extent)
    overruns, faults = _events(records, Kind.OVERRUN), _events(records, Kind.FAULT)
    missed = [one for one in measured if one.component == component and one.missed_releases]
    missed_at = np.searchsorted(begin_ns, np.array([one.parked_ns for one in missed], np.int64))
    sizes = np.array([one.missed_releases for one in missed], np.int64)
    blocks = series["wake-up latency"].blocks
    found = {
        "overruns": (overruns[0], np.ones(len(overruns[0]), np.int64)),
        "skipped instants": (overruns[0], np.asarray(overruns[1]["c"], np.int64)),
        "missed releases": (missed_at, sizes),
        "faults": (faults[0], np.ones(len(faults[0]), np.int64)),
    }
    last = max(len(releases) - 1, 0)
    counts = {
        name: Events(np.clip(at, 0, last), size, len(releases), blocks) for name, (at, size) in found.items()
    }
    return ComponentRun(series, len(releases), counts)


def timing_figures(component: str, a: ComponentRun, b: ComponentRun) -> Iterator[Figure]:
    """Yield the figures of a component, not judged yet."""
    yield Figure(component, "releases", "count", a.releases, b.releases, remark="depends on the run's length")
    for measure, of_a in a.series.items():
        of_b = b.series.get(measure)
        if of_b is not None and len(of_a.values) and len(of_b.values):
            yield from _distribution(component, measure, of_a, of_b)
    for count, events in a.counts.items():
        other = b.counts[count]
        change = rate_change(events, other)
        remark = NONE if events.total + other.total == 0 else "" if change else TOO_SHORT
        totals = (events.total, other.total)
        yield Figure(component, count, "count", *totals, change=change, remark=remark)


def only_in(a: ComponentRun, b: ComponentRun) -> list[str]:
    """Return the measures that `a` has and `b` lacks."""
    return [name for name in a.series if name not in b.series]


def _distribution(component: str, measure: str, a: Series, b: Series) -> Iterator[Figure]:
    blocks = (a.blocks, b.blocks)
    shares = [share for _, share in _STATISTICS]
    changes = percentile_changes(a.values, b.values, blocks, shares) if all(blocks) else [None] * len(shares)
    exact = [np.quantile(one.values, shares, method="inverted_cdf") for one in (a, b)]
    for index, (statistic, _) in enumerate(_STATISTICS):
        of_a, of_b = (int(one[index]) for one in exact)
        change = changes[index]
        remark = "" if change else TOO_SHORT
        yield Figure(component, measure, statistic, of_a, of_b, is_time=True, change=change, remark=remark)
    if not measure.startswith("execution"):
        largest = (int(a.values.max()), int(b.values.max()))
        yield Figure(component, measure, "max", *largest, is_time=True, remark=ONE_VALUE)


def _events(records: Records, kind: Kind) -> tuple[npt.NDArray[np.intp], Records]:
    """Number of the release that each record of a kind belongs to, and these records."""
    kinds = np.ascontiguousarray(records["kind"])
    of_kind = kinds == kind
    return np.cumsum(kinds == Kind.RELEASE)[of_kind] - 1, records[of_kind]
