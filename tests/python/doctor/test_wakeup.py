"""The wake-up test of `mauve doctor`: its figures fit together, and the report says what they mean."""

import os
from dataclasses import replace

import pytest

from mauve_rt.cli.doctor_view import print_finding, print_summary, print_wakeup
from mauve_rt.doctor.finding import Status, error, ok, warning
from mauve_rt.doctor.wakeup import CpuWakeup, Wakeup, describe, measure

CPU = CpuWakeup(
    cpu=3,
    policy="SCHED_FIFO",
    count=103,
    min_us=3.0,
    median_us=12.0,
    p999_us=60.0,
    max_us=61.5,
    histogram=[(5, 2), (10, 0), (20, 100), (50, 0), (100, 1), (200, 0), (None, 0)],
)
MEASURED = Wakeup(seconds=5.0, cpus=[CPU], wakeup_us=61.5, overhead_ns=9_500)


def test_a_native_component_is_measured_on_each_cpu() -> None:
    """With and without real-time rights."""
    measured = measure(1.0)
    assert [each.cpu for each in measured.cpus] == sorted(os.sched_getaffinity(0))
    for each in measured.cpus:
        assert each.policy in ("SCHED_FIFO", "SCHED_OTHER")
        assert each.count > 0
        assert 0 <= each.min_us <= each.median_us <= each.p999_us <= each.max_us
        assert sum(count for _, count in each.histogram) == each.count
        beyond = [count for edge, count in each.histogram if edge is None or edge > 2 * each.max_us]
        assert sum(beyond[1:]) == 0
    assert measured.wakeup_us == max(each.max_us for each in measured.cpus)
    assert measured.overhead_ns is None or measured.overhead_ns > 0


def test_a_figure_without_rights_is_a_warning() -> None:
    [found] = describe(MEASURED)
    assert (found.status, found.found) == (Status.OK, "longest 62 us at 1 kHz in 5 s on 1 CPU")
    [found] = describe(replace(MEASURED, cpus=[replace(CPU, policy="SCHED_OTHER")]))
    assert (found.status, "says nothing about" in found.cost) == (Status.WARNING, True)
    [found] = describe(replace(MEASURED, wakeup_us=1500.0))
    assert found.status == Status.WARNING


def test_the_report_has_bars_from_the_first_to_the_last_range(capsys: pytest.CaptureFixture[str]) -> None:
    print_wakeup(MEASURED)
    lines = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert " ".join(lines[1]) == (
        "CPU 3 SCHED_FIFO: min 3.0 median 12.0 99.9% 60.0 max 61.5 us, 103 wake-ups"
    )
    assert lines[2:7] == [
        ["0", "to", "5", "us", "2", "#"],
        ["5", "to", "10", "us", "0"],
        ["10", "to", "20", "us", "100", "#" * 40],
        ["20", "to", "50", "us", "0"],
        ["50", "to", "100", "us", "1", "#"],
    ]
    assert " ".join(lines[-1]).startswith("A release takes 9.5 us of CPU time on average")


def test_cost_and_remedy_stand_beneath_a_finding(capsys: pytest.CaptureFixture[str]) -> None:
    findings = [
        replace(ok("[all] well\x1b[31m"), name="one"),  # brackets are no markup, and no terminal obeys a name
        replace(error("bad", cost="it stops", remedy="rm [a]"), name="two"),
    ]
    for each in findings:
        print_finding(each)
    print_summary(findings)
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].split(None, 2) == ["OK", "one", "[all] well\\x1b[31m"]
    assert [" ".join(line.split()) for line in lines[1:4]] == [
        "error two bad",
        "cost: it stops",
        "remedy: rm [a]",
    ]
    assert lines[-1] == "1 error, 0 warnings"


def test_a_long_remedy_is_cut(capsys: pytest.CaptureFixture[str]) -> None:
    print_finding(warning("82 files", cost="memory", remedy="rm " + "a_file " * 82))
    lines = capsys.readouterr().out.splitlines()
    assert lines[-1].endswith("... (whole in --json)")
    assert len(lines[-1]) < 500
