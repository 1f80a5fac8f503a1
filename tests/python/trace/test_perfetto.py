"""Perfetto traces, read back by Perfetto's own classes: tracks, slices, flows, clocks."""

import builtins
import math
import types
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from perfetto.protos.perfetto.trace import perfetto_trace_pb2 as protos
from perfetto_decoding import Decoded, Event
from synthetic_traces import MS, Pose, trace_of, with_values

from mauve_rt.trace import TraceError
from mauve_rt.trace.export.perfetto import export_perfetto
from mauve_rt.trace.format.records import Kind, ReconfigurationPhase
from mauve_rt.trace.reading.facts import Message
from mauve_rt.trace.recording.synthetic import SyntheticSource

EPOCH_NS, PERIOD_NS = 10**15, 1_000_000


def exported(source: SyntheticSource, tmp_path: Path, messages: tuple[Message, ...] = ()) -> Decoded:
    path = tmp_path / "trace.pftrace"
    export_perfetto({"robot_1": trace_of(source, messages)}, path, force=True)
    return Decoded(path)


def started(*components: str) -> SyntheticSource:
    source = SyntheticSource(list(components))
    for component in components:
        source.add(component, Kind.DEPLOYMENT, EPOCH_NS - 50, a=EPOCH_NS, c=PERIOD_NS)
        source.add(component, Kind.START, EPOCH_NS - 40, a=EPOCH_NS)
    return source


def shape(events: list[Event]) -> list[tuple[Any, ...]]:
    return [(event.name, event.depth, event.begin_ns, event.end_ns) for event in events]


def event_message(told_ns: int, *steps: dict[str, Any], **fields: Any) -> Message:
    """A ReconfigurationEvent as a bag yields it."""
    known = {"requested_by": "/boss", "cause": "why not", "message": "done", "request_id": "7", "code": 0}
    known |= {"request": "replace_core a New", "success": True, "revision": 2} | fields
    report = [types.SimpleNamespace(**step) for step in steps]
    msg = types.SimpleNamespace(**known, report=report, __msgtype__="mauve_msgs/msg/ReconfigurationEvent")
    return Message("/robot_1/executor/events", told_ns, told_ns, msg)


def test_one_process_and_its_components(tmp_path: Path) -> None:
    decoded = exported(started("control", "guidance"), tmp_path)
    (process,) = [one for one in decoded.tracks.values() if one.HasField("process")]
    assert process.process.process_name == "robot_1"
    control, guidance = (decoded.tracks[decoded.uuid(name)] for name in ("control", "guidance"))
    assert control.parent_uuid == guidance.parent_uuid == process.uuid
    assert process.child_ordering == protos.TrackDescriptor.EXPLICIT
    assert control.sibling_order_rank < guidance.sibling_order_rank
    latencies = [one for one in decoded.tracks.values() if one.HasField("counter")]
    assert {one.parent_uuid for one in latencies} == {control.uuid, guidance.uuid}
    assert {one.counter.unit for one in latencies} == {protos.CounterDescriptor.UNIT_TIME_NS}


def test_times_are_the_records_on_the_monotonic_clock(tmp_path: Path) -> None:
    source = started("control")
    source.cycle("control", EPOCH_NS, states={"sense": 100, "act": 200}, wait_ns=PERIOD_NS, wakeup_ns=70)
    source.cycle("control", EPOCH_NS + PERIOD_NS, states={"sense": 0}, wait_ns=PERIOD_NS)
    decoded = exported(source, tmp_path)
    second = EPOCH_NS + PERIOD_NS
    events = decoded.of("control")
    assert shape(events) == [
        ("deployment", 0, EPOCH_NS - 50, None),
        ("start", 0, EPOCH_NS - 40, None),
        ("late", 0, EPOCH_NS, EPOCH_NS + 70),
        ("sense", 0, EPOCH_NS + 70, EPOCH_NS + 170),
        ("act", 0, EPOCH_NS + 170, EPOCH_NS + 370),
        ("release", 0, second, None),
        ("sense", 0, second, second),
    ]
    assert events[0].figures == {"epoch_ns": EPOCH_NS, "offset_ns": 0, "period_ns": PERIOD_NS}
    assert [event.counts for event in events if event.category == "release"] == [[70], [0]]
    assert decoded.primary_clocks == {protos.BUILTIN_CLOCK_MONOTONIC}
    (clocks,) = decoded.clocks
    offset_ns = clocks[protos.BUILTIN_CLOCK_REALTIME] - clocks[protos.BUILTIN_CLOCK_MONOTONIC]
    assert offset_ns == source.realtime_offset_ns


