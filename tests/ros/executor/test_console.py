"""What an executor says on the console and on /rosout: one line for each thing that happens."""

import io
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rcl_interfaces.msg import Log
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import serialize_message
from rich.console import Console as RichConsole
from std_msgs.msg import Float64

from mauve_msgs.msg import ReconfigurationStep
from mauve_msgs.srv import ListComponents, Reconfigure, ReplaceCore, Start, Stop
from mauve_rt.cli.list_view import print_components
from mauve_rt.node.executor.console import REFUSED_EVERY_S, TopicWatch

NODE = "/robot_1/executor"
INFO, WARN = b"\x14"[0], b"\x1e"[0]
KEPT = QoSProfile(depth=1000, durability=DurabilityPolicy.TRANSIENT_LOCAL)
BUFFER = """\
  few: {kind: ring_buffer, type: std_msgs/msg/Float64, capacity: 2,
        topic: {name: few, direction: subscribe}}
  whole: {kind: shared_data, type: std_msgs/msg/Float64, topic: {name: whole, direction: subscribe}}
connections:
"""


class Console:
    """The lines of one executor, on /rosout and on its stderr."""

    def __init__(self, graph: Any) -> None:
        self._graph = graph
        self._heard = graph.hear(Log, "/rosout", KEPT)

    def await_line(self, executor: Any, level: int, *parts: str) -> str:
        """One line with all of these parts, and no other one."""

        def found() -> list[str]:
            return [
                log.msg
                for log in self._heard
                if log.name == "robot_1.executor" and log.level == level and all(p in log.msg for p in parts)
            ]

        self._graph.spin_until(found, f"{parts} on /rosout; {executor.output}")
        (line,) = found()

        def printed() -> list[str]:
            return [each for each in executor.output.splitlines() if line in each]

        self._graph.spin_until(lambda: bool(printed()), f"{line} on the console")
        assert len(printed()) == 1
        return line


def test_a_line_for_each_step_of_a_life(
    architecture: Path, start_executor: Callable[..., Any], graph: Any
) -> None:
    console = Console(graph)
    executor = start_executor("-p", f"architecture:={architecture}")
    console.await_line(executor, INFO, f"configured: {architecture}: 3 components, 2 resources")
    console.await_line(executor, INFO, "activated: 3 components")
    record = {"requested_by": "me", "cause": "a\ntest\x1b"}
    graph.ask(Stop, f"{NODE}/stop", component="counter", **record)
    stopped = console.await_line(executor, INFO, "request by me (a test?): stop counter: done, revision ")
    assert stopped.endswith("component 'counter' is stopped")
    graph.ask(Start, f"{NODE}/start", component="counter")
    console.await_line(executor, INFO, "request: start counter: done, ")
    graph.ask(ReplaceCore, f"{NODE}/replace_core", component="counter", core="executor_tests/Backwards")
    console.await_line(executor, INFO, "request: replace_core counter executor_tests/Backwards: done, ")
    steps = [ReconfigurationStep(kind="set_property", target="counter", name="step", value="99")]
    graph.ask(Reconfigure, f"{NODE}/reconfigure", steps=steps)
    refused = console.await_line(executor, WARN, "request: set_property counter step 99: refused, INVALID: ")
    assert "expected at least 0 and at most 10, found 99" in refused
    for transition, line in (
        (Transition.TRANSITION_DEACTIVATE, "deactivated: outputs are safe, components parked"),
        (Transition.TRANSITION_CLEANUP, "cleaned up: nothing is configured"),
    ):
        graph.ask(ChangeState, f"{NODE}/change_state", transition=Transition(id=transition))
        console.await_line(executor, INFO, line)


def test_misfits_and_refused_messages(
    architecture: Path, start_executor: Callable[..., Any], graph: Any
) -> None:
    text = architecture.read_text(encoding="utf-8").replace("connections:\n", BUFFER)
    architecture.write_text(text, encoding="utf-8")
    console = Console(graph)
    best_effort = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
    misfit = graph.node.create_publisher(Float64, "/robot_1/set", best_effort)
    executor = start_executor("-p", f"architecture:={architecture}")
    fits_not = (
        "topic /robot_1/set of resource 'set': another node's quality of service does not fit, in reliab"
    )
    console.await_line(executor, WARN, fits_not)
    few = graph.voice(Float64, "/robot_1/few")
    for number in range(5):
        few.publish(Float64(data=float(number)))
    few_are_refused = "topic /robot_1/few of resource 'few': "
    line = console.await_line(executor, WARN, few_are_refused, "refused: ")
    assert line.endswith("refused: the ring_buffer was full: 2 elements")
    short = graph.voice(Float64, "/robot_1/whole")
    short.publish(serialize_message(Float64())[:6])
    line = console.await_line(executor, WARN, "topic /robot_1/whole of resource 'whole': 1 message refused")
    assert "bytes are no whole std_msgs/msg/Float64" in line
    assert misfit is not None


def test_refused_messages_are_told_at_once_and_then_counted() -> None:
    told: list[str] = []
    now = 0.0
    watch = TopicWatch(SimpleNamespace(warning=told.append), now=lambda: now)  # type: ignore[arg-type]

    def look(refused: int) -> list[str]:
        told.clear()
        troubles = SimpleNamespace(incompatible_qos=0)
        report = SimpleNamespace(topic="/t", resource="r", refused=refused, troubles=troubles, refusal="full")
        watch.look([report], {})  # type: ignore[list-item]
        return [line.partition(": ")[2].partition(":")[0] for line in told]

    assert look(0) == []
    assert look(1) == ["1 message refused"]
    now = REFUSED_EVERY_S / 2
    assert look(500) == []
    now = REFUSED_EVERY_S
    assert look(500) == ["499 messages refused"]
    now *= 3
    assert look(500) == []
    assert look(3) == ["3 messages refused"], "bound anew, it counts from 0"


def test_two_executors_of_one_name(
    architecture: Path, start_executor: Callable[..., Any], graph: Any
) -> None:
    console = Console(graph)
    first = start_executor("-p", f"architecture:={architecture}")
    graph.ask(ListComponents, f"{NODE}/list_components")
    second = start_executor("-p", f"architecture:={architecture}")
    for executor in (first, second):
        graph.spin_until(
            lambda executor=executor: f"name: 2 nodes are called {NODE}" in executor.output,
            "the warning of both",
        )
    (warning,) = graph.ask(ListComponents, f"{NODE}/list_components").warnings
    assert warning.startswith(f"2 nodes are called {NODE}: requests are answered by any of them")
    printed = io.StringIO()
    print_components(ListComponents.Response(warnings=[warning]), RichConsole(file=printed, width=200))
    assert f"warning: {warning}" in printed.getvalue()
    second.process.terminate()
    assert second.wait() == 0
    console.await_line(first, INFO, "name: no other node has this name any more")
