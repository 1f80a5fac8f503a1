"""Statistics of a trace per component: wake-up latency, response and execution times, phase error."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from mauve_rt.trace.records import Kind, Records
from mauve_rt.trace.trace import Trace

Values = npt.NDArray[np.int64]


@dataclass(frozen=True)
class Distribution:
    """Of times in ns. Percentiles are values that occurred: the smallest with that share at or below it."""

    count: int
    min_ns: int
    p50_ns: int
    p99_ns: int
    p999_ns: int
    max_ns: int


class Span(NamedTuple):
    """One execution of a state."""

    name: int
    """Index into Trace.names."""
    begin_ns: int
    end_ns: int


@dataclass(frozen=True, kw_only=True)
class ComponentStatistics:
    """What a component did."""

    component: str
    releases: int
    overruns: int
    skipped: int
    """Instants skipped after overruns."""
    faults: int
    wakeup: Distribution
    """Actual - nominal release."""
    response: Distribution
    """Entry of the next wait - nominal release."""
    phase_error: Distribution
    """Actual release - the nearest instant of the deployment's grid, where the initial state was released."""
    execution: dict[str, Distribution]
    """Per state: from its begin to its end, preemption included."""
    lost_records: int
    """Records known to be missing: when not 0, the counts above are lower bounds."""


def component_statistics(trace: Trace, component: str) -> ComponentStatistics:
    """Statistics of one component. Where records are lost, what spans the gap is left out.

    Raises:
        TraceError: there is no such component in the trace.

    """
    records = trace.of(component)
    releases = records[records["kind"] == Kind.RELEASE]
    overruns = records[records["kind"] == Kind.OVERRUN]
    return ComponentStatistics(
        component=component,
        releases=len(releases),
        overruns=len(overruns),
        skipped=int(overruns["c"].sum()),
        faults=int(np.count_nonzero(records["kind"] == Kind.FAULT)),
        wakeup=distribution(releases["b"] - releases["a"]),
        response=distribution(response_times(records)),
        phase_error=distribution(_phase_errors(trace, component, records)),
        execution=_execution_times(trace, records),
        lost_records=trace.losses[component].lost,
    )


def all_statistics(trace: Trace) -> dict[str, ComponentStatistics]:
    """Statistics of every component of the trace."""
    return {component: component_statistics(trace, component) for component in trace.components}


def distribution(values: Values) -> Distribution:
    """Summarize times in ns."""
    if not len(values):
        return Distribution(0, 0, 0, 0, 0, 0)
    quantiles = np.quantile(values, [0, 0.5, 0.99, 0.999, 1], method="inverted_cdf")
    return Distribution(len(values), *(int(value) for value in quantiles))


def response_times(records: Records) -> Values:
    """Of each release of one component: entry of its next wait - its nominal instant; ns, in order."""
    release, following = _pairs(records, Kind.RELEASE, (Kind.WAIT, Kind.OVERRUN), (Kind.RELEASE, Kind.STOP))
    return np.asarray(following["time_ns"] - release["a"], np.int64)


def state_spans(records: Records) -> list[Span]:
    """Executions of states of one component, in order."""
    begin, end = _pairs(records, Kind.STATE_BEGIN, (Kind.STATE_END,), (Kind.STATE_BEGIN,))
    same = begin["name"] == end["name"]
    columns = (begin["name"][same], begin["time_ns"][same], end["time_ns"][same])
    return [Span(*map(int, row)) for row in zip(*columns, strict=True)]


def _pairs(
    records: Records, first: Kind, then: tuple[Kind, ...], unless: tuple[Kind, ...]
) -> tuple[Records, Records]:
    """Each record of kind `first` with the next of kind `then`, unless `unless` or a gap is in between."""
    (starts,) = np.nonzero(records["kind"] == first)
    (ends,) = np.nonzero(np.isin(records["kind"], then))
    barrier = np.isin(records["kind"], unless)
    barrier[1:] |= np.diff(records["sequence"].astype(np.int64)) != 1
    passed = np.cumsum(barrier)
    found = np.searchsorted(ends, starts)
    starts, found = starts[found < len(ends)], found[found < len(ends)]
    matches = ends[found]
    clear = passed[matches] == passed[starts]
    return records[starts[clear]], records[matches[clear]]


def _releases_of_initial_state(records: Records) -> Records:
    """Releases into the initial state (the one begun first after a start): only these are on the grid."""
    _, first = _pairs(records, Kind.START, (Kind.STATE_BEGIN,), (Kind.STOP,))
    release, begun = _pairs(records, Kind.RELEASE, (Kind.STATE_BEGIN,), (Kind.RELEASE, Kind.STOP))
    return release[np.isin(begun["name"], first["name"])] if len(first) else release


def _execution_times(trace: Trace, records: Records) -> dict[str, Distribution]:
    times: dict[int, list[int]] = {}
    for span in state_spans(records):
        times.setdefault(span.name, []).append(span.end_ns - span.begin_ns)
    return {trace.name(name): distribution(np.array(values, np.int64)) for name, values in times.items()}


def _phase_errors(trace: Trace, component: str, records: Records) -> Values:
    releases = _releases_of_initial_state(records)
    grids = [grid for grid in trace.deployments(component) if grid.period_ns > 0]
    errors = []
    for index, grid in enumerate(grids):
        begin = grid.time_ns if index else np.iinfo(np.int64).min
        end = grids[index + 1].time_ns if index + 1 < len(grids) else np.iinfo(np.int64).max
        actual = releases["b"][(releases["b"] >= begin) & (releases["b"] < end)]
        half = grid.period_ns // 2
        errors.append((actual - grid.epoch_ns - grid.offset_ns + half) % grid.period_ns - half)
    return np.concatenate(errors or [np.empty(0, np.int64)])
