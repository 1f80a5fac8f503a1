"""Statistics of a trace per component: wake-up latency, response and execution times, phase error."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from mauve_rt.trace.format.records import Kind, Records
from mauve_rt.trace.progress import Progress, silent
from mauve_rt.trace.reading.pairs import Indices, following, nested
from mauve_rt.trace.reading.trace import Trace

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
    kinds = np.ascontiguousarray(records["kind"])
    (releases,) = np.nonzero(kinds == Kind.RELEASE)
    overruns = records[kinds == Kind.OVERRUN]
    contended = records[kinds == Kind.CONTENDED]
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
        faults=int(np.count_nonzero(kinds == Kind.FAULT)),
        wakeup=distribution(records["b"][releases] - records["a"][releases]),
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
    then, unless = (Kind.WAIT, Kind.OVERRUN), (Kind.RELEASE, Kind.STOP)
    releases, waits = following(records, Kind.RELEASE, then, unless)
    return np.asarray(records["time_ns"][waits] - records["a"][releases], np.int64)


def job_response_times(trace: Trace, component: str) -> dict[tuple[str, str], Values]:
    """Response times of one component by the wait before a job and the wait after it.

    The first job after a start follows no wait: for it, the initial state is named.
    """
    records = trace.of(component)
    releases, waits = following(records, Kind.RELEASE, (Kind.WAIT,), (Kind.RELEASE, Kind.STOP))
    times_ns = np.asarray(records["time_ns"][waits] - records["a"][releases], np.int64)
    befores, afters = records["name"][releases], records["name"][waits]
    return {
        (trace.name(int(before)), trace.name(int(after))): times_ns[(befores == before) & (afters == after)]
        for before in np.unique(befores)
        for after in np.unique(afters[befores == before])
    }


def state_spans(records: Records) -> Spans:
    """Executions of states of one component, in order."""
    return _spans(records, *following(records, Kind.STATE_BEGIN, (Kind.STATE_END,), (Kind.STATE_BEGIN,)))


def service_spans(records: Records) -> Spans:
    """Calls of services by one component, in order; those within others too."""
    return _spans(records, *nested(records, Kind.SERVICE_BEGIN, Kind.SERVICE_END))


def _spans(records: Records, begins: Indices, ends: Indices) -> Spans:
    names, times = records["name"], records["time_ns"]  # views: no record is copied whole
    same = names[begins] == names[ends]
    begins, ends = begins[same], ends[same]
    spans: Spans = np.empty(len(begins), SPAN)
    spans["name"], spans["begin_ns"], spans["end_ns"] = names[begins], times[begins], times[ends]
    return spans


def _lengths(spans: Spans) -> Values:
    lengths: Values = spans["end_ns"] - spans["begin_ns"]
    return lengths


def _releases_of_initial_state(records: Records) -> Values:
    """Actual releases into the initial state, begun first after a start: only these are on the grid."""
    names, actual = records["name"], records["b"]
    _, first = following(records, Kind.START, (Kind.STATE_BEGIN,), (Kind.STOP,))
    if not len(first):
        return np.asarray(actual[records["kind"] == Kind.RELEASE], np.int64)
    releases, begun = following(records, Kind.RELEASE, (Kind.STATE_BEGIN,), (Kind.RELEASE, Kind.STOP))
    return np.asarray(actual[releases[np.isin(names[begun], np.unique(names[first]))]], np.int64)


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
        actual = releases[(releases >= begin) & (releases < end)]
        half = grid.period_ns // 2
        errors.append((actual - grid.epoch_ns - grid.offset_ns + half) % grid.period_ns - half)
    return np.concatenate(errors or [np.empty(0, np.int64)])
