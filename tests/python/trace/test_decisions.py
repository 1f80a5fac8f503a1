"""What rules decided, read back from a trace: no component's records, joined with the messages of them."""

import csv
import shutil
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest
from perfetto_decoding import Decoded
from synthetic_traces import MS, ROOT, record_small_bag
from trace_decisions import said, trace_with_rules

import mauve_rt.trace
from mauve_rt.trace.export.csv_files import export_csv
from mauve_rt.trace.export.perfetto import export_perfetto
from mauve_rt.trace.format.kinds import kinds_told
from mauve_rt.trace.format.records import Kind
from mauve_rt.trace.reading.decisions import explained_decisions
from mauve_rt.trace.reading.facts import TracedDecision
from mauve_rt.trace.reading.trace import merge_traces


@pytest.fixture(autouse=True)
def installed_messages(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shutil.copytree(ROOT / "mauve_msgs" / "msg", tmp_path / "prefix" / "share" / "mauve_msgs" / "msg")
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path / "prefix"))


def test_decisions_are_read_in_the_words_of_the_bag_and_are_no_component_s(tmp_path: Path) -> None:
    trace = trace_with_rules(tmp_path / "bag")
    assert trace.decisions == (
        TracedDecision(30 * MS, "lidar_lost", "armed", 0, ""),
        TracedDecision(50 * MS, "lidar_lost", "condition true", 49 * MS, ""),
        TracedDecision(51 * MS, "lidar_lost", "do", 49 * MS, ""),
        TracedDecision(60 * MS, "lidar_lost", "done", 49 * MS, ""),
        TracedDecision(90 * MS, "lidar_lost", "no undo", 80 * MS, "cooldown"),
    )
    assert (trace.components, list(trace.losses), trace.lost) == (("c",), ["c"], 0)


def test_a_bag_without_rules_has_no_decisions(tmp_path: Path) -> None:
    trace = mauve_rt.trace.open(record_small_bag(tmp_path / "bag"))
    assert (trace.decisions, explained_decisions(trace)) == ((), [])


def test_the_table_tells_what_values_mean() -> None:
    told = kinds_told((ROOT / "mauve_msgs" / "msg" / "TraceRecord.msg").read_text(encoding="utf-8"))
    assert told[Kind.RECONFIGURATION].words == {"a": {1: "adopt", 2: "take"}}
    assert told[Kind.DECISION].words["a"][12] == "no undo"
    assert told[Kind.DECISION].words["c"][10] == "timed out"
    assert told[Kind.RELEASE].words == {}


def test_a_decision_that_the_table_does_not_name_is_told_by_its_number(tmp_path: Path) -> None:
    table = tmp_path / "prefix" / "share" / "mauve_msgs" / "msg" / "TraceRecord.msg"
    table.write_text(table.read_text(encoding="utf-8").replace(", 12 no undo", ""), encoding="utf-8")
    assert trace_with_rules(tmp_path / "bag").decisions[-1].decision == "decision 12"


def test_each_decision_has_the_reason_of_the_nearest_message_of_its_rule_and_kind(tmp_path: Path) -> None:
    trace = trace_with_rules(
        tmp_path / "bag",
        said(20, "do", "an earlier one", act="do"),
        said(51, "do", "nothing on /scan", act="do"),
        said(51, "do", "another rule's", act="do", rule="other"),
        said(60, "done", "do: core", act="do", took_s=0.011, bound_s=0.02),
        said(61, "done", "undo: core", act="undo"),
        said(91, "suppressed", "no do: cooldown", act="do"),
    )
    found = {one.traced.decision: one for one in explained_decisions(trace)}
    assert found["do"].reason == "nothing on /scan"
    assert found["done"][1:4] == ("do: core", 0.011, 0.02)
    assert found["no undo"][1:4] == ("", None, None)
    assert found["armed"].reason == ""


def test_a_message_of_a_simulated_clock_is_joined_by_when_it_was_sent(tmp_path: Path) -> None:
    message = said(51, "do", "nothing on /scan", act="do")
    message.msg.stamp = SimpleNamespace(sec=12, nanosec=0)
    found = explained_decisions(trace_with_rules(tmp_path / "bag", message))
    assert [one.reason for one in found if one.traced.decision == "do"] == ["nothing on /scan"]


def test_merged_traces_name_the_rules_of_each_executor(tmp_path: Path) -> None:
    one = trace_with_rules(
        tmp_path / "one", said(51, "do", "left", act="do", topic="/left/executor/decisions")
    )
    other = trace_with_rules(
        tmp_path / "two", said(51, "do", "right", act="do", topic="/right/executor/decisions")
    )
    merged = merge_traces({"left": one, "right": other})
    found = [one for one in explained_decisions(merged) if one.traced.decision == "do"]
    assert [(one.traced.rule, one.reason) for one in found] == [
        ("left/lidar_lost", "left"),
        ("right/lidar_lost", "right"),
    ]
    assert len(merged.decisions) == 10
    assert merged.components == ("left/c", "right/c")


def test_a_trace_lasts_as_long_as_its_decisions(tmp_path: Path) -> None:
    trace = trace_with_rules(tmp_path / "bag")
    late = trace.decisions[-1]._replace(time_ns=10**12)
    assert replace(trace, decisions=(late,)).span_ns[1] == 10**12


def test_decisions_are_exported_as_a_table(tmp_path: Path) -> None:
    trace = trace_with_rules(tmp_path / "bag", said(60, "done", "do: core", act="do", took_s=0.011))
    export_csv(trace, tmp_path / "out")
    with (tmp_path / "out" / "decisions.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["decision"] for row in rows] == ["armed", "condition true", "do", "done", "no undo"]
    assert rows[3] == {
        "time_ns": "60000000",
        "rule": "lidar_lost",
        "decision": "done",
        "cause_ns": "49000000",
        "why": "",
        "reason": "do: core",
        "took_s": "0.011",
        "bound_s": "",
    }
    assert trace.frames.decisions["why"].tolist()[-1] == "cooldown"


def test_decisions_are_instants_of_a_track_in_perfetto(tmp_path: Path) -> None:
    trace = trace_with_rules(tmp_path / "bag", said(51, "do", "nothing on /scan", act="do"))
    export_perfetto({"executor": trace}, tmp_path / "out.pftrace")
    events = Decoded(tmp_path / "out.pftrace").of("rules", parent="executor")
    assert [(event.begin_ns, event.name) for event in events][2] == (51 * MS, "lidar_lost: do")
    assert events[2].figures["reason"] == "nothing on /scan"
    assert len(events) == 5


def test_a_trace_without_decisions_has_no_such_track(tmp_path: Path) -> None:
    trace = mauve_rt.trace.open(record_small_bag(tmp_path / "bag"))
    export_perfetto({"executor": trace}, tmp_path / "out.pftrace")
    names = [track.name for track in Decoded(tmp_path / "out.pftrace").tracks.values()]
    assert "rules" not in names