def test_what_happens_within_a_state_nests(tmp_path: Path) -> None:
    source = started("a")
    source.add("a", Kind.STATE_BEGIN, EPOCH_NS, name="look")
    source.add("a", Kind.SERVICE_BEGIN, EPOCH_NS + 10, name="map.update")
    source.add("a", Kind.CONTENDED, EPOCH_NS + 90, name="map", a=4711, b=60)
    source.add("a", Kind.SERVICE_END, EPOCH_NS + 100, name="map.update")
    source.add("a", Kind.MARK, EPOCH_NS + 110, name="seen", a=1, b=-2, c=3)
    source.add("a", Kind.STATE_END, EPOCH_NS + 120, name="look")
    source.add("a", Kind.OVERRUN, EPOCH_NS + 130, name="rest", a=EPOCH_NS + 50, b=EPOCH_NS + 130, c=1)
    source.add("a", Kind.FAULT, EPOCH_NS + 140, name="look", a=EPOCH_NS)
    events = exported(source, tmp_path).of("a")[2:]
    assert shape(events) == [
        ("look", 0, EPOCH_NS, EPOCH_NS + 120),
        ("map.update", 1, EPOCH_NS + 10, EPOCH_NS + 100),
        ("waits for map", 2, EPOCH_NS + 30, EPOCH_NS + 90),
        ("seen", 1, EPOCH_NS + 110, None),
        ("overrun", 0, EPOCH_NS + 130, None),
        ("fault", 0, EPOCH_NS + 140, None),
    ]
    assert events[2].figures == {"holder_tid": 4711}
    assert (events[3].category, events[3].figures) == ("mark", {"a": 1, "b": -2, "c": 3})
    assert events[4].figures == {
        "missed_ns": EPOCH_NS + 50,
        "entered_ns": EPOCH_NS + 130,
        "skipped": 1,
        "of": "rest",
        "late_ns": 80,
    }


def swap(source: SyntheticSource, parked_ns: int, *, pending_ns: int, committed: bool = True) -> None:
    source.add("a", Kind.PARKED, parked_ns, name="rest", a=pending_ns)
    for phase, took_ns in ((ReconfigurationPhase.ADOPT, 40), (ReconfigurationPhase.TAKE, 25)):
        source.add("a", Kind.RECONFIGURATION, parked_ns + 90, name="replace_core New", a=phase, b=took_ns)
    source.add("a", Kind.ARMED, parked_ns + 120, name="rest", a=pending_ns, b=int(committed))


def test_a_reconfiguration_flows_from_the_request_to_the_next_release(tmp_path: Path) -> None:
    source = started("a", "b")
    pending = source.cycle("a", EPOCH_NS, states={"act": 10}, wait_ns=PERIOD_NS)
    parked_ns = EPOCH_NS + 5000
    swap(source, parked_ns, pending_ns=pending)
    source.cycle("a", pending, states={"act": 10}, wait_ns=PERIOD_NS, wakeup_ns=30)
    told = event_message(
        pending + 900,
        {"component": "a", "blackout_ns": 120, "prepare_ns": 2000},
        {"component": "b", "blackout_ns": 9, "prepare_ns": 0},
    )
    decoded = exported(source, tmp_path, (told,))
    ((_, flow),) = decoded.flows.items()
    assert [(decoded.tracks[uuid].name, event.name, event.begin_ns) for uuid, _, event in flow] == [
        ("requests", "replace_core a New", parked_ns - 2000),
        ("a", "reconfiguration replace_core New", parked_ns),
        ("a", "late", pending),
    ]
    (request,), (slice_,) = (
        decoded.of("requests"),
        [e for e in decoded.of("a") if e.category == "reconfiguration"],
    )
    assert (request.end_ns, slice_.end_ns) == (pending + 900, parked_ns + 120)
    assert request.figures["requested_by"] == "/boss"
    assert request.figures["success"] is True
    assert slice_.figures == {"committed": True, "adopt_ns": 40, "take_ns": 25, "pending_ns": pending}


