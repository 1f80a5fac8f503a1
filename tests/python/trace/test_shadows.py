"""Shadows in a bag: read back, in frames, tables, reports and Perfetto."""

import csv
import math
import re
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from perfetto_decoding import Decoded
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from synthetic_traces import MS, ROOT, deploy, record_small_bag, run

import mauve_rt.trace
from mauve_rt.trace.export.csv_files import export_csv
from mauve_rt.trace.export.perfetto import export_perfetto
from mauve_rt.trace.reading.shadows import SHADOW_TYPE, OutputCurve
from mauve_rt.trace.reading.trace import Trace, merge_traces
from mauve_rt.trace.recording.recorder import Recorder
from mauve_rt.trace.recording.synthetic import SyntheticSource
from mauve_rt.trace.report import write_report
from mauve_rt.trace.report.output_curves import output_curves

TYPES = get_typestore(Stores.EMPTY)
for name in ("ShadowOutput", "OutputStep", "OutputCurve", "Shadow"):
    text = (ROOT / "mauve_msgs" / "msg" / f"{name}.msg").read_text(encoding="utf-8")
    TYPES.register(get_types_from_msg(text, f"mauve_msgs/msg/{name}"))
RUNNING, ENDED, FAULTED = 0, 1, 2


@pytest.fixture(autouse=True)
def installed_messages(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shutil.copytree(ROOT / "mauve_msgs" / "msg", tmp_path / "prefix" / "share" / "mauve_msgs" / "msg")
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path / "prefix"))


def shadow(component: str, verdict: int, compared: int, *, begin_ms: int = 30, **told: Any) -> bytes:
    output = TYPES.types["mauve_msgs/msg/ShadowOutput"](
        port="cmd",
        field="linear.x",
        compared=compared,
        maximum=compared / 8,
        rms=0.25,
        nan=3,
        live_nan=0,
        live_only=1,
        shadow_only=2,
        has_lag=True,
        lag=-1,
    )
    other = replace(output, field="linear.y", maximum=float("inf"), nan=0, has_lag=False, lag=0)
    step = TYPES.types["mauve_msgs/msg/OutputStep"](
        output="cmd.linear.x",
        greatest=0.5,
        difference=0.25,
        least=0.125,
        least_instant_ns=1,
        step=float("nan"),
    )
    curve = TYPES.types["mauve_msgs/msg/OutputCurve"](
        output="cmd.linear.x",
        instant_ns=0,
        instants_ns=np.array([28 * MS, 29 * MS, 30 * MS]),
        live=np.array([float("nan"), 1.0, 1.125]),
        candidate=np.array([2.0, float("nan"), 1.25]),
        new_instants_ns=np.array([], np.int64),
        new_core=np.array([], np.float64),
    )
    message = TYPES.types[SHADOW_TYPE](
        component=component,
        core="my_robot/Pid2",
        live_core="my_robot/Pid",
        verdict=verdict,
        reason="",
        begin_ns=begin_ms * MS,
        end_ns=0,
        releases=1000,
        compared=compared,
        skipped_late=4,
        skipped_budget=5,
        idle=6,
        over_budget=7,
        budget_ns=50_000,
        largest_execution_ns=61_000,
        outputs=[output, other],
        steps=[step],
        curves=[curve],
    )
    return bytes(TYPES.serialize_cdr(replace(message, **told), SHADOW_TYPE))


@pytest.fixture
def trace(tmp_path: Path) -> Trace:
    """Two shadows of `c`, of which one ended and one still runs, and one of `b`, which failed."""
    source = SyntheticSource(["c", "b"])
    deploy(source, "c")
    run(source, "c", 200)
    recorder = Recorder(source, tmp_path / "bag", node_name="/robot_1/executor")
    recorder.start()
    for at_ms, data in (
        (40, shadow("c", RUNNING, 10)),
        (1040, shadow("c", RUNNING, 80)),
        (1300, shadow("c", ENDED, 90, end_ns=1250 * MS, reason="a step end_shadow")),
        (1350, shadow("b", FAULTED, 1, end_ns=1340 * MS, reason="too far in state act")),
        (1400, shadow("c", RUNNING, 2, begin_ms=1390)),
    ):
        recorder.record("/robot_1/executor/shadow", SHADOW_TYPE, data, monotonic_ns=at_ms * MS)
    recorder.stop()
    return mauve_rt.trace.open(tmp_path / "bag")


