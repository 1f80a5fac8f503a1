"""What the benchmarks conclude from their rounds: intervals, ratios, verdicts, the table."""

import os
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

sys.path.append(str(Path(__file__).parents[3] / "benchmarks"))  # at the end: it hides nothing

import machine
import native
from ratios import Interval, median_interval, percentile, ratio_interval, verdict
from rows import alone, compared, exactly_zero, markdown, never_over, not_available, pooled
from topics import Window, latencies_ns, lost_on_the_way, lost_percent, process_cpu_ns


def test_the_interval_of_equal_values_is_that_value():
    assert median_interval([3.0] * 10) == Interval(3.0, 3.0, 3.0)


def test_the_interval_contains_the_true_median_about_as_often_as_it_says():
    random = np.random.default_rng(1)
    hits = 0
    for _ in range(200):
        interval = median_interval(random.lognormal(0.0, 0.5, size=12).tolist())
        hits += interval.low <= 1.0 <= interval.high
    assert 0.88 <= hits / 200 <= 1.0


def test_equal_values_give_equal_intervals():
    values = [1.0, 5.0, 2.0, 8.0, 3.0]
    assert median_interval(values) == median_interval(values)
    assert median_interval(values, seed=1).value == 3.0


def test_what_hits_both_sides_of_a_pair_cancels_out():
    weather = [1.0, 9.0, 3.0, 30.0, 2.0, 5.0, 1.5, 40.0, 2.5, 7.0]
    interval = ratio_interval([(1.1 * level, level) for level in weather])
    assert interval.low == pytest.approx(1.1)
    assert interval.high == pytest.approx(1.1)


def test_there_is_no_ratio_to_nothing():
    with pytest.raises(ValueError, match="positive"):
        ratio_interval([(1.0, 0.0)])
    with pytest.raises(ValueError, match="no values"):
        median_interval([])
    with pytest.raises(ValueError, match="no values"):
        percentile([], 50)


@pytest.mark.parametrize(
    ("interval", "rounds", "expected"),
    [
        (Interval(1.0, 0.9, 1.1), 10, "met"),
        (Interval(1.0, 0.9, 1.2), 10, "met"),
        (Interval(1.1, 0.9, 1.3), 10, "undecided"),
        (Interval(1.4, 1.2, 1.6), 10, "undecided"),
        (Interval(1.4, 1.3, 1.6), 10, "missed"),
        (Interval(1.0, 0.9, 1.1), 9, "undecided"),
    ],
)
def test_a_verdict_needs_the_whole_interval_on_one_side_and_ten_rounds(
    interval: Interval, rounds: int, expected: str
):
    assert verdict(interval, 1.2, rounds=rounds) == expected


def test_a_percentile_is_a_value_that_occurred():
    assert percentile([4, 1, 3, 2], 50) == 2
    assert percentile(range(1, 101), 99) == 99
    assert percentile([7], 99) == 7


def test_a_row_is_judged_by_its_ratio_or_else_by_its_value():
    pairs = [(12.0, 10.0)] * 10
    by_ratio = compared("a", pairs, unit="us", beside="bare", ratio_limit=1.1)
    assert (by_ratio.measured, by_ratio.reference, by_ratio.ratio) == (12.0, 10.0, 1.2)
    assert (by_ratio.target, by_ratio.verdict) == ("ratio <= 1.1", "missed")
    by_value = compared("a", pairs, unit="us", beside="bare", limit=50)
    assert (by_value.target, by_value.verdict) == ("<= 50 us", "met")
    assert compared("a", pairs, unit="us", beside="bare").verdict == "reported"


def test_what_must_not_happen_is_judged_by_the_worst_round():
    assert exactly_zero("missed", [0, 0, 0]).verdict == "met"
    row = exactly_zero("missed", [0, 2, 0])
    assert (row.verdict, row.measured) == ("missed", 2)


def test_a_bound_is_kept_when_the_worst_round_keeps_it():
    assert never_over("growth", [3, 5], limit=5, unit="KiB").verdict == "met"
    row = never_over("growth", [3, 6], limit=5, unit="KiB")
    assert (row.verdict, row.measured, row.target) == ("missed", 6, "<= 5 KiB")