def test_a_request_that_changed_nothing_has_no_flow(tmp_path: Path) -> None:
    told = event_message(EPOCH_NS, success=False, code=9, message="no such core")
    decoded = exported(started("a"), tmp_path, (told,))
    assert shape(decoded.of("requests")) == [("replace_core a New", 0, EPOCH_NS, EPOCH_NS)]
    assert not decoded.flows


def test_a_reconfiguration_that_nobody_asked_for_flows_on(tmp_path: Path) -> None:
    source = started("a")
    swap(source, EPOCH_NS - 30, pending_ns=EPOCH_NS, committed=False)
    source.cycle("a", EPOCH_NS, states={"act": 10}, wait_ns=PERIOD_NS)
    swap(source, EPOCH_NS + 100, pending_ns=EPOCH_NS + PERIOD_NS)  # the bag ends here: nowhere to flow
    decoded = exported(source, tmp_path)
    ((_, flow),) = decoded.flows.items()
    assert [event.name for _, _, event in flow] == ["reconfiguration replace_core New", "release"]


def test_executors_are_processes_of_one_trace(tmp_path: Path) -> None:
    traces = {}
    for name in ("robot_1", "robot_2"):
        source = started("control")
        source.cycle("control", EPOCH_NS, states={name: 10}, wait_ns=PERIOD_NS)
        traces[name] = trace_of(source)
    export_perfetto(traces, tmp_path / "both.pftrace")
    decoded = Decoded(tmp_path / "both.pftrace")
    processes = {
        one.process.process_name: one.process.pid for one in decoded.tracks.values() if one.process.pid
    }
    assert len(set(processes.values())) == len(processes) == 2
    for name in processes:
        assert name in [event.name for event in decoded.of("control", parent=name)]


@pytest.mark.parametrize(
    "name",
    ["", "\0", "a\nb", "\udcff", "\u202e*", "<script>", "x" * 100_000, "\N{SMILING FACE WITH SUNGLASSES}"],
)
def test_hostile_names(name: str, tmp_path: Path) -> None:
    source = SyntheticSource([name])
    source._names.append(name)
    source.add(name, Kind.STATE_BEGIN, 1, name=name)
    source.add(name, Kind.MARK, 2, name=name)
    source.add(name, Kind.STATE_END, 3, name=name)
    export_perfetto({name: trace_of(source)}, tmp_path / "x")
    decoded = Decoded(tmp_path / "x")
    (events,) = decoded.events.values()
    assert [event.end_ns for event in events] == [3, None]


KINDS = [int(kind) for kind in Kind] + [99]
INT64 = st.integers(-(2**63), 2**63 - 1)


@given(
    st.lists(
        st.tuples(st.sampled_from(KINDS), st.integers(-5, 50), st.sampled_from("pq"), st.booleans()),
        max_size=60,
    ),
    st.none() | st.tuples(INT64, INT64),
)
def test_slices_are_balanced_whatever_is_lost(
    tmp_path_factory: pytest.TempPathFactory, records: list[Any], damaged: tuple[int, int] | None
) -> None:
    source = SyntheticSource(["a"])
    now_ns = 1000
    for kind, step_ns, name, lost in records:
        now_ns += step_ns  # a clock that goes back must not break the nesting either
        a, b = damaged or (now_ns - 20, now_ns)
        source.add("a", kind, now_ns, name=name, a=a, b=b)
        source.drop("a", int(lost))
    decoded = exported(source, tmp_path_factory.mktemp("balanced"))
    for events in decoded.events.values():
        assert all(event.end_ns is None or event.end_ns >= event.begin_ns for event in events)
    losses = [event for events in decoded.events.values() for event in events if event.name == "records lost"]
    assert sum(event.figures["lost"] for event in losses) == sum(lost for *_, lost in records[:-1])


