"""A trace as a file for ui.perfetto.dev, and for Perfetto's trace processor to be asked about in SQL.

Every executor is a process, every component a track of it: states and services are slices, releases the
time from the nominal to the actual instant, overruns, faults, stops and marks instants with their figures.
Each reconfiguration is a slice from parked to armed, and a flow from the request to it to the next release.
A track `requests` has who asked for what, a track `rules` what the executor's rules decided; a counter below
each component its wake-up latency. A track `values` has a counter for each recorded value, a track `shadows`
one for the largest difference of each output of a shadow.

Timestamps are the records' own, ns of CLOCK_MONOTONIC, which the file declares to be the trace's clock and
relates to CLOCK_REALTIME by the pairs that the bag has.
"""

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from mauve_rt.trace.export.component import ComponentTrack
from mauve_rt.trace.export.output import new_file
from mauve_rt.trace.export.packets import (
    CLOCK_MONOTONIC,
    CLOCK_REALTIME,
    Figure,
    PacketFile,
    Track,
    unicode,
)
from mauve_rt.trace.export.swaps import RequestSlice, find_requests, find_swaps, number_flows
from mauve_rt.trace.progress import Progress, silent
from mauve_rt.trace.reading.architecture import ComponentInfo
from mauve_rt.trace.reading.decisions import explained_decisions
from mauve_rt.trace.reading.trace import Trace, merge_traces

_SNAPSHOT_EVERY_NS = 1_000_000_000
_LATENCY = "wake-up latency"
_EXPLICIT_ORDER = 3  # TrackDescriptor.ChildTracksOrdering
_NS = 1  # CounterDescriptor.Unit


def export_perfetto(
    traces: Mapping[str, Trace], path: Path, *, force: bool = False, progress: Progress = silent
) -> list[str]:
    """Write the traces of executors, by the executors' names, as one Perfetto trace.

    Returns sentences: which topics are left out, because their messages cannot be read.

    Raises:
        TraceError: the file exists already (unless `force`) or cannot be written; perfetto's Python package
            is not installed; the traces are on different monotonic clocks.

    """
    if len(traces) > 1:
        merge_traces(traces)  # or says that they cannot be
    counter = _RecordCounter(traces, progress)
    with new_file(path, force=force) as place, place.open("wb") as stream:
        file = PacketFile(stream)
        _write_clocks(file, traces)
        flow = 1
        for number, (name, trace) in enumerate(traces.items(), start=1):
            flow = _write_executor(file, trace, (number, name), flow, counter)
        counter.tell_end()
    return [problem for trace in traces.values() for problem in trace.values.problems]


def _write_executor(
    file: PacketFile, trace: Trace, who: tuple[int, str], flow: int, counter: "_RecordCounter"
) -> int:
    """Write a process; returns the next free number of a flow."""
    number, name = who
    process = file.add_track(
        process={"pid": number, "process_name": unicode(name)}, child_ordering=_EXPLICIT_ORDER
    )
    swaps = {component: find_swaps(trace, component) for component in trace.components}
    every = [swap for of_component in swaps.values() for swap in of_component]
    requests = find_requests(trace, every)
    flow = number_flows(every, flow)
    for request in requests:
        _write_request(file, process, request)
    _write_decisions(file, process, trace)
    about = {one.name: _description(one) for one in trace.architecture}
    for rank, (component, own) in enumerate(swaps.items(), start=1):
        described = {"description": about[component]} if component in about else {}
        uuid = file.add_track(component, parent=process, sibling_order_rank=rank, **described)
        latency = file.add_track(_LATENCY, parent=uuid, counter={"unit": _NS})
        track = Track(file, uuid, counter=latency)
        ComponentTrack(trace, component, track, own).draw(counter.of(f"{name}: {component}"))
        counter.add(len(trace.of(component)))
    _write_values(file, process, trace, rank=len(swaps) + 1)
    _write_shadows(file, process, trace, rank=len(swaps) + 2)
    return flow


def _write_values(file: PacketFile, process: int, trace: Trace, *, rank: int) -> None:
    """Write a counter for each value on a track `values`; NaN and infinity are left out."""
    found = trace.values.samples
    if not found:
        return
    group = file.add_track("values", parent=process, sibling_order_rank=rank)
    for field, samples in found.items():
        track = Track(file, file.add_track(trace.values.name(field), parent=group, counter={}))
        finite = np.isfinite(samples.values)
        times, values = samples.monotonic_ns[finite].tolist(), samples.values[finite].tolist()
        for time_ns, value in zip(times, values, strict=True):
            track.count(time_ns, value)


