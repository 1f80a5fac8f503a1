"""Everything the parts of a report tell about one trace, computed once."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from mauve_rt.trace.format.records import DEADLINE_MISSED, Kind
from mauve_rt.trace.progress import Progress, silent
from mauve_rt.trace.reading.decisions import ExplainedDecision, explained_decisions
from mauve_rt.trace.reading.log_lines import LOG_TYPE, LogLine, log_lines
from mauve_rt.trace.reading.reconfigurations import Reconfiguration, reconfigurations
from mauve_rt.trace.reading.statistics import ComponentStatistics, component_statistics
from mauve_rt.trace.reading.trace import Trace
from mauve_rt.trace.reading.violations import VIOLATION_TYPE, Violation, violations
from mauve_rt.trace.report.cycles import Array, releases_of, slices_by_state
from mauve_rt.trace.report.requests import RequestTold, join_requests


class Swap(NamedTuple):
    """A reconfiguration as measured, and as asked for."""

    measured: Reconfiguration
    request: RequestTold | None
    changed_ns: int
    """When adopt and take were over, by the first record after them; the park's time without one."""


class Fault(NamedTuple):
    """A fault of a component. Without a fallback core it is parked FAULTED from then on."""

    component: str
    state: str
    time_ns: int
    reason: str = ""
    """What was raised, in one line; empty where the bag does not tell."""
    takeover: Reconfiguration | None = None
    """Of its fallback core."""


class DeadlineMiss(NamedTuple):
    """A deadline that passed, in a schedule that an analysis wrote."""

    component: str
    time_ns: int
    late_ns: int


@dataclass(frozen=True)
class Analysis:
    """A trace and what is known about it."""

    trace: Trace
    statistics: dict[str, ComponentStatistics]
    releases: dict[str, Array]
    slices: dict[str, dict[str, Array]]
    """Per component and state."""
    swaps: list[Swap]
    faults: list[Fault]
    begin_ns: int
    """The first record of all."""
    end_ns: int
    zero_ns: int
    """What the page's clock counts from."""
    decisions: list[ExplainedDecision] = field(default_factory=list)
    """Of the executor's rules, by time."""
    misses: list[DeadlineMiss] = field(default_factory=list)
    """Marked as such: what runs marks overruns."""
    violations: list[Violation] = field(default_factory=list)
    """Jobs above their bound, by time."""
    log: list[LogLine] = field(default_factory=list)
    """What components wrote, by time."""

    @property
    def duration_ns(self) -> int:
        """From the first to the last record."""
        return self.end_ns - self.begin_ns

    @property
    def records(self) -> int:
        """How many records are in the trace."""
        return sum(map(len, self.trace.records.values()))

    def period_ns(self, component: str) -> int:
        """Period g as last deployed; 0 of a sporadic component, and where the trace does not tell."""
        return self.statistics[component].period_ns

    def sporadic(self, component: str) -> bool:
        """Tell whether it was deployed without a grid."""
        grids = self.trace.deployments(component)
        return bool(grids) and grids[-1].period_ns == 0


def analyse(
    trace: Trace,
    *,
    events: Iterable[Any] = (),
    zero_ns: int | None = None,
    states: Iterable[Any] = (),
    progress: Progress = silent,
) -> Analysis:
    """Compute it all.

    Args:
        trace: the trace.
        events: messages of type ReconfigurationEvent, by time.
        states: messages of type ArchitectureState, by time; looked at only when there was a fault.
        zero_ns: what the page's clock counts from; the first record when not given.
        progress: told what is being done.
    """
    statistics, releases, slices = {}, {}, {}
    for index, component in enumerate(trace.components):
        progress(index / len(trace.components), "measuring")
        statistics[component] = component_statistics(trace, component)
        releases[component] = releases_of(trace.of(component))
        slices[component] = slices_by_state(trace, component)
    measured = reconfigurations(trace)
    requests = join_requests(measured, events)
    begin_ns, end_ns = trace.span_ns
    return Analysis(
        trace=trace,
        statistics=statistics,
        releases=releases,
        slices=slices,
        swaps=[Swap(*one) for one in zip(measured, requests, _changed_ns(trace, measured), strict=True)],
        faults=_faults(trace, measured, states),
        begin_ns=begin_ns,
        end_ns=end_ns,
        zero_ns=begin_ns if zero_ns is None else zero_ns,
        decisions=explained_decisions(trace),
        misses=_misses(trace),
        violations=violations(trace.messages(VIOLATION_TYPE), trace.components),
        log=log_lines(trace.messages(LOG_TYPE), trace.components),
    )


def _changed_ns(trace: Trace, measured: list[Reconfiguration]) -> list[int]:
    times = {
        component: trace.of(component, Kind.RECONFIGURATION)["time_ns"]
        for component in {one.component for one in measured}
    }
    found = []
    for one in measured:
        of_component = times[one.component]
        at = int(np.searchsorted(of_component, one.parked_ns))
        told = at < len(of_component) and of_component[at] <= one.armed_ns
        found.append(int(of_component[at]) if told else one.parked_ns)
    return found


def _faults(trace: Trace, measured: Iterable[Reconfiguration], states: Iterable[Any]) -> list[Fault]:
    takeovers = {(one.component, one.parked_ns): one for one in measured if one.after_fault}
    found = [
        Fault(component, trace.name(int(row["name"])), time_ns, takeover=takeovers.get((component, time_ns)))
        for component in trace.components
        for row in np.atleast_1d(trace.of(component, Kind.FAULT))
        for time_ns in [int(row["time_ns"])]
    ]
    return sorted(_with_reasons(found, states) if found else [], key=lambda fault: fault.time_ns)


def _with_reasons(faults: Iterable[Fault], states: Iterable[Any]) -> Iterator[Fault]:
    """Faults with what the first state of the executor after them says.

    Components of merged traces are named <bag>/<component>; the state's topic has the name of the bag.
    """
    told = [(state, part) for state in states for part in state.msg.components if part.fault]
    for fault in faults:
        owner, _, name = fault.component.rpartition("/")
        reasons = (
            part.fault
            for state, part in told
            if part.name == name and state.monotonic_ns >= fault.time_ns
            if not owner or f"/{owner}/" in state.topic
        )
        yield fault._replace(reason=next(reasons, "").partition("\n")[0].partition(" (in state ")[0])


def _misses(trace: Trace) -> list[DeadlineMiss]:
    found = [
        DeadlineMiss(component, int(row["time_ns"]), int(row["a"]))
        for component in trace.components
        for row in np.atleast_1d(trace.of(component, Kind.MARK))
        if trace.name(int(row["name"])) == DEADLINE_MISSED
    ]
    return sorted(found, key=lambda miss: miss.time_ns)
