"""Reading a bag back: what is in it, what is missing from it, and what is not a bag with a trace."""

import shutil
from pathlib import Path
from typing import get_args

import pytest
from synthetic_traces import FlushedByHand

import mauve_rt.trace
import mauve_rt.trace.reading.typed_records as typed
from mauve_rt.trace import TraceError
from mauve_rt.trace.bag.writer import BagWriter
from mauve_rt.trace.format.records import Kind, ReconfigurationPhase
from mauve_rt.trace.reading.facts import Deployment, Loss
from mauve_rt.trace.reading.reader import open_trace
from mauve_rt.trace.reading.trace import Trace, merge_traces
from mauve_rt.trace.recording.recorder import Recorder
from mauve_rt.trace.recording.synthetic import SyntheticSource


@pytest.fixture(autouse=True)
def installed_messages(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    share = tmp_path / "prefix" / "share"
    shutil.copytree(Path(__file__).parents[3] / "mauve_msgs" / "msg", share / "mauve_msgs" / "msg")
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path / "prefix"))


def record(source: SyntheticSource, directory: Path) -> Trace:
    recorder = Recorder(source, directory, node_name="/robot/executor")
    recorder.start()
    recorder.stop()
    return open_trace(directory)


def test_a_last_file_that_a_kill_left_empty_is_passed_over(tmp_path: Path) -> None:
    source = SyntheticSource(["a"])
    source.add("a", Kind.MARK, 7, name="hello", a=1, b=-2, c=3)
    record(source, tmp_path / "bag")
    (tmp_path / "bag" / "bag_1.mcap").touch()
    assert len(open_trace(tmp_path / "bag").of("a")) == 1
    (tmp_path / "bag" / "bag_0.mcap").unlink()
    with pytest.raises(TraceError, match="not an MCAP file"):
        open_trace(tmp_path / "bag")


def test_a_bag_moved_elsewhere_needs_nothing_installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    source = SyntheticSource(["a"])
    source.add("a", Kind.MARK, 7, name="hello", a=1, b=-2, c=3)
    record(source, tmp_path / "bag")
    (tmp_path / "bag" / "metadata.yaml").unlink()
    monkeypatch.setenv("AMENT_PREFIX_PATH", "")
    (row,) = open_trace(shutil.move(tmp_path / "bag", tmp_path / "else")).of("a", Kind.MARK)
    assert [int(row[key]) for key in ("time_ns", "a", "b", "c")] == [7, 1, -2, 3]


def test_deployments_tell_the_grid_in_force(tmp_path: Path):
    source = SyntheticSource(["a"])
    source.add("a", Kind.DEPLOYMENT, 10, a=1000, b=5, c=100)
    source.add("a", Kind.DEPLOYMENT, 50_000, a=60_000, b=0, c=0)
    trace = record(source, tmp_path / "bag")
    first, second = trace.deployments("a")
    assert first == Deployment(10, 1000, 5, 100)
    assert [trace.deployment_at("a", time) for time in (0, 10, 49_999, 50_000)] == [
        first,
        first,
        first,
        second,
    ]
    assert [first.phase_ns(instant) for instant in (1005, 1054, 1055, 1104, 905)] == [0, 49, -50, -1, 0]
    assert second.phase_ns(123) == 0


def test_loss_is_known_from_sequences_and_counters(tmp_path: Path):
    source = SyntheticSource(["whole", "gap", "tail"])
    for component in source.components:
        source.add(component, Kind.MARK, 1)
    source.drop("gap", 3)
    source.drop("tail", 2)
    for component in ("whole", "gap"):
        source.add(component, Kind.MARK, 2)
    trace = record(source, tmp_path / "bag")
    assert trace.losses == {
        "whole": Loss(written=2, received=2, dropped=0, gaps=0),
        "gap": Loss(written=5, received=2, dropped=3, gaps=3),
        "tail": Loss(written=3, received=1, dropped=2, gaps=0),
    }
    assert trace.lost == 5


def test_an_unknown_component_is_named_with_the_known_ones(tmp_path: Path):
    trace = record(SyntheticSource(["a", "b"]), tmp_path / "bag")
    with pytest.raises(TraceError, match="component 'c': not in the trace, which has a, b"):
        trace.of("c")


def test_robots_merge_on_one_clock(tmp_path: Path):
    traces = {}
    for index, robot in enumerate(("robot_1", "robot_2")):
        source = SyntheticSource(["control"])
        source.add("control", Kind.STATE_BEGIN, 10 + index, name=f"only_{robot}")
        source.add("control", Kind.STATE_END, 20 + index, name="both")
        traces[robot] = record(source, tmp_path / robot)
    merged = merge_traces(traces)
    assert merged.components == ("robot_1/control", "robot_2/control")
    words = [[merged.name(row["name"]) for row in merged.of(component)] for component in merged.components]
    assert words == [["only_robot_1", "both"], ["only_robot_2", "both"]]
    assert len(merged.clock_pairs) == sum(len(trace.clock_pairs) for trace in traces.values())


def test_robots_of_different_clocks_do_not_merge(tmp_path: Path):
    first = record(SyntheticSource(["a"]), tmp_path / "bag_1")
    second = record(SyntheticSource(["a"], realtime_offset_ns=0), tmp_path / "bag_2")
    with pytest.raises(TraceError, match="different monotonic clocks"):
        merge_traces({"x": first, "y": second})


