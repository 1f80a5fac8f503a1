"""CLOCK_REALTIME is set while the executor runs: nothing that it does waits for the clock to come back."""

import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.qos import DurabilityPolicy, QoSProfile
from ros_processes import ExecutorProcess
from std_msgs.msg import Float64
from stepped_clock import SteppedClock

from mauve_msgs.msg import SupervisorDecision
from mauve_msgs.srv import ListComponents, Stop

NODE = "/robot_1/executor"
STEP_S = 600  # longer than a test waits for anything
RULES = """\
mauve: 1
rules:
  - name: quiet
    when: {silence: {resource: set, longer_than_s: 4.0}}
    do: [{kind: replace_core, target: counter, name: executor_tests/Backwards}]
"""


@pytest.mark.parametrize("step_s", [-STEP_S, STEP_S])
def test_services_and_rules_go_on_after_a_step_of_the_clock(
    start_executor: Callable[..., ExecutorProcess],
    architecture: Path,
    graph: Any,
    tmp_path: Path,
    step_s: int,
) -> None:
    clock = SteppedClock(tmp_path)
    rules = tmp_path / "rules.yaml"
    rules.write_text(RULES, encoding="utf-8")
    executor = start_executor(
        *("-p", f"architecture:={architecture}", "-p", f"rules:={rules}"), environment=clock.environment
    )
    counts = graph.hear(Float64, "/robot_1/count")
    health = graph.hear(DiagnosticArray, "/diagnostics")
    latched = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    decisions = graph.hear(SupervisorDecision, f"{NODE}/decisions", latched)
    voice = graph.voice(Float64, "/robot_1/set")
    speaking = graph.node.create_timer(0.1, lambda: voice.publish(Float64()))
    graph.spin_until(lambda: counts and health, "the executor to run")

    clock.step(step_s)
    del counts[:], health[:], decisions[:]
    graph.spin_until(lambda: len(health) > 6, "its health, for longer than the rule waits")
    assert len(counts) > 100
    assert [one.decision for one in decisions] == []
    assert "counter" in [one.name for one in graph.ask(ListComponents, f"{NODE}/list_components").components]
    assert graph.ask(Stop, f"{NODE}/stop", component="sleepy").success
    how = "forward" if step_s > 0 else "back"
    step = f"the clock of this machine was set {how} by {STEP_S}.0 s"
    executor.await_output(step)
    assert any(step in status.message for array in health for status in array.status)

    speaking.cancel()
    graph.spin_until(lambda: "done" in [one.decision for one in decisions], "the rule to act")
    status, _ = executor.end(signal.SIGTERM)
    assert status == 0
    assert executor.output.count("the clock of this machine was set") == 1
