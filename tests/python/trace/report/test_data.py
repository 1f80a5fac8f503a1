"""What a report's timeline keeps of a trace: packed without loss, merged only where nothing happens."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from synthetic_traces import EPOCH_NS, MS, PERIOD_NS, long_trace, periodic_trace, trace_of

from mauve_rt.trace.format.records import Kind
from mauve_rt.trace.recording.synthetic import SyntheticSource
from mauve_rt.trace.report.analysis import analyse
from mauve_rt.trace.report.columns import Columns, read_columns
from mauve_rt.trace.report.cycles import SLICE, UNKNOWN, releases_of
from mauve_rt.trace.report.detail import choose_detail
from mauve_rt.trace.report.markers import MOST, markers_of
from mauve_rt.trace.report.timeline import json_for_script, timeline_data

INTEGERS = st.integers(-(2**53), 2**53)


@given(st.lists(st.tuples(st.lists(INTEGERS, max_size=20), st.booleans()), max_size=5))
def test_columns_come_back_as_they_were(columns: list[tuple[list[int], bool]]):
    packed = Columns()
    for number, (values, differences) in enumerate(columns):
        assert packed.add(np.array(values, np.int64), differences=differences and steps_fit(values)) == number
    found = read_columns(packed.described, packed.data())
    assert [one.tolist() for one in found] == [values for values, _ in columns]


def steps_fit(values: list[int]) -> bool:
    return all(abs(b - a) <= 2**53 for a, b in pairwise(values))


def test_what_a_browser_cannot_count_to_is_refused():
    with pytest.raises(ValueError, match=r"over 2\*\*53"):
        Columns().add(np.array([2**53 + 1]))


def test_a_release_has_its_latency_and_its_response():
    found = releases_of(periodic_trace(cycles=2).of("c"))
    assert found["begin_ns"].tolist() == [EPOCH_NS, EPOCH_NS + PERIOD_NS]
    assert found["wakeup_ns"].tolist() == [10_000, 10_001]
    assert found["response_ns"].tolist() == [510_000, 510_003]


def test_a_release_before_a_gap_has_no_response():
    source = SyntheticSource(["c"])
    source.add("c", Kind.RELEASE, 5, name="wait", a=5, b=5)
    source.drop("c", 3)
    source.add("c", Kind.WAIT, 50, name="wait", a=60)
    assert releases_of(trace_of(source).of("c"))["response_ns"].tolist() == [UNKNOWN]


def test_a_short_trace_is_kept_in_full():
    analysis = analyse(periodic_trace(cycles=20))
    described, data = timeline_data(analysis)
    columns = read_columns(described["columns"], data)
    (row,) = described["rows"]
    sense, act = row["states"]
    assert (sense["name"], act["name"], described["bucket"]) == ("sense", "act", 0)
    slices = analysis.slices["c"]["sense"]
    assert (columns[sense["begin"]] + analysis.begin_ns).tolist() == slices["begin_ns"].tolist()
    assert columns[sense["extent"]].tolist() == slices["extent_ns"].tolist()
    assert columns[row["releases"]["wakeup"]].tolist() == [10_000 + cycle % 13 for cycle in range(20)]


def slices_every(period_ns: int, count: int, busy_ns: int = 100) -> np.ndarray:
    slices = np.zeros(count, SLICE)
    slices["begin_ns"] = np.arange(count) * period_ns
    slices["extent_ns"] = slices["busy_ns"] = busy_ns
    slices["number"] = 1
    return slices


@given(
    count=st.integers(1, 3000),
    budget=st.integers(10, 500),
    instants=st.lists(st.integers(0, 3_000_000), max_size=10),
)
def test_merging_loses_neither_executions_nor_their_time(count: int, budget: int, instants: list[int]):
    slices = slices_every(1000, count)
    detail = choose_detail([slices], np.array(instants, np.int64), budget=budget)
    merged = detail.thinned(slices)
    assert merged["number"].sum() == count
    assert merged["busy_ns"].sum() == count * 100
    ends = merged["begin_ns"] + merged["extent_ns"]
    assert (merged["begin_ns"][1:] >= ends[:-1]).all()
    assert len(merged) <= max(budget + 2 * len(instants) + 3, count if detail.full else 0)


def test_the_neighbourhood_of_what_is_interesting_stays_whole():
    slices = slices_every(1_000_000, 100_000)
    instants = np.array([20_000_000_000, 70_000_000_000])
    detail = choose_detail([slices], instants, budget=5_000)
    merged = detail.thinned(slices)
    assert len(merged) < 6_000
    for instant in instants:
        near = merged[np.abs(merged["begin_ns"] - instant) <= 100_000_000]
        assert (near["number"] == 1).all()
        assert len(near) == 201
    assert (merged["number"] > 1).any()


def test_a_late_cycle_in_a_long_trace_keeps_its_detail():
    late = 30_000
    trace = long_trace(["a", "b"], 60_000, late=[late])
    analysis = analyse(trace)
    described, data = timeline_data(analysis, budget=20_000)
    columns = read_columns(described["columns"], data)
    assert described["bucket"] > 0
    row = described["rows"][0]
    begin = columns[row["releases"]["begin"]] + analysis.begin_ns
    number = columns[row["releases"]["number"]]
    at = int(np.searchsorted(begin, EPOCH_NS + late * PERIOD_NS))
    assert number[at - 10 : at + 10].tolist() == [1] * 20
    assert number.sum() == 60_000
    (overruns,) = (one for one in row["markers"] if one["kind"] == "overrun")
    assert (columns[overruns["time"]] + analysis.begin_ns).tolist() == [
        EPOCH_NS + (late + 1) * PERIOD_NS + MS // 10
    ]
    assert [0, EPOCH_NS + (late + 1) * PERIOD_NS - analysis.begin_ns, MS // 10] in described["jumps"][
        "overrun"
    ]


def test_very_many_overruns_are_merged_but_none_is_forgotten():
    source = SyntheticSource(["c"])
    count = MOST + 5_000
    for index in range(count):
        source.add(
            "c", Kind.OVERRUN, index * 1000, name="wait", a=index * 1000 - 7 - index % 2, b=index * 1000, c=1
        )
    ((kind, entries),) = markers_of(trace_of(source).of("c"))
    assert kind == "overrun"
    assert len(entries) <= MOST
    assert (entries["number"].sum(), entries["skipped"].sum(), entries["value"].max()) == (count, count, 8)


def test_a_script_cannot_be_closed_by_a_name():
    text = json_for_script({"name": "</script><!--<script>&\u2028"})
    assert not set("<>&\u2028") & set(text)
