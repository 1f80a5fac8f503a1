"""Values in the report: what the page keeps of each curve, and what it says about a swap."""

import html
import math
import re
from dataclasses import make_dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from synthetic_traces import (
    EPOCH_NS,
    MS,
    PERIOD_NS,
    Pose,
    deploy,
    long_trace,
    periodic_trace,
    run,
    swap,
    trace_of,
    with_values,
)

from mauve_rt.trace.reading.trace import Trace
from mauve_rt.trace.recording.synthetic import SyntheticSource
from mauve_rt.trace.report import write_report
from mauve_rt.trace.report.analysis import analyse
from mauve_rt.trace.report.columns import Columns, read_columns
from mauve_rt.trace.report.swap_values import MOST_VALUES, _shortened, swap_values, values_around_swap
from mauve_rt.trace.report.timeline import timeline_data
from mauve_rt.trace.report.values import MOST_CURVES, MOST_ENTRIES, values_section

POSE = "/robot_1/executor/values/pose"


def curves_of(trace: Trace) -> tuple[list[dict[str, Any]], list[Any]]:
    described, data = timeline_data(analyse(trace))
    return described["values"]["curves"], read_columns(described["columns"], data)


def swapped(topics: dict[str, Any]) -> Trace:
    """A trace with a swap, parked half a period before the pending instant; blackout 20 us."""
    source = SyntheticSource(["c"])
    deploy(source, "c")
    pending = run(source, "c", 20)
    swap(source, "c", pending)
    run(source, "c", 20, begin_ns=pending)
    return with_values(trace_of(source), topics)


PARKED_NS = EPOCH_NS + 20 * PERIOD_NS - PERIOD_NS // 2


def words(trace: Trace) -> list[str]:
    (one,) = analyse(trace).swaps
    return [value.words() for value in swap_values(analyse(trace), one.measured)]


def test_columns_of_floats_come_back_with_nan_and_infinity():
    packed = Columns()
    values = [0.1, math.nan, math.inf, -1e300]
    packed.add(np.array([1, 2]))
    assert packed.add_floats(np.array(values)) == 1
    whole, floats = read_columns(packed.described, packed.data())
    assert whole.tolist() == [1, 2]
    np.testing.assert_equal(floats, values)


def test_a_short_curve_is_kept_in_full_on_the_clock_of_the_timeline():
    trace = with_values(
        periodic_trace(), {POSE: [(EPOCH_NS, Pose(1, 2)), (EPOCH_NS + MS, Pose(3, math.inf))]}
    )
    (x, y), columns = curves_of(trace)
    begin_ns = analyse(trace).begin_ns
    assert (x["name"], y["name"]) == ("pose.x", "pose.y")
    assert columns[x["time"]].tolist() == [EPOCH_NS - begin_ns, EPOCH_NS + MS - begin_ns]
    assert columns[x["low"]].tolist() == columns[x["high"]].tolist() == [1.0, 3.0]
    assert (x["gaps"], y["gaps"]) == (0, 1)
    np.testing.assert_equal(columns[y["low"]], [2.0, math.nan])


def test_a_long_curve_keeps_every_extreme_and_each_sample_around_an_overrun():
    count = 100_000
    wave = np.random.default_rng(1).normal(size=count)
    wave[70_000] = math.nan
    poses = [(EPOCH_NS + n * MS, Pose(float(wave[n]), 0)) for n in range(count)]
    trace = with_values(long_trace(["c"], 10_000, late=[5_000]), {POSE: poses})
    (x, _), columns = curves_of(trace)
    time, number, low, high = (columns[x[name]] for name in ("time", "number", "low", "high"))
    assert len(time) <= MOST_ENTRIES
    assert number.sum() == count
    assert (number > 1).sum() <= 4_000
    assert (np.nanmin(low), np.nanmax(high)) == (np.nanmin(wave), np.nanmax(wave))
    starts = np.concatenate([[0], np.cumsum(number)[:-1]]).astype(int)
    np.testing.assert_array_equal(low, np.fmin.reduceat(wave, starts))
    np.testing.assert_array_equal(high, np.fmax.reduceat(wave, starts))
    late = EPOCH_NS + 5_001 * PERIOD_NS - analyse(trace).begin_ns
    around = np.abs(time - late) < 50 * MS
    assert (number[around] == 1).all()
    assert around.sum() >= 99