def _write_shadows(file: PacketFile, process: int, trace: Trace, *, rank: int) -> None:
    """Write a counter of the largest difference for each number of a shadow, on a track `shadows`."""
    if not trace.shadow_reports:
        return
    group = file.add_track("shadows", parent=process, sibling_order_rank=rank)
    counters: dict[str, Track] = {}
    for one in trace.shadow_reports:
        for output in one.outputs:
            name = f"{one.component} {output.name}"
            if name not in counters:
                counters[name] = Track(file, file.add_track(name, parent=group, counter={}))
            if np.isfinite(output.maximum):
                counters[name].count(one.time_ns, output.maximum)


def _description(one: ComponentInfo) -> str:
    cpus = ", ".join(map(str, one.cpus)) or "any"
    return f"{one.shell}, {one.core}, {one.fsm}; priority {one.priority} {one.policy}, CPU {cpus}"


def _write_request(file: PacketFile, process: int, request: RequestSlice) -> None:
    """Write a slice on a track of its own: requests may overlap. Perfetto shows tracks of one name as one."""
    said = request.message.msg
    figures: dict[str, Figure] = {
        "requested_by": str(said.requested_by),
        "cause": str(said.cause),
        "success": bool(said.success),
        "code": int(said.code),
        "message": str(said.message),
        "request_id": str(said.request_id),
        "revision": int(said.revision),
    }
    track = Track(file, file.add_track("requests", parent=process))
    flows = [swap.flow for swap in request.swaps]
    track.begin(request.begin_ns, str(said.request), "request", figures, flows=flows)
    track.end(request.end_ns)


def _write_decisions(file: PacketFile, process: int, trace: Trace) -> None:
    """Write an instant of each decision of the rules; no track when there is none."""
    found = explained_decisions(trace)
    if not found:
        return
    track = Track(file, file.add_track("rules", parent=process))
    for one in found:
        said = one.traced
        figures: dict[str, Figure] = {"rule": said.rule, "decision": said.decision, "reason": one.reason}
        figures |= {"why": said.why} if said.why else {}
        figures["since_cause_ns"] = said.time_ns - said.cause_ns
        track.instant(said.time_ns, f"{said.rule}: {said.decision}", "decision", figures)


def _write_clocks(file: PacketFile, traces: Mapping[str, Trace]) -> None:
    """Relate the clocks, once a second and never backwards."""
    pairs = np.concatenate([trace.clock_pairs for trace in traces.values()] or [np.empty((0, 2), np.int64)])
    pairs = pairs[np.argsort(pairs[:, 0], kind="stable")]
    next_ns = None
    for monotonic_ns, realtime_ns in pairs.tolist() or [(0, 0)]:
        if next_ns is not None and monotonic_ns < next_ns:
            continue
        next_ns = monotonic_ns + _SNAPSHOT_EVERY_NS
        trace, packet = file.new_packet()
        packet.trusted_packet_sequence_id = file.new_sequence()
        packet.clock_snapshot.primary_trace_clock = CLOCK_MONOTONIC
        packet.clock_snapshot.clocks.add(clock_id=CLOCK_MONOTONIC, timestamp=monotonic_ns)
        if len(pairs):
            packet.clock_snapshot.clocks.add(clock_id=CLOCK_REALTIME, timestamp=realtime_ns)
        file.write(trace)


class _RecordCounter:
    """Tells progress by the records written."""

    def __init__(self, traces: Mapping[str, Trace], progress: Progress) -> None:
        rows = [len(trace.of(component)) for trace in traces.values() for component in trace.components]
        self._all = max(1, sum(rows))
        self._progress = progress
        self._before = 0

    def of(self, what: str) -> Callable[[int], None]:
        """What is told how many records of a component are written."""

        def tell(done: int) -> None:
            self._progress((self._before + done) / self._all, what)

        return tell

    def add(self, records: int) -> None:
        """A component is done."""
        self._before += records

    def tell_end(self) -> None:
        """All is written."""
        self._progress(1, "written")