def test_a_state_cut_by_a_loss_ends_before_it(tmp_path: Path) -> None:
    source = started("a")
    source.add("a", Kind.STATE_BEGIN, EPOCH_NS, name="look")
    source.add("a", Kind.MARK, EPOCH_NS + 10, name="seen")
    source.drop("a", 3)
    source.add("a", Kind.STATE_END, EPOCH_NS + 900, name="look")
    events = exported(source, tmp_path).of("a")[2:]
    assert shape(events) == [
        ("look", 0, EPOCH_NS, EPOCH_NS + 10),
        ("seen", 1, EPOCH_NS + 10, None),
        ("records lost", 0, EPOCH_NS + 900, None),
    ]


def test_nothing_half_written_stays(tmp_path: Path) -> None:
    source = started("a")
    trace = trace_of(source)
    path = tmp_path / "trace.pftrace"

    def interrupt(_done: float, _what: str) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        export_perfetto({"x": trace}, path, progress=interrupt)
    assert list(tmp_path.iterdir()) == []
    path.write_text("mine", encoding="utf-8")
    with pytest.raises(TraceError, match=r"exists already; .*--force"):
        export_perfetto({"x": trace}, path)
    assert path.read_text(encoding="utf-8") == "mine"
    with pytest.raises(TraceError, match="a folder of this name exists"):
        export_perfetto({"x": trace}, tmp_path, force=True)
    with pytest.raises(TraceError, match=r"cannot be written .*--out"):
        export_perfetto({"x": trace}, tmp_path / "nowhere" / "x")
    done: list[float] = []
    export_perfetto({"x": trace}, path, force=True, progress=lambda share, _: done.append(share))
    assert done == sorted(done)
    assert done[-1] == 1.0
    assert [one.name for one in tmp_path.iterdir()] == [path.name]


def test_without_the_package_the_remedy_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    real = builtins.__import__

    def refuse(name: str, *args: Any, **kwargs: Any) -> Any:
        if name.startswith("perfetto"):
            raise ModuleNotFoundError(f"No module named '{name}'")
        return real(name, *args, **kwargs)

    monkeypatch.setattr(builtins, "__import__", refuse)
    with pytest.raises(TraceError, match="pip install --upgrade perfetto"):
        export_perfetto({"x": trace_of(started("a"))}, tmp_path / "x")
    assert list(tmp_path.iterdir()) == []


def test_each_value_is_a_counter_of_a_group_of_their_own(tmp_path: Path) -> None:
    poses = [(MS, Pose(1, 0.25)), (2 * MS, Pose(math.nan, math.inf)), (3 * MS, Pose(-1.5, 2))]
    trace = with_values(
        trace_of(started("control")), {"/robot_1/executor/values/pose": poses, "/beat": [(MS, Pose(7, 8))]}
    )
    path = tmp_path / "trace.pftrace"
    assert export_perfetto({"robot_1": trace}, path) == []
    decoded = Decoded(path)
    group = decoded.tracks[decoded.uuid("values", parent="robot_1")]
    assert group.sibling_order_rank > decoded.tracks[decoded.uuid("control")].sibling_order_rank
    counted = {
        decoded.tracks[uuid].name: found
        for uuid, found in decoded.counted.items()
        if decoded.tracks[uuid].parent_uuid == group.uuid
    }
    assert counted == {
        "pose.x": [(MS, 1.0), (3 * MS, -1.5)],
        "pose.y": [(MS, 0.25), (3 * MS, 2.0)],
        "/beat.x": [(MS, 7.0)],
        "/beat.y": [(MS, 8.0)],
    }


def test_a_trace_without_values_has_no_group_for_them(tmp_path: Path) -> None:
    assert "values" not in {track.name for track in exported(started("control"), tmp_path).tracks.values()}


def test_a_topic_that_cannot_be_read_is_left_out_and_reported(tmp_path: Path) -> None:
    trace = with_values(trace_of(started("a")), {"/bad": [(MS, Pose(1, 2))], "/beat": [(MS, Pose(7, 8))]})
    source = trace.message_source

    def messages(topics: tuple[str, ...]) -> Iterator[Message]:
        if "/bad" in topics:
            raise TraceError("no whole message")
        return source(topics)

    path = tmp_path / "trace.pftrace"
    told = export_perfetto({"robot_1": replace(trace, message_source=messages)}, path)
    assert told == ["/bad is left out: no whole message"]
    decoded = Decoded(path)
    assert decoded.counted[decoded.uuid("/beat.x")] == [(MS, 7.0)]