def test_a_row_beside_nothing_is_judged_by_its_interval():
    assert alone("a", [250.0] * 10, unit="ns", limit=300).verdict == "met"
    assert alone("a", [250.0] * 9, unit="ns", limit=300).verdict == "undecided"
    row = alone("a", [350.0] * 10, unit="ns")
    assert (row.verdict, row.measured, row.reference, row.ratio) == ("reported", 350.0, None, None)


def test_what_is_rare_is_looked_for_in_all_rounds_together():
    row = pooled("a", range(1, 101), 99, unit="us", reference=range(201, 301), beside="bare")
    assert (row.measured, row.reference, row.verdict) == (99, 299, "reported")
    assert row.note == "maximum 100 us of 100, of the reference 300 us of 100"
    assert pooled("a", [3.0, 1.0], 99.9, unit="us").reference is None


def test_a_row_for_machines_has_the_numbers_and_every_round():
    row = compared("a", [(2.0, 1.0)] * 10, unit="us", beside="bare", ratio_limit=3).as_json()
    assert {"what", "measured", "reference", "ratio", "target", "verdict"} <= row.keys()
    assert (row["measured"], row["reference"], row["ratio"]) == (2.0, 1.0, 2.0)
    assert row["ratio_interval"] == [2.0, 2.0]
    assert len(row["rounds"]) == 10


def test_the_table_has_a_line_a_row_and_numbers_its_notes():
    lines = markdown(
        [
            compared("a", [(2.0, 1.0)] * 10, unit="us", beside="bare", ratio_limit=3, note="busy"),
            not_available("b", "not installed"),
            exactly_zero("c", [0], note="busy"),
        ]
    ).splitlines()
    assert lines[0] == "| what | measured | reference | ratio [95 %] | target | verdict |"
    assert lines[2] == "| a (1) | 2 us [2, 2] | 1 us (bare) | 2.00 [2.00, 2.00] | ratio <= 3 | met |"
    assert lines[3] == "| b (2) | - | - | - | - | not available |"
    assert lines[4].startswith("| c (1) |")
    assert "(2) not installed" in lines


def test_every_round_begins_with_another_side():
    order: list[str] = []

    def side(name: str) -> Callable[[int], str]:
        return lambda number: order.append(name) or f"{name}{number}"

    assert native.interleaved(2, side("a"), side("b")) == [["a0", "b0"], ["a1", "b1"]]
    assert order == ["a", "b", "b", "a"]


def test_a_program_that_is_not_built_is_said_so():
    with pytest.raises(native.BenchmarkError, match="bench_nothing"):
        native.run("bench_nothing")


def test_the_machine_is_described_in_one_line():
    found = machine.describe()
    assert found.cpus >= 1
    assert found.cpu in found.line()
    assert found.kernel in found.line()
    assert "\n" not in found.line()
    assert 0.0 <= machine.StealMeter().percent() <= 100.0


def test_messages_are_counted_by_when_they_were_sent():
    window = Window(begin_ns=1_000_000_000, end_ns=2_000_000_000, cpu_ns=250_000_000)
    sent_ns = np.arange(0, 3_000_000_000, 1_000_000)
    messages = np.stack([0 * sent_ns, sent_ns // 1_000_000, sent_ns, sent_ns + 50_000], axis=1)
    assert latencies_ns(messages, window) == [50_000.0] * 1000
    assert lost_percent(messages, window, 1) == 0.0
    assert lost_percent(messages, window, 2) == 50.0
    assert lost_percent(messages[::4], window, 1) == 75.0
    assert lost_on_the_way(messages, window) == 0
    gappy = messages[messages[:, 1] % 100 != 50]  # a hundredth, never the first or last of the window
    assert lost_on_the_way(gappy, window) == 10
    of_another_topic = messages + np.array([1, 5, 0, 0])
    assert lost_on_the_way(np.concatenate([gappy, of_another_topic]), window) == 10
    assert window.cpu_percent == 25.0


def test_the_cpu_time_of_a_process_is_that_of_all_its_threads():
    before_ns = process_cpu_ns(os.getpid())
    thread = threading.Thread(target=lambda: sum(range(1_000_000)))
    thread.start()
    thread.join()
    assert process_cpu_ns(os.getpid()) > before_ns
    assert process_cpu_ns(os.getpid()) == pytest.approx(time.process_time_ns(), rel=0.1)
