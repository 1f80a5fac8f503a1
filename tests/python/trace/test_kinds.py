"""The table of record kinds: told once, in each bag, and held to the kernel."""

import re
import shutil
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest
from perfetto_decoding import Decoded
from synthetic_traces import record, trace_of

import mauve_rt.trace
from mauve_rt.trace.export.csv_files import export_csv
from mauve_rt.trace.export.perfetto import export_perfetto
from mauve_rt.trace.format.kinds import RecordKind, kinds_known, kinds_told
from mauve_rt.trace.format.records import Kind
from mauve_rt.trace.reading import frames
from mauve_rt.trace.reading.trace import Trace, merge_traces
from mauve_rt.trace.reading.typed_records import Told
from mauve_rt.trace.recording.synthetic import SyntheticSource

ROOT = next(folder for folder in Path(__file__).parents if (folder / "mauve_msgs").is_dir())
TABLE = ROOT / "mauve_msgs" / "msg" / "TraceRecord.msg"
KERNEL = ROOT / "mauve_rt" / "kernel" / "include" / "mauve_rt" / "base" / "trace.hpp"
HEARTBEAT = 99


@pytest.fixture
def later(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Trace:
    """A trace of a version of mauve_rt that has one more kind."""
    messages = tmp_path / "prefix" / "share" / "mauve_msgs" / "msg"
    shutil.copytree(TABLE.parent, messages)
    new = f"uint16 HEARTBEAT={HEARTBEAT}  # name: pump, b: rate_mhz (beats), c: instant_ns\n"
    (messages / "TraceRecord.msg").write_text(new + TABLE.read_text(encoding="utf-8"), encoding="utf-8")
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path / "prefix"))
    source = SyntheticSource(["a", "b"])
    source.add("a", Kind.MARK, 1, name="word")
    source.add("a", HEARTBEAT, 2, name="left", a=-1, b=1200, c=7)
    source.add("b", HEARTBEAT, 3, name="right", b=1300, c=8)
    bag = record(source, tmp_path / "bag")
    monkeypatch.setenv("AMENT_PREFIX_PATH", "")
    return mauve_rt.trace.open(bag)


def test_kernel_and_readers_have_the_kinds_of_the_table():
    told = {kind.name: number for number, kind in kinds_told(TABLE.read_text(encoding="utf-8")).items()}
    (body,) = re.findall(r"enum class TraceKind[^{]*{(.*?)};", KERNEL.read_text(encoding="utf-8"), re.DOTALL)
    assert {name: int(number) for name, number in re.findall(r"(\w+) = (\d+),", body)} == told
    assert {kind.name.lower(): int(kind) for kind in Kind}.items() <= told.items()
    assert len(told) >= len(Kind) == 17


def test_the_table_names_what_each_kind_uses():
    told = kinds_told(TABLE.read_text(encoding="utf-8"))
    assert told[Kind.RELEASE] == RecordKind(
        "release", {"name": "wait", "a": "nominal_ns", "b": "actual_ns", "c": "place_ns"}
    )
    assert told[Kind.DEPLOYMENT].fields == {"a": "epoch_ns", "b": "offset_ns", "c": "period_ns"}
    reconfiguration = told[Kind.RECONFIGURATION]
    assert reconfiguration.figures == {"a": "phase", "b": "duration_ns", "c": "instant_ns"}
    assert told[Kind.STATE_BEGIN].figures == {}
    assert all(kind.fields for kind in told.values())


def test_the_prose_of_bags_from_before_the_table_is_no_table():
    told = kinds_told("uint16 START=2   # a: first nominal instant\nuint16 MARK=16  # a, b, c: the user's\n")
    assert told == kinds_known()
    assert told[Kind.MARK] == RecordKind("mark", {"name": "name", "a": "a", "b": "b", "c": "c"})


def test_a_newer_kind_takes_no_other_file_s_name(later: Trace, tmp_path: Path):
    kinds = dict(later.kinds) | {HEARTBEAT: later.kinds[HEARTBEAT]._replace(name="states")}
    export_csv(replace(later, kinds=kinds), tmp_path / "csv")
    assert len(pd.read_csv(tmp_path / "csv" / "states_records.csv")) == 2
    assert pd.read_csv(tmp_path / "csv" / "states.csv").empty


def test_a_wait_behind_a_loss_is_not_drawn(tmp_path: Path):
    source = SyntheticSource(["a"])
    source.add("a", Kind.MARK, 1, name="word")
    source.drop("a", 3)
    source.add("a", Kind.WAIT, 2, name="wait", a=5)
    source.add("a", Kind.MARK, 3, name="word")
    export_perfetto({"lost": trace_of(source)}, tmp_path / "lost.pftrace")
    decoded = Decoded(tmp_path / "lost.pftrace")
    drawn = [event.name for events in decoded.events.values() for event in events]
    assert drawn == ["word", "records lost", "word"]


def test_a_trace_made_without_a_bag_has_the_kinds_that_the_reader_knows():
    assert {kind.name for kind in kinds_known().values()} == {kind.name.lower() for kind in Kind}


def test_a_newer_kind_is_named_in_frames(later: Trace):
    assert list(later.frames.records["kind"]) == ["mark", "heartbeat", "heartbeat"]
    newer = frames.of_kind(later, HEARTBEAT)
    assert newer.to_dict("list") == {
        "component": ["a", "b"],
        "time_ns": [2, 3],
        "pump": ["left", "right"],
        "rate_mhz": [1200, 1300],
        "instant_ns": [7, 8],
    }
    assert frames.of_kind(merge_traces({"x": later}), HEARTBEAT)["component"].tolist() == ["x/a", "x/b"]


def test_a_newer_kind_is_a_typed_record(later: Trace):
    first, second = [one for one in later.typed() if isinstance(one, Told)]
    assert first == Told(2, "a", "heartbeat", "left", {"rate_mhz": 1200, "instant_ns": 7})
    assert second.word == "right"


def test_a_newer_kind_has_its_file_of_comma_separated_values(later: Trace, tmp_path: Path):
    export_csv(later, tmp_path / "csv")
    assert pd.read_csv(tmp_path / "csv" / "heartbeat.csv").to_dict("records")[0] == {
        "component": "a",
        "time_ns": 2,
        "pump": "left",
        "rate_mhz": 1200,
        "instant_ns": 7,
    }
    assert set(pd.read_csv(tmp_path / "csv" / "records.csv")["kind"]) == {"mark", "heartbeat"}


def test_a_newer_kind_is_an_instant_in_perfetto(later: Trace, tmp_path: Path):
    export_perfetto({"later": later}, tmp_path / "later.pftrace")
    decoded = Decoded(tmp_path / "later.pftrace")
    beats = [event for events in decoded.events.values() for event in events if event.name == "heartbeat"]
    assert [event.figures for event in beats] == [
        {"rate_mhz": 1200, "instant_ns": 7, "of": "left"},
        {"rate_mhz": 1300, "instant_ns": 8, "of": "right"},
    ]