def test_each_shadow_is_read_by_its_last_report(trace: Trace) -> None:
    assert [(one.component, one.begin_ns // MS, one.verdict, one.compared) for one in trace.shadows] == [
        ("b", 30, "faulted", 1),
        ("c", 30, "ended", 90),
        ("c", 1390, "running", 2),
    ]
    failed, ended, running = trace.shadows
    assert (failed.reason, ended.reason) == ("too far in state act", "a step end_shadow")
    assert (ended.core, ended.live_core) == ("my_robot/Pid2", "my_robot/Pid")
    assert (ended.time_ns, ended.end_ns, running.end_ns) == (1300 * MS, 1250 * MS, None)
    assert (ended.releases, ended.skipped_late, ended.skipped_budget) == (1000, 4, 5)
    assert (ended.idle, ended.over_budget) == (6, 7)
    assert (ended.budget_ns, ended.largest_execution_ns) == (50_000, 61_000)
    first, other = ended.outputs
    assert (first.name, first.compared, first.maximum, first.rms) == ("cmd.linear.x", 90, 11.25, 0.25)
    assert (first.nan, first.live_nan, first.live_only, first.shadow_only) == (3, 0, 1, 2)
    assert (first.lag, other.lag) == (-1, None)
    assert [one.compared for one in trace.shadow_reports] == [10, 80, 90, 1, 2]


def test_merged_traces_name_the_components_of_each_executor(trace: Trace) -> None:
    merged = merge_traces({"left": trace, "right": trace})
    assert [one.component for one in merged.shadows] == [
        *("left/b", "left/c", "left/c"),
        *("right/b", "right/c", "right/c"),
    ]


def test_shadows_are_a_frame_and_a_table(trace: Trace, tmp_path: Path) -> None:
    frame = trace.frames.shadows
    assert frame[frame["field"] == "linear.x"]["maximum"].tolist() == [1.25, 10, 11.25, 0.125, 0.25]
    export_csv(trace, tmp_path / "out")
    with (tmp_path / "out" / "shadows.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 10
    told = {name: rows[4][name] for name in ("component", "verdict", "end_ns", "field", "compared", "lag")}
    assert told == {
        "component": "c",
        "verdict": "ended",
        "end_ns": str(1250 * MS),
        "field": "linear.x",
        "compared": "90",
        "lag": "-1",
    }
    assert (rows[0]["end_ns"], rows[1]["lag"]) == ("", "")
    with (tmp_path / "out" / "topic.robot_1.executor.shadow.csv").open(encoding="utf-8") as file:
        assert len(list(csv.DictReader(file))) == 5


def test_the_report_has_a_section_of_shadows(trace: Trace, tmp_path: Path) -> None:
    write_report(tmp_path / "report.html", trace)
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    section = page.partition('<section id="shadows"')[2].partition("</section>")[0]
    assert section.count("<figure>") == 3
    shadows, outputs = section.split("<h3>Differences of the outputs</h3>")
    for words in ("my_robot/Pid2", "my_robot/Pid<", "ended", "a step end_shadow", "skipped: late"):
        assert words in shadows, words
    assert 'data-level="bad">faulted' in shadows
    for words in ("cmd.linear.x", ">90<", ">11.25<", ">0.25<", 'data-level="bad">3<', "\N{EN DASH}"):
        assert words in outputs, words


SWAPPED = OutputCurve(
    output="cmd.linear.x",
    instant_ns=32 * MS,
    instants_ns=(30 * MS, 31 * MS),
    live=(1.0, 1.5),
    candidate=(3.0, 1.75),
    new_instants_ns=(32 * MS, 33 * MS),
    new_core=(2.0, 2.5),
)


def test_curves_of_outputs_are_read_and_are_a_table(trace: Trace, tmp_path: Path) -> None:
    (curve,) = trace.shadows[0].curves
    assert (curve.output, curve.instant_ns, curve.instants_ns) == (
        "cmd.linear.x",
        None,
        (28 * MS, 29 * MS, 30 * MS),
    )
    assert curve.points("live")[1:] == [(29 * MS, 1.0), (30 * MS, 1.125)]
    assert math.isnan(curve.candidate[1])
    assert curve.new_core == ()
    export_csv(trace, tmp_path / "out")
    with (tmp_path / "out" / "output_curves.csv").open(encoding="utf-8", newline="") as file:
        rows = [row for row in csv.DictReader(file) if row["component"] == "b"]
    assert [(row["series"], row["number"], row["swap_ns"]) for row in rows] == [
        *(("live", number, "") for number in ("", "1.0", "1.125")),
        *(("candidate", number, "") for number in ("2.0", "", "1.25")),
    ]


def drawing(trace: Trace, *, greatest: float = 0.5, step: float = 0.5, **told: Any) -> str:
    """The figure of one output of the first shadow."""
    one = trace.shadows[0]
    steps = (replace(one.steps[0], greatest=greatest, step=step),)
    return output_curves([replace(one, steps=steps, curves=(replace(SWAPPED, **told),))])


def places(html: str, css: str) -> list[list[float]]:
    """The points of a curve on the page."""
    found = re.search(rf'd="M([^"]+)" class="curve {css}"', html)
    return [[float(part) for part in point.split()] for point in found[1].split("L")] if found else []


def number_of(html: str, pattern: str) -> float:
    found = re.search(pattern, html)
    assert found, pattern
    return float(found[1])


def test_the_report_draws_an_output_over_the_swap_with_its_bound(trace: Trace) -> None:
    html = drawing(trace)
    before, candidate, after = (places(html, css) for css in ("before", "candidate", "after"))
    assert [len(points) for points in (before, candidate, after)] == [2, 2, 2]
    swap_x = number_of(html, r'<line x1="([\d.]+)"[^>]* class="instant"')
    assert before[-1][0] < swap_x == after[0][0]
    assert [x for x, _ in before] == [x for x, _ in candidate]
    per_unit = before[0][1] - after[0][1]  # from 1 to 2; upwards is less
    top, height = (
        number_of(html, rf'<rect[^>]* {name}="([\d.]+)"[^>]* class="band"') for name in ("y", "height")
    )
    assert height == pytest.approx(per_unit, abs=0.1), "0.5 below and above"
    assert top + height / 2 == pytest.approx(before[-1][1], abs=0.1), "around the last output of the old core"
    told = "step +0.5, difference +0.25 (at most 0.5)"
    for words in (">T<", "ms</text>", told, "last of the core before: 1.5"):
        assert words in html, words


def test_a_bound_beyond_all_curves_does_not_flatten_them(trace: Trace) -> None:
    html = drawing(trace, greatest=1000.0)
    (_, low), (_, high) = places(html, "before")[0], places(html, "candidate")[0]
    assert low - high > 100
    assert "(at most 1000)" in html


def test_a_refused_change_is_drawn_with_its_least_difference(trace: Trace) -> None:
    html = drawing(trace, instant_ns=None, new_instants_ns=(), new_core=())
    assert places(html, "before")
    assert places(html, "candidate")
    assert not places(html, "after")
    assert "not swapped, least difference 0.125 (at most 0.5)" in html
    assert ">T<" not in html


def test_numbers_that_are_not_finite_are_left_out_of_a_drawing(trace: Trace) -> None:
    inf, nan = float("inf"), float("nan")
    html = drawing(trace, live=(nan, 1.5), candidate=(inf, nan), new_core=(-inf, 1e308))
    assert [len(places(html, css)) for css in ("before", "candidate", "after")] == [1, 0, 1]
    assert "nan" not in html
    assert "inf" not in html
    assert drawing(trace, live=(nan, nan), candidate=(nan, nan)) == ""
    for number in (0.0, 1e308, -1e308, 5e-324):
        pair = (number, number)
        assert "nan" not in drawing(trace, greatest=0.0, live=pair, candidate=pair, new_core=pair)


def test_the_largest_difference_is_a_counter_in_perfetto(trace: Trace, tmp_path: Path) -> None:
    export_perfetto({"executor": trace}, tmp_path / "out.pftrace")
    decoded = Decoded(tmp_path / "out.pftrace")
    (counter,) = [uuid for uuid, track in decoded.tracks.items() if track.name == "c cmd.linear.x"]
    assert decoded.counted[counter] == [
        (40 * MS, 1.25), (1040 * MS, 10), (1300 * MS, 11.25), (1400 * MS, 0.25),
    ]  # fmt: skip


def test_figures_of_shadows_are_no_values_of_the_robot(trace: Trace) -> None:
    assert trace.topics["/robot_1/executor/shadow"] == (SHADOW_TYPE, 5)
    assert trace.values.names == ()


def test_a_bag_without_shadows_tells_of_none(tmp_path: Path) -> None:
    trace = mauve_rt.trace.open(record_small_bag(tmp_path / "small"))
    assert trace.shadows == ()
    assert trace.frames.shadows.empty
    write_report(tmp_path / "report.html", trace)
    assert 'id="shadows"' not in (tmp_path / "report.html").read_text(encoding="utf-8")
    export_perfetto({"executor": trace}, tmp_path / "out.pftrace")
    assert "shadows" not in [track.name for track in Decoded(tmp_path / "out.pftrace").tracks.values()]
