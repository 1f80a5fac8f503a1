"""Statistics of a trace per component: wake-up latency, response and execution times, phase error."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from mauve_rt.trace.pairs import following, nested
from mauve_rt.trace.progress import Progress, silent
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


SPAN = np.dtype([("name", "<u4"), ("begin_ns", "<i8"), ("end_ns", "<i8")])
"""One execution of a state, or one call of a service; `name` is an index into Trace.names."""

Spans = npt.NDArray[Any]
"""A structured array of dtype SPAN."""


@dataclass(frozen=True, kw_only=True)
class ComponentStatistics:
    """What a component did."""

    component: str
    period_ns: int
    """g as last deployed; 0: sporadic, or not told."""
    duration_ns: int
    """From the first record to the last."""
    load: float
    """Share of the duration that passed in execution states, preemption included; 0 to 1."""
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
    services: dict[str, Distribution]
    """Per resource.service: from the call's begin to its end."""
    contention: dict[str, Distribution]
    """Per resource: waiting for a lock that another thread held."""
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
    contended = records[records["kind"] == Kind.CONTENDED]
    grids = trace.deployments(component)
    states = state_spans(records)
    duration_ns = int(np.ptp(records["time_ns"])) if len(records) else 0
    return ComponentStatistics(
        component=component,
        period_ns=grids[-1].period_ns if grids else 0,
        duration_ns=duration_ns,
        load=int(_lengths(states).sum()) / duration_ns if duration_ns else 0.0,
        releases=len(releases),
        overruns=len(overruns),
        skipped=int(overruns["c"].sum()),
        faults=int(np.count_nonzero(records["kind"] == Kind.FAULT)),
        wakeup=distribution(releases["b"] - releases["a"]),
        response=distribution(response_times(records)),
        phase_error=distribution(_phase_errors(trace, component, records)),
        execution=_by_name(trace, states["name"], _lengths(states)),
        services=_by_name(trace, (calls := service_spans(records))["name"], _lengths(calls)),
        contention=_by_name(trace, contended["name"], contended["b"]),
        lost_records=trace.losses[component].lost,
    )


def all_statistics(trace: Trace, *, progress: Progress = silent) -> dict[str, ComponentStatistics]:
    """Statistics of every component of the trace."""
    found: dict[str, ComponentStatistics] = {}
    for index, component in enumerate(trace.components):
        progress(index / len(trace.components), "measuring")
        found[component] = component_statistics(trace, component)
    return found


def distribution(values: Values) -> Distribution:
    """Summarize times in ns."""
    if not len(values):
        return Distribution(0, 0, 0, 0, 0, 0)
    quantiles = np.quantile(values, [0, 0.5, 0.99, 0.999, 1], method="inverted_cdf")
    return Distribution(len(values), *(int(value) for value in quantiles))


def response_times(records: Records) -> Values:
    """Of each release of one component: entry of its next wait - its nominal instant; ns, in order."""
    release, following = pairs(records, Kind.RELEASE, (Kind.WAIT, Kind.OVERRUN), (Kind.RELEASE, Kind.STOP))
    return np.asarray(following["time_ns"] - release["a"], np.int64)


def state_spans(records: Records) -> Spans:
    """Executions of states of one component, in order."""
    return _spans(*pairs(records, Kind.STATE_BEGIN, (Kind.STATE_END,), (Kind.STATE_BEGIN,)))


def service_spans(records: Records) -> Spans:
    """Calls of services by one component, in order; those within others too."""
    begins, ends = nested(records, Kind.SERVICE_BEGIN, Kind.SERVICE_END)
    return _spans(records[begins], records[ends])


def _spans(begin: Records, end: Records) -> Spans:
    same = begin["name"] == end["name"]
    spans: Spans = np.empty(np.count_nonzero(same), SPAN)
    spans["name"], spans["begin_ns"] = begin["name"][same], begin["time_ns"][same]
    spans["end_ns"] = end["time_ns"][same]
    return spans


def _lengths(spans: Spans) -> Values:
    lengths: Values = spans["end_ns"] - spans["begin_ns"]
    return lengths


def pairs(
    records: Records, first: Kind, then: tuple[Kind, ...], unless: tuple[Kind, ...]
) -> tuple[Records, Records]:
    """Each record of kind `first` with the next of kind `then`, unless `unless` or a gap is in between."""
    starts, matches = following(records, first, then, unless)
    return records[starts], records[matches]


def _releases_of_initial_state(records: Records) -> Records:
    """Releases into the initial state (the one begun first after a start): only these are on the grid."""
    _, first = pairs(records, Kind.START, (Kind.STATE_BEGIN,), (Kind.STOP,))
    release, begun = pairs(records, Kind.RELEASE, (Kind.STATE_BEGIN,), (Kind.RELEASE, Kind.STOP))
    return release[np.isin(begun["name"], first["name"])] if len(first) else release


def _by_name(trace: Trace, names: npt.NDArray[np.uint32], values: Values) -> dict[str, Distribution]:
    """Distributions by the word that each value's name stands for, in the order in which they first came."""
    present, first = np.unique(names, return_index=True)
    return {trace.name(int(name)): distribution(values[names == name]) for name in present[np.argsort(first)]}


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
