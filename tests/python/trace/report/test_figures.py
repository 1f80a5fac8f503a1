"""Figures of the report: histograms that hold every value, ticks that tell apart."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from synthetic_traces import EPOCH_NS, PERIOD_NS, deploy, overrun, run, swap, trace_of

from mauve_rt.trace.recording.synthetic import SyntheticSource
from mauve_rt.trace.report.analysis import analyse
from mauve_rt.trace.report.comparison import reconfigurations_section
from mauve_rt.trace.report.histograms import bins_of
from mauve_rt.trace.report.scales import linear_ticks, log_ticks
from mauve_rt.trace.report.units import counted, digits, listed, share_text, tick_texts, time_text


def plain(text: str) -> str:
    return text.replace("\N{NARROW NO-BREAK SPACE}", " ").replace("\N{MICRO SIGN}", "u")


@given(st.lists(st.integers(0, 10**10), min_size=1, max_size=200))
def test_a_histogram_holds_every_value(values: list[int]):
    array = np.array(values, np.int64)
    bins = bins_of(array)
    assert bins.counts(array).sum() == len(values)
    assert all(0 <= bins.place(value) <= 1 for value in values)
    assert all(bins.edges[0] <= tick <= bins.edges[-1] for tick in bins.ticks())


def test_a_wide_span_is_shown_by_its_logarithm():
    assert bins_of(np.array([1_000, 2_000_000])).logarithmic
    assert not bins_of(np.array([1_000, 2_000])).logarithmic
    assert not bins_of(np.array([0, 0])).logarithmic


@given(st.floats(-1e12, 1e12), st.floats(1, 1e12))
def test_ticks_are_within_their_interval(low: float, span: float):
    ticks = linear_ticks(low, low + span)
    assert 2 <= len(ticks) <= 12
    slack = 1e-6 * max(abs(low), span)
    assert all(low - slack <= tick <= low + span + slack for tick in ticks)


def test_ticks_of_decades():
    assert log_ticks(1e3, 1e6) == [1e3, 1e4, 1e5, 1e6]
    assert log_ticks(1e3, 1e4) == [1e3, 2e3, 5e3, 1e4]


@pytest.mark.parametrize(
    ("time_ns", "text"),
    [
        (None, "\N{EN DASH}"), (0, "0 us"), (999, "999 ns"), (1_234, "1.23 us"), (12_345, "12.3 us"),
        (123_456, "123 us"), (10_000_000, "10 ms"), (-1_500, "\N{MINUS SIGN}1.50 us"), (90 * 10**9, "90 s"),
        (150 * 10**9, "2 min 30 s"), (179_700_000_000, "3 min 0 s"),
        (7_500 * 10**9, "2 h 5 min"),
    ],
)  # fmt: skip
def test_times_read_with_three_digits_and_a_unit(time_ns: int | None, text: str):
    assert plain(time_text(time_ns)) == text


@pytest.mark.parametrize("time_ns", [1, 1_234, 12_345_678, 90 * 10**9, 150 * 10**9, 7_500 * 10**9])
def test_a_time_offers_no_place_to_end_a_line(time_ns: int):
    assert " " not in time_text(time_ns)


def test_ticks_that_differ_little_read_apart():
    assert [plain(text) for text in tick_texts([200_000, 200_002])] == ["200.000 us", "200.002 us"]
    assert [plain(text) for text in tick_texts([0, 500_000_000, 1_000_000_000])] == [
        "0.0 s",
        "0.5 s",
        "1.0 s",
    ]


def test_counts_and_lists_in_words():
    assert [counted(count, "overrun") for count in (0, 1, 1_234)] == [
        "no overrun",
        "1 overrun",
        "1,234 overruns",
    ]
    assert listed(["a"]) == "a"
    assert listed(["a", "b", "c"]) == "a, b and c"
    assert listed([str(index) for index in range(9)], limit=4) == "0, 1, 2 and 6 more"
    assert plain(share_text(0.00001)) == "< 0.01 %"
    assert digits(1234.5) == "1,234"


def test_before_and_after_do_not_reach_over_the_neighbouring_swaps():
    source = SyntheticSource(["c"])
    deploy(source, "c")
    pending = EPOCH_NS
    for _ in range(3):
        pending = run(source, "c", 5, begin_ns=pending)
        swap(source, "c", pending)
    run(source, "c", 5, begin_ns=pending)
    section = reconfigurations_section(analyse(trace_of(source)))
    assert section is not None
    panels = section.html.split('class="swap"')[1:]
    assert len(panels) == 3
    for panel in panels:
        assert '<td>wake-up latency</td><td class="number">5</td>' in panel
        assert panel.count('class="dot ') == 20  # of the phase: all four fives, whichever swap
        assert "no release missed" in panel


def test_the_blackout_is_told_with_its_parts():
    source = SyntheticSource(["c"])
    deploy(source, "c")
    pending = run(source, "c", 5)
    swap(source, "c", pending, blackout_ns=20_000)
    run(source, "c", 5, begin_ns=pending)
    section = reconfigurations_section(analyse(trace_of(source)))
    assert section is not None
    text = plain(section.html)
    assert "blackout 20 us: adopt 4 us, take 1 us" in text
    assert f"c was parked for 20 us, {PERIOD_NS // 2_000_000} ms before its next release was due" in text
    assert "The next release was due on the grid, and came 10 us after its instant" in text


def test_the_others_are_told_of():
    source = SyntheticSource(["c", "calm", "late"])
    for component in source.components:
        deploy(source, component)
    pending = run(source, "c", 5)
    swap(source, "c", pending)
    run(source, "c", 5, begin_ns=pending)
    run(source, "calm", 10)
    run(source, "late", 3, begin_ns=overrun(source, "late", run(source, "late", 4)))
    section = reconfigurations_section(analyse(trace_of(source)))
    assert section is not None
    text = plain(section.html)
    assert "the other 2 components were released 11 times; late overran once." in text
    assert "calm: 6 releases, no overrun; latest wake-up 10.0 us" in text