def test_what_is_no_bag_is_refused(tmp_path: Path):
    with pytest.raises(TraceError, match="not there"):
        open_trace(tmp_path / "nothing")
    with pytest.raises(TraceError, match=r"no \.mcap file in it"):
        open_trace(tmp_path)
    (tmp_path / "x.mcap").write_bytes(b"something else entirely, and long enough for a footer")
    with pytest.raises(TraceError, match=r"x\.mcap: not an MCAP file"):
        open_trace(tmp_path / "x.mcap")
    (tmp_path / "y.mcap").write_bytes(b"\x89MCAP0\r\n")
    with pytest.raises(TraceError, match=r"y\.mcap: the MCAP header cannot be read"):
        open_trace(tmp_path / "y.mcap")


def test_a_bag_without_a_trace_is_refused(tmp_path: Path):
    BagWriter(tmp_path / "bag").close()
    with pytest.raises(TraceError, match="found no topic of type mauve_msgs/msg/TraceBatch"):
        open_trace(tmp_path / "bag")


def test_a_bag_cut_off_anywhere_gives_what_is_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("mauve_rt.trace.bag.mcap_scan._PAUSE_S", 0)
    source = SyntheticSource(["a"])
    recorded = FlushedByHand(source, tmp_path / "bag", node_name="/e")
    for index in range(20):
        source.add("a", Kind.MARK, index)
        recorded.flush()
    recorded.close()
    (file,) = (tmp_path / "bag").glob("*.mcap")
    whole = file.read_bytes()
    data_end = mauve_rt.trace.open(file).files[0].whole_bytes + 13  # behind the DataEnd record
    seen = set()
    for size in range(100, len(whole), 41):
        file.write_bytes(whole[:size])
        try:
            trace = mauve_rt.trace.open(file)
        except TraceError:  # cut off before the first batch
            assert not seen
            continue
        rows = trace.of("a") if trace.records else ()
        assert [int(row["sequence"]) for row in rows] == list(range(len(rows)))
        (told,) = trace.files
        assert told.whole_bytes <= size
        assert bool(told.damage) == (size < data_end)
        seen.add(len(rows))
    assert 20 in seen
    assert len(seen) > 2


def test_records_come_typed_and_as_data_frames(tmp_path: Path):
    source = SyntheticSource(["a", "b"])
    source.add("a", Kind.DEPLOYMENT, 5, a=1000, b=7, c=100)
    source.add("a", Kind.START, 6, a=1007)
    source.cycle("a", 1007, states={"work": 30}, wait_ns=100, wakeup_ns=2)
    source.add("b", Kind.MARK, 1010, name="word", a=1, b=2, c=3)
    source.add("a", Kind.OVERRUN, 1300, name="wait", a=1107, b=1300, c=2)
    source.add("b", Kind.ARMED, 1400, name="wait", a=1500, b=1)
    source.add("b", Kind.RECONFIGURATION, 1401, name="core", a=2, b=12)
    trace = record(source, tmp_path / "bag")
    assert list(trace.typed()) == [
        typed.Deployed(5, "a", Deployment(5, 1000, 7, 100)),
        typed.Started(6, "a", 1007),
        typed.Released(1009, "a", "wait", 1007, 1009),
        typed.StateBegun(1009, "a", "work"),
        typed.Marked(1010, "b", "word", 1, 2, 3),
        typed.StateEnded(1039, "a", "work"),
        typed.Waited(1039, "a", "wait", 1107),
        typed.Overrun(1300, "a", "wait", 1107, 1300, 2),
        typed.Armed(1400, "b", "wait", 1500, True),
        typed.Reconfigured(1401, "b", "core", ReconfigurationPhase.TAKE, 12),
    ]
    assert {one.component for one in trace.typed("b")} == {"b"}
    (released,) = trace.frames.releases.to_dict("records")
    assert (released["component"], released["wakeup_ns"], released["response_ns"]) == ("a", 2, 32)
    (state,) = trace.frames.states.to_dict("records")
    assert (state["state"], state["execution_ns"]) == ("work", 30)


def test_every_kind_has_its_type(tmp_path: Path):
    share = tmp_path / "prefix" / "share" / "mauve_msgs" / "msg" / "TraceRecord.msg"
    share.write_text("uint16 HEARTBEAT=99  # name: beat\n" + share.read_text())
    source = SyntheticSource(["a"])
    of_components = sorted(set(Kind) - {Kind.DECISION})
    for kind in [*of_components, 99]:
        source.add("a", kind, int(kind), a=1)
    found = list(record(source, tmp_path / "bag").typed())
    assert len({type(one) for one in found}) == len(of_components) + 1
    assert set(get_args(typed.Record)) == {type(one) for one in found}


def test_records_of_another_version_are_refused_with_both_layouts(tmp_path: Path):
    share = tmp_path / "prefix" / "share" / "mauve_msgs" / "msg" / "TraceRecord.msg"
    share.write_text(share.read_text().replace("uint32 name", "uint64 name"))
    with pytest.raises(
        TraceError, match=r"topic /robot/executor/trace/batches was written by another version"
    ):
        record(SyntheticSource(["a"]), tmp_path / "bag")


def test_files_of_several_versions_are_refused(tmp_path: Path):
    record(SyntheticSource(["a"]), tmp_path / "bag")
    share = tmp_path / "prefix" / "share" / "mauve_msgs" / "msg" / "TraceRecord.msg"
    share.write_text(share.read_text() + "uint8 more\n")
    with pytest.raises(TraceError):
        record(SyntheticSource(["a"]), tmp_path / "other")
    shutil.move(tmp_path / "other" / "other_0.mcap", tmp_path / "bag" / "bag_1.mcap")
    with pytest.raises(
        TraceError, match=r"bag_1\.mcap: .* written by another version .* found .* uint8 more"
    ):
        mauve_rt.trace.open(tmp_path / "bag")
