"""`mauve trace info|check|repair|stats`: what a person reads, what a program reads, exit statuses."""

import json
import os
from dataclasses import replace
from io import StringIO
from pathlib import Path

import pytest
from rich.console import Console
from rosbags.highlevel import AnyReader

import mauve_rt.trace
from mauve_rt.cli.main import main
from mauve_rt.cli.tables import print_tables
from mauve_rt.cli.trace_views import statistics_view, time_text
from mauve_rt.trace.format.records import Kind
from mauve_rt.trace.reading.reconfigurations import reconfigurations
from mauve_rt.trace.reading.statistics import all_statistics
from mauve_rt.trace.recording.recorder import Recorder
from mauve_rt.trace.recording.synthetic import SyntheticSource
from mauve_rt.trace.recording.trace_bag import TraceBag


@pytest.fixture
def source() -> SyntheticSource:
    source = SyntheticSource(["control", "slow"])
    source.add("control", Kind.DEPLOYMENT, 0, a=1000, c=1000)
    source.add("control", Kind.START, 1, a=1000)
    instant = 1000
    for _ in range(10):
        instant = source.cycle("control", instant, states={"work": 250}, wait_ns=1000, wakeup_ns=20)
    source.add("control", Kind.PARKED, instant - 500, name="wait", a=instant)
    source.add("control", Kind.RECONFIGURATION, instant - 490, name="replace_core p/B", a=1, b=4)
    source.add("control", Kind.ARMED, instant - 480, name="wait", a=instant, b=1)
    source.cycle("control", instant, states={"work": 250}, wait_ns=1000, wakeup_ns=30)
    source.add("slow", Kind.MARK, 5, name="[bold]hostile[/bold]")
    return source


def record(source: SyntheticSource, directory: Path) -> str:
    recorder = Recorder(source, directory, node_name="/robot/executor")
    recorder.start()
    recorder.stop()
    return str(directory)