def test_curves_of_resources_come_first_and_the_note_names_those_left_out():
    many_of = make_dataclass("Many", [f"f{index:02}" for index in range(MOST_CURVES + 3)])
    many = [(EPOCH_NS + n * MS, many_of(*[float(n)] * (MOST_CURVES + 3))) for n in range(3)]
    poses = [(EPOCH_NS + n * MS, Pose(0, n)) for n in range(3)]
    analysis = analyse(with_values(periodic_trace(), {"/many": many, POSE: poses}))
    described, _ = timeline_data(analysis)
    names = [curve["name"] for curve in described["values"]["curves"]]
    assert len(names) == MOST_CURVES
    assert names[:3] == ["pose.x", "pose.y", "/many.f00"]
    section = values_section(analysis, described["values"])
    assert section is not None
    assert "Of 29 values 24 are drawn: those of recorded resources first" in section.note
    assert "Left out: /many.f22, /many.f23, /many.f24, /many.f25 and /many.f26." in section.note
    assert "more samples than fit" not in section.note


def test_each_topic_has_a_curve_before_elements_of_arrays_gaps_and_constants():
    at = [EPOCH_NS + n * MS for n in range(3)]
    many_of = make_dataclass("Many", ["values", "still", "last"])
    many = [(at_ns, many_of([float(n)] * 16, 7, n)) for n, at_ns in enumerate(at)]
    topics = {f"/many{index}": many for index in range(3)}
    gaps = [(at[0], Pose(1, math.nan)), (at[1], Pose(2, math.nan)), (at[2], Pose(3, 1))]
    described, _ = timeline_data(analyse(with_values(periodic_trace(), {**topics, "/pose": gaps})))
    names = [curve["name"] for curve in described["values"]["curves"]]
    assert len(names) == MOST_CURVES
    assert {"/many0.last", "/many1.last", "/many2.last", "/pose.x", "/many2.values[0]"} <= {*names}
    assert not {"/many0.still", "/pose.y", "/many0.values[15]"} & {*names}
    assert names == sorted(names, key=lambda name: name.split(".")[0])


def test_the_note_of_a_long_run_reports_merged_samples():
    poses = [(EPOCH_NS + n * MS, Pose(n, n)) for n in range(20_000)]
    analysis = analyse(with_values(long_trace(["c"], 2_000), {POSE: poses}))
    section = values_section(analysis, timeline_data(analysis)[0]["values"])
    assert section is not None
    assert "2 curves of 2 have more samples than fit" in section.note
    assert "each sample is kept" in section.note


def test_a_trace_without_values_has_no_section():
    analysis = analyse(periodic_trace())
    assert values_section(analysis, timeline_data(analysis)[0]["values"]) is None


def test_gaps_are_counted_in_the_row_and_a_message_of_another_day_does_no_harm():
    poses = [(EPOCH_NS, Pose(math.nan, 1)), (EPOCH_NS + MS, Pose(2, 1)), (2**61, Pose(3, 1))]
    analysis = analyse(with_values(periodic_trace(), {POSE: poses}))
    section = values_section(analysis, timeline_data(analysis)[0]["values"])
    assert section is not None
    assert '<em class="gaps">1 gap</em>' in section.html
    assert "1 of them NaN, infinite or missing" in section.html


def test_a_swap_reports_before_after_and_step():
    poses = [(EPOCH_NS, Pose(0.42, 5)), (PARKED_NS + MS, Pose(0.40, 5)), (PARKED_NS + 2 * MS, Pose(9, 9))]
    assert words(swapped({POSE: poses})) == [
        "pose.x: 0.42 before, 0.4 after, step \N{MINUS SIGN}0.02",
        "pose.y: 5 before, 5 after, step 0",
    ]


