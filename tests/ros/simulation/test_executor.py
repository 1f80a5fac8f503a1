"""An executor in virtual time tells what a real one tells."""

from itertools import pairwise
from pathlib import Path

import pytest
from rclpy.qos import QoSProfile
from std_msgs.msg import Float64

from mauve_rt._kernel import Simulation
from mauve_rt.control.requests import Request, Step
from mauve_rt.simulation.executor import SimulatedExecutor
from mauve_rt.simulation.topics import Sample, SimulatedTopics
from mauve_rt.trace.reading.reader import open_trace
from mauve_rt.trace.report.analysis import analyse

FALLBACK = "executor_tests/Backwards"
S = 1_000_000_000


@pytest.fixture
def guarded(architecture: Path) -> Path:
    """`ARCHITECTURE`, its counter with a fallback core."""
    text = architecture.read_text(encoding="utf-8")
    architecture.write_text(
        text.replace("priority: 40", f"priority: 40, fallback: {FALLBACK}"), encoding="utf-8"
    )
    return architecture


def test_a_fallback_core_that_took_over_is_an_event(guarded: Path, tmp_path: Path) -> None:
    simulation, topics = Simulation(), SimulatedTopics()
    heard: list[Sample] = []
    executor = SimulatedExecutor(simulation, topics, guarded, tmp_path / "bag", complain=pytest.fail)
    topics.listen("/robot_1/executor/events", heard.append)
    simulation.deploy()
    executor.activate()
    simulation.run_until(simulation.epoch_ns() + S)
    executor.refresh()
    assert heard == []
    topics.say(
        "/robot_1/set",
        "std_msgs/msg/Float64",
        Float64(data=-1e7),
        time_ns=simulation.now_ns(),
        qos=QoSProfile(depth=1),
    )
    simulation.run_until(simulation.epoch_ns() + 2 * S)
    executor.refresh()
    executor.refresh()
    (event,) = [sample.message() for sample in heard]
    assert (event.requested_by, event.success) == ("kernel", True)
    assert "set to something unheard of (in state Count" in event.cause
    assert (event.from_core, event.to_core) == ("executor_tests/Counter", FALLBACK)
    executor.close()


def test_each_component_is_told_of_its_own_change(architecture: Path, tmp_path: Path) -> None:
    simulation, topics = Simulation(), SimulatedTopics()
    executor = SimulatedExecutor(simulation, topics, architecture, tmp_path / "bag", complain=pytest.fail)
    simulation.deploy()
    executor.activate()
    simulation.run_until(simulation.epoch_ns() + S)
    steps = (
        Step("replace_core", "counter", FALLBACK),
        Step("set_property", "counter", "step", "2.0"),
        Step("set_property", "sleepy", "step", "3.0"),
    )
    outcome = executor.handle(Request(steps=steps))
    assert outcome.success, outcome.message
    assert [(step.component, step.to_core) for step in outcome.report] == [
        ("counter", FALLBACK),
        ("counter", ""),
        ("sleepy", ""),
    ]
    simulation.run_until(simulation.epoch_ns() + 6 * S)
    executor.record()
    executor.close()
    trace = open_trace(tmp_path / "bag")
    swaps = analyse(trace, events=trace.messages("mauve_msgs/msg/ReconfigurationEvent")).swaps
    assert [
        (swap.measured.component, swap.measured.what, swap.request and swap.request.to_core) for swap in swaps
    ] == [
        ("counter", f"set_property step, replace_core {FALLBACK}", FALLBACK),
        ("sleepy", "set_property step", ""),
    ]


def test_a_bag_has_the_shadows_by_virtual_time(architecture: Path, tmp_path: Path) -> None:
    simulation, topics = Simulation(), SimulatedTopics()
    executor = SimulatedExecutor(simulation, topics, architecture, tmp_path / "bag", complain=pytest.fail)
    simulation.every(simulation.now_ns(), S // 10, executor.record)
    simulation.deploy()
    executor.activate()
    simulation.run_until(simulation.epoch_ns() + S)
    step = Step("shadow", "counter", FALLBACK, "{budget_us: 1000}")
    outcome = executor.handle(Request(steps=(step,)))
    assert outcome.success, outcome.message
    simulation.run_until(simulation.epoch_ns() + 4 * S)
    executor.close()
    trace = open_trace(tmp_path / "bag")
    *running, last = trace.shadow_reports
    times = [one.time_ns for one in running]
    assert [after - before for before, after in pairwise(times)] == [S, S]
    assert {one.verdict for one in running} == {"running"}
    assert (last.verdict, last.end_ns) == ("ended", simulation.now_ns())
    assert trace.shadows == (last,)
    assert 0 < last.compared <= last.releases