def test_info(source: SyntheticSource, tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    bag = record(source, tmp_path / "bag")
    assert main(["trace", "info", bag]) == 0
    shown = capsys.readouterr().out
    assert "50 records of 2 components" in shown
    assert "0 lost" in shown
    assert main(["trace", "info", bag, "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["components"]["control"] == {"records": 49, "lost": 0}
    assert told["topics"]["/robot/executor/trace/names"] == {
        "type": "mauve_msgs/msg/TraceNames",
        "messages": 1,
    }


@pytest.mark.parametrize(("by_s", "how"), [(-60, "set back by 60.0 s"), (60, "set forward by 60.0 s (or")])
def test_a_step_of_the_clock_is_reported(
    source: SyntheticSource, tmp_path: Path, capsys: pytest.CaptureFixture[str], by_s: int, how: str
):
    bag = TraceBag(source, tmp_path / "bag", node_name="/robot/executor", on_error=pytest.fail)
    begin_ns = source.now_ns
    for number in range(4):
        if number == 2:
            source.realtime_offset_ns += by_s * 10**9
        source.now_ns = begin_ns + number * 10**9
        bag.write(source.drain_trace(), [], whole=True)
    bag.close()
    assert main(["trace", "check", str(tmp_path / "bag")]) == 0
    shown = capsys.readouterr().out
    assert shown.count("note: the clock was set") == 1
    assert how in shown
    assert " at 2023-11-14T22:13:22+00:00 of the time before" in shown
    assert main(["trace", "info", str(tmp_path / "bag")]) == 0
    assert how in " ".join(capsys.readouterr().out.split())
    with AnyReader([tmp_path / "bag"]) as reader:
        assert reader.end_time - 1 - reader.start_time == (3 + max(by_s, 0)) * 10**9  # log times are in order
    times_ns = [step.realtime_ns for step in mauve_rt.trace.open(tmp_path / "bag").clock_steps]
    assert times_ns == [begin_ns + 2 * 10**9 + 1_700_000_000 * 10**9]


def test_stats(source: SyntheticSource, tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    bag = record(source, tmp_path / "bag")
    assert main(["trace", "stats", bag]) == 0
    shown = " ".join(capsys.readouterr().out.split())
    assert "control 1 us" in shown
    assert "wake-up latency 11 20 ns 20 ns 30 ns 30 ns 30 ns" in shown
    assert "state work 11 250 ns" in shown
    assert "control replace_core p/B yes 20 ns 0 0 ns 30 ns" in shown
    assert main(["trace", "stats", bag, "--json"]) == 0
    told = json.loads(capsys.readouterr().out)["control"]
    assert (told["releases"], told["wakeup"]["max_ns"], told["execution"]["work"]["p50_ns"]) == (11, 30, 250)


@pytest.mark.parametrize("width", [40, 80, 100])
def test_stats_break_no_number_in_a_narrow_terminal(source: SyntheticSource, tmp_path: Path, width: int):
    bag = record(source, tmp_path / "bag")
    trace = mauve_rt.trace.open(Path(bag))
    long = {
        f"{name}_of_a_robot": replace(one, releases=12_345_678_901, period_ns=123_456_789)
        for name, one in all_statistics(trace).items()
    }
    out = Console(file=StringIO(), width=width)
    print_tables(statistics_view(long, reconfigurations(trace)), out)
    shown = out.file.getvalue()
    for whole in ("control_of_a_robot", "12,345,678,901", "123 ms", "20 ns", "250 ns", "lost records"):
        assert whole in shown
    assert "\N{HORIZONTAL ELLIPSIS}" not in shown
    assert out.width == width


@pytest.mark.parametrize(
    ("time_ns", "told"),
    [
        (999, "999 ns"), (1_000, "1 us"), (999_499, "999 us"), (999_501, "1 ms"), (-999_999, "-1 ms"),
        (999_500_001, "1.000 s"), (1_234_567_890_123, "1,234.568 s"),
    ],
)  # fmt: skip
def test_a_time_has_three_digits_and_no_power(time_ns: int, told: str):
    assert time_text(time_ns) == told


def test_check_tells_losses(source: SyntheticSource, tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    source.drop("control", 7)
    bag = record(source, tmp_path / "bag")
    assert main(["trace", "check", bag]) == 1
    shown = capsys.readouterr().out
    assert (
        "loss: component 'control': 7 of 56 records (12.50%) are missing: 7 found no room in its ring"
        in shown
    )


def test_check_and_repair(source: SyntheticSource, tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    bag = record(source, tmp_path / "bag")
    assert main(["trace", "check", bag]) == 0
    assert "whole, nothing of the executor is missing" in capsys.readouterr().out
    (file,) = Path(bag).glob("*.mcap")
    os.truncate(file, file.stat().st_size - 100)
    (Path(bag) / "metadata.yaml").unlink()
    assert main(["trace", "check", bag]) == 1
    shown = capsys.readouterr().out
    assert "damage: bag_0.mcap: no finished MCAP file" in shown
    assert "damage: metadata.yaml: not there" in shown
    assert f"`mauve trace repair {bag}`" in shown
    assert main(["trace", "repair", bag]) == 0
    assert "repaired: bag_0.mcap" in capsys.readouterr().out
    assert main(["trace", "check", bag]) == 0
    assert main(["trace", "repair", bag]) == 0
    assert "nothing to repair" in capsys.readouterr().out
    assert len(mauve_rt.trace.open(bag).of("control")) == 49


@pytest.mark.parametrize("verb", ["info", "check", "repair", "stats"])
def test_what_is_no_bag(verb: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    assert main(["trace", verb, str(tmp_path)]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    (tmp_path / "x.mcap").write_bytes(b"something else")
    assert main(["trace", verb, str(tmp_path / "x.mcap")]) == 2
    assert "x.mcap: not an MCAP file" in capsys.readouterr().err


@pytest.mark.parametrize("verb", ["info", "check", "repair", "stats"])
def test_of_a_folder_of_bags_one_is_to_be_named(
    verb: str, source: SyntheticSource, tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    first = record(source, tmp_path / "bag" / "robot_1")
    assert main(["trace", verb, str(tmp_path / "bag")]) == 0
    alone = capsys.readouterr().out
    assert main(["trace", verb, first]) == 0
    assert capsys.readouterr().out == alone
    second = record(source, tmp_path / "bag" / "robot_2")
    assert main(["trace", verb, str(tmp_path / "bag")]) == 2
    error = capsys.readouterr().err
    assert f"expected one bag, found a folder of 2; name one of {first}, {second}" in error


def test_export_takes_a_folder_of_bags(source: SyntheticSource, tmp_path: Path):
    for robot in ("robot_1", "robot_2"):
        record(source, tmp_path / "bag" / robot)
    out = tmp_path / "all.pftrace"
    assert main(["trace", "export", str(tmp_path / "bag"), "--out", str(out)]) == 0
    one = tmp_path / "one.pftrace"
    assert main(["trace", "export", str(tmp_path / "bag" / "robot_1"), "--out", str(one)]) == 0
    assert all(name in out.read_bytes() for name in (b"robot_1", b"robot_2"))
    assert b"robot_2" not in one.read_bytes()


def test_report_takes_a_folder_of_bags(
    source: SyntheticSource, tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    for robot in ("robot_1", "robot_2"):
        record(source, tmp_path / "bag" / robot)
    assert main(["report", str(tmp_path / "bag")]) == 0
    page = tmp_path / "bag" / "report.html"
    assert capsys.readouterr().out.startswith(str(page))
    text = page.read_text(encoding="utf-8")
    assert "Trace of robot_1, robot_2" in text
    assert "robot_2/control" in text