def test_a_swap_reports_values_during_the_blackout_and_where_there_is_none():
    poses = [(PARKED_NS + 5_000, Pose(1, math.nan)), (PARKED_NS + 9_000, Pose(3, math.nan))]
    assert words(swapped({POSE: poses, "/late": [(PARKED_NS + MS, Pose(7, math.nan))]})) == [
        "/late.x: none before, 7 after",
    ]
    poses.insert(0, (EPOCH_NS, Pose(2, math.nan)))
    assert words(swapped({POSE: poses})) == ["pose.x: 2 before, 2 values from 1 to 3 during, none after"]
    assert words(swapped({POSE: poses[:2]})) == ["pose.x: 2 before, 1 during, none after"]


def test_a_swap_reports_how_late_a_value_beyond_its_figure_came():
    poses = [(EPOCH_NS, Pose(1, 2)), (PARKED_NS + 20_000 + 150 * MS, Pose(2, 2))]
    assert words(swapped({POSE: poses}))[0] == "pose.x: 1 before, 2 after (150\u202fms later), step +1"


def test_a_swap_shows_the_values_that_change_most_relative_to_before():
    many_of = make_dataclass("Many", [f"f{index}" for index in range(8)])
    factors = [1, 1, 50, 1, 30, 40, 20, 10]  # of the step over the swap
    many = [(EPOCH_NS + n * PERIOD_NS, many_of(*[float(n)] * 8)) for n in range(20)]
    after = many_of(*[19.0 + factor for factor in factors])
    trace = swapped(
        {
            POSE: [(EPOCH_NS, Pose(1, 1)), (PARKED_NS + MS, Pose(1, 2))],
            "/many": [*many, (PARKED_NS + MS, after)],
        }
    )
    shown = [text.split(":")[0] for text in words(trace)]
    assert len(shown) == MOST_VALUES
    assert shown == ["pose.y", "/many.f2", "/many.f5", "/many.f4", "/many.f6", "/many.f7"]
    (one,) = analyse(trace).swaps
    _, told = values_around_swap(analyse(trace), one.measured)
    assert "Of 10 values those that change most." in told


@pytest.mark.parametrize(
    "names",
    [
        ["target.joints[0].position", "target.joints[1].position", "target.joints[12].position"],
        ["pose.position.x", "arm_of_the_first_robot.torque", "arm_of_the_second_robot.torque"],
        ["a" * 40 + "1" + "b" * 40, "a" * 40 + "2" + "b" * 40],
    ],
)
def test_shortened_names_of_curves_stay_different(names: list[str]) -> None:
    found = _shortened(names)
    assert len({*found}) == len(names)
    assert all(len(short) <= len("1: ") + 22 for short in found)


def test_the_figure_of_a_swap_has_a_curve_for_each_value(tmp_path: Path):
    poses = [(EPOCH_NS + n * MS + MS // 2, Pose(math.sin(n), 3)) for n in range(400)]
    trace = swapped({POSE: poses})
    (one,) = analyse(trace).swaps
    figure, told = values_around_swap(analyse(trace), one.measured)
    curves = re.findall(r'<path d="(M[^"]*)" class="value"', figure)
    assert len(curves) == 2
    assert curves[0].count("V") > 40
    assert curves[1].count("V") > 40
    assert told.count("<li>") == 2
    write_report(tmp_path / "report.html", trace)
    page = html.unescape((tmp_path / "report.html").read_text(encoding="utf-8"))
    assert figure.split(">")[0] in page
    assert "pose.y: 3 before, 3 after, step 0" in page


@pytest.mark.parametrize("value", [1.7e308, 1e-300, 0.0])
def test_values_of_any_size_are_drawn(value: float):
    poses = [(EPOCH_NS + n * MS, Pose(-value if n % 2 else value, 0)) for n in range(400)]
    trace = swapped({POSE: poses})
    (one,) = analyse(trace).swaps
    figure, _ = values_around_swap(analyse(trace), one.measured)
    assert "nan" not in figure
    assert "inf" not in figure
